"""An arm on a swaying base keeps its tool in its place, also when a joint locks.

The base carries the arm about by a hand's breadth, and is seen only through the tool's measured pose.
"""

import argparse

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("iiwa14")
planner = ftqp.Planner(robot, dt=5e-3, level="velocity")
follower = ftqp.InertialTask(planner, ftqp.MovingBase(observer=ftqp.Observer()))


def base(t: float) -> np.ndarray:
    """Pose of the base in space: this is the world's, the planner never sees it."""
    angle, T = 0.1 * (1.0 - np.cos(1.2 * t)), np.eye(4)
    T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    T[:3, 3] = 0.04 * (1.0 - np.cos(1.7 * t)), 0.0, 0.03 * (1.0 - np.cos(0.9 * t))
    return T


q, v = robot.neutral.copy(), np.zeros(robot.nv)
follower.reset(q)
home = robot.pose(q)
target = ftqp.Target(pose=base(0.0) @ home)
carried = worst = 0.0
motion, errors, moved = [], [], []
for k in range(2000):
    if k == 1000:
        planner.report(ftqp.Locked("iiwa_joint_3"))
    step = follower.step(q, v, target, tip=base(k * planner.dt) @ robot.pose(q))
    away = float(np.linalg.norm((base(k * planner.dt) @ home - target.pose)[:3, 3]))
    held = float(np.linalg.norm(follower.error[:3]))
    carried, worst = max(carried, away), max(worst, held)
    q, v = step.q.copy(), step.v.copy()
    motion.append(q)
    errors.append(1e6 * held)
    moved.append(1e3 * away)

print(f"the base carries a rigid tool away by: {1e3 * carried:.1f} mm")
print(f"largest error of the held tool: {1e3 * worst:.4f} mm")
print(f"speed of the locked joint at the end: {step.v[2]:.1f} rad/s")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    t = planner.dt * np.arange(len(motion))
    curves = {"rigid tool [mm]": {"moved": (t, moved)}, "held tool [µm]": {"error": (t, errors)}}
    title, lost = "A tool held in space from a base that sways", (5.0, "joint 3 locks")
    draw_loop(given.figure, title, curves, arm=(robot, motion), fault=lost)
