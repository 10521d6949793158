"""A joint without motor and brake swings freely under gravity.

The remaining joints lead the arm to where it can rest. No torque is asked of the failed joint.
"""

import argparse

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("panda")
planner = ftqp.Planner(robot, dt=2e-3, task=ftqp.Task(rows="position"), emergency=None)
q, v = robot.neutral.copy(), np.zeros(robot.nv)
target = ftqp.Target(position=robot.pose(q)[:3, 3])

planner.reset(q)
planner.report(ftqp.FreeSwinging("panda_joint5", damping=0.5))
worst = torque = 0.0
motion, errors = [], []
for _ in range(2000):
    step = planner.step(q, v, target)
    worst, torque = max(worst, step.position_error), max(torque, abs(step.tau[4]))
    q, v = step.q.copy(), step.v.copy()
    motion.append(q)
    errors.append(1e3 * step.position_error)

print(f"largest position error: {1e3 * worst:.3f} mm")
print(f"torque asked of the failed joint: {torque:.1f} N m")
print(f"swing of the failed joint: {abs(q[4] - robot.neutral[4]):.3f} rad")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    t = planner.dt * np.arange(len(motion))
    curves = {
        "off its place [mm]": {"end effector": (t, np.array(errors))},
        "joint 5 [rad]": {"free-swinging": (t, np.array(motion)[:, 4])},
    }
    draw_loop(given.figure, "A Panda's fifth joint swings freely", curves, arm=(robot, motion))
