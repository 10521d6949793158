"""A Panda finishes its circle although its third joint locks half-way.

The error of the end effector stays far below a millimetre: six joints are enough once the planner knows.
"""

import argparse

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("panda")
planner = ftqp.Planner(robot, dt=2e-3)
q, v = robot.neutral.copy(), np.zeros(robot.nv)
path = ftqp.paths.Circle(robot.pose(q), 0.05, duration=4.0, axes=("y", "z"))
times = np.arange(0.0, path.duration, planner.dt)
sample = path.sample(times)

planner.reset(q)
target = ftqp.Target(pose=path.start)
worst = moved = 0.0
motion, errors = [], []
for k, t in enumerate(times):
    if k == len(times) // 2:
        planner.report(ftqp.Locked("panda_joint3"))
    step = planner.step(q, v, target.at(sample.pose[k], sample.twist[k], sample.acceleration[k]))
    worst = max(worst, step.position_error)
    motion.append(step.q.copy())
    errors.append(1e3 * step.position_error)
    if t > 3.0:
        moved = max(moved, abs(step.v[2]))
    q, v = step.q.copy(), step.v.copy()

print(f"largest position error: {1e3 * worst:.3f} mm")
print(f"speed of the locked joint at the end: {moved:.1f} rad/s")
print(
    f"distance from the end of the circle: {1e3 * np.linalg.norm((robot.pose(q) - path.start)[:3, 3]):.3f} mm"
)

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    curves = {"off the circle [mm]": {"end effector": (times, errors)}, "joints [rad]": {}}
    for name, values in zip(robot.joints, np.transpose(motion), strict=True):
        curves["joints [rad]"][name.removeprefix("panda_")] = (times, values)
    title = "A Panda loses joint 3 on its circle"
    draw_loop(given.figure, title, curves, arm=(robot, motion), fault=(2.0, "joint 3 locks"))
