"""An arm with three of eleven joints locked goes through a singularity on a straight line.

You will see the path wait while the arm unfolds, and the tip stay on the line within a millimetre; with
targets by the clock the nearest motion leaves it.
"""

import argparse

import numpy as np

import ftqp

argparse.ArgumentParser(description=__doc__).add_argument(
    "--headless", action="store_true", help="no windows"
)

robot = ftqp.robots.load("modular11")
start = np.deg2rad([0.0, -50.0, 0.0, -30.0, 0.0, 70.0, 0.0, 30.0, 0.0, 0.0, 0.0])
path = ftqp.paths.Line(robot.pose(start), (-2.54, 0.0, 0.0), duration=20.0, law="constant")
worst = {}
for mode in ("scaled", "slack"):
    task = ftqp.Task(mode=mode, kp=2.0)
    planner = ftqp.Planner(robot, dt=1e-2, level="velocity", task=task, emergency=None)
    for joint in ("j2", "j4", "j7"):
        planner.report(ftqp.Locked(joint, mode="instant"))
    q, v, worst[mode] = start.copy(), np.zeros(robot.nv), 0.0
    planner.reset(q)
    follower = ftqp.PathFollower(planner, path) if mode == "scaled" else None
    k = 0
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
        worst[mode] = max(worst[mode], np.linalg.norm((robot.pose(q) - path.start)[1:3, 3]))
        k += 1

print(f"by progress, distance from the line: {1e3 * worst['scaled']:.1f} mm")
print(f"by the clock, distance from the line: {1e3 * worst['slack']:.1f} mm")
print(f"time for the 20 s of the path: {finished:.2f} s")
