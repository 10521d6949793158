"""A line that is too fast for the arm, in three modes of the task.

`slack` and `lexicographic` come as near to the speed as they can and drift; `scaled` slows down and stays
on the line.
"""

import argparse

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("panda")
start = robot.pose(robot.neutral)
direction = np.array([0.0, 0.8, 0.6])
twist = [*(3.0 * direction), 0.0, 0.0, 0.0]  # 3 m/s, which the arm cannot do

ways = {}
for mode in ("slack", "scaled", "lexicographic"):
    task = ftqp.Task(rows="position", mode=mode, kp=0.0)
    planner = ftqp.Planner(robot, dt=2e-3, level="velocity", task=task, emergency=None)
    q, v = robot.neutral.copy(), np.zeros(robot.nv)
    planner.reset(q)
    at = []
    for _ in range(80):
        step = planner.step(q, v, ftqp.Target(pose=start, twist=twist))
        q, v = step.q.copy(), step.v.copy()
        at.append(1e3 * (robot.pose(q) - start)[:3, 3])
    travelled = robot.pose(q)[:3, 3] - start[:3, 3]
    beside = np.linalg.norm(np.cross(travelled, direction))
    ways[mode] = (at @ direction, np.linalg.norm(np.cross(at, direction), axis=1))
    print(f"{mode}: {1e3 * beside:.2f} mm off the line, {1e3 * travelled @ direction:.0f} mm along it")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    title, x_label = "A line that is too fast, in three modes", "along the line [mm]"
    draw_loop(given.figure, title, {"off the line [mm]": ways}, x_label=x_label)
