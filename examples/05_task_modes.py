"""A line that is too fast for the arm, in three modes of the task.

You will see how far each ends up from the straight line: `slack` and `lexicographic` come as near to the
speed as they can and drift to the side, `scaled` slows down and stays on the line.
"""

import argparse

import numpy as np

import ftqp

argparse.ArgumentParser(description=__doc__).add_argument(
    "--headless", action="store_true", help="no windows"
)

robot = ftqp.robots.load("panda")
start = robot.pose(robot.neutral)
direction = np.array([0.0, 0.8, 0.6])
twist = [*(3.0 * direction), 0.0, 0.0, 0.0]  # 3 m/s, which the arm cannot do

for mode in ("slack", "scaled", "lexicographic"):
    task = ftqp.Task(rows="position", mode=mode, kp=0.0)
    planner = ftqp.Planner(robot, dt=2e-3, level="velocity", task=task, emergency=None)
    q, v = robot.neutral.copy(), np.zeros(robot.nv)
    planner.reset(q)
    for _ in range(80):
        step = planner.step(q, v, ftqp.Target(pose=start, twist=twist))
        q, v = step.q.copy(), step.v.copy()
    travelled = robot.pose(q)[:3, 3] - start[:3, 3]
    beside = np.linalg.norm(np.cross(travelled, direction))
    print(f"{mode}: {1e3 * beside:.2f} mm beside the line, {1e3 * travelled @ direction:.0f} mm along it")
