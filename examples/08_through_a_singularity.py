"""An arm with three of eleven joints locked goes through a singularity.

The path waits while the arm unfolds, and the end effector stays on the line.
"""

import argparse

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("modular11")
start = np.deg2rad([0.0, -50.0, 0.0, -30.0, 0.0, 70.0, 0.0, 30.0, 0.0, 0.0, 0.0])
path = ftqp.paths.Line(robot.pose(start), (-2.54, 0.0, 0.0), duration=20.0, law="constant")
worst: dict[str, float] = {}
away: dict[str, list[float]] = {}
for mode in ("slack", "scaled"):
    task = ftqp.Task(mode=mode, kp=2.0)
    planner = ftqp.Planner(robot, dt=1e-2, level="velocity", task=task, emergency=None)
    for joint in ("j2", "j4", "j7"):
        planner.report(ftqp.Locked(joint, mode="instant"))
    q, v, worst[mode] = start.copy(), np.zeros(robot.nv), 0.0
    planner.reset(q)
    follower = ftqp.PathFollower(planner, path) if mode == "scaled" else None
    k, away[mode], motion = 0, [], [start]
    while k < 4000 if follower else k < 2000:
        if follower:
            step = follower.step(q, v)
            if follower.status is ftqp.PathStatus.DONE:
                finished = k * planner.dt
                break
        else:
            sample = path.sample(k * planner.dt)
            step = planner.step(q, v, ftqp.Target(pose=sample.pose[0], twist=sample.twist[0]))
        q, v = step.q.copy(), step.v.copy()
        away[mode].append(1e3 * float(np.linalg.norm((robot.pose(q) - path.start)[1:3, 3])))
        worst[mode] = max(away[mode])
        motion.append(q)
        k += 1

print(f"by progress, distance from the line: {worst['scaled']:.1f} mm")
print(f"by the clock, distance from the line: {worst['slack']:.1f} mm")
print(f"time for the 20 s of the path: {finished:.2f} s")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    names = {"scaled": "by progress", "slack": "by the clock"}
    curves = {names[mode]: (1e-2 * np.arange(len(away[mode])), away[mode]) for mode in names}
    title = "Three of eleven joints locked, through a singularity"
    draw_loop(given.figure, title, {"off the line [mm]": curves}, arm=(robot, motion))
