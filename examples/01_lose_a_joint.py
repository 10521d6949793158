"""A Panda draws a circle, its third joint locks half-way, and it finishes the circle.

You will see the tip's error stay far below a millimetre: six joints are enough once the planner knows.
"""

import argparse

import numpy as np

import ftqp

argparse.ArgumentParser(description=__doc__).add_argument(
    "--headless", action="store_true", help="no windows"
)

robot = ftqp.robots.load("panda")
planner = ftqp.Planner(robot, dt=2e-3)
q, v = robot.neutral.copy(), np.zeros(robot.nv)
path = ftqp.paths.Circle(robot.pose(q), 0.05, duration=4.0, axes=("y", "z"))
times = np.arange(0.0, path.duration, planner.dt)
sample = path.sample(times)

planner.reset(q)
target = ftqp.Target(pose=path.start)
worst = moved = 0.0
for k, t in enumerate(times):
    if k == len(times) // 2:
        planner.report(ftqp.Locked("panda_joint3"))
    step = planner.step(q, v, target.at(sample.pose[k], sample.twist[k], sample.acceleration[k]))
    worst = max(worst, step.position_error)
    if t > 3.0:
        moved = max(moved, abs(step.v[2]))
    q, v = step.q.copy(), step.v.copy()

print(f"largest position error: {1e3 * worst:.3f} mm")
print(f"speed of the locked joint at the end: {moved:.1f} rad/s")
print(
    f"distance from the end of the circle: {1e3 * np.linalg.norm((robot.pose(q) - path.start)[:3, 3]):.3f} mm"
)
