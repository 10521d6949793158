"""The same run with another QP solver: one word changes, the motion does not.

You will see by how much the final configurations of three solvers differ from that of the built-in one.
"""

import argparse

import numpy as np

import ftqp

argparse.ArgumentParser(description=__doc__).add_argument(
    "--headless", action="store_true", help="no windows"
)

robot = ftqp.robots.load("panda")
path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.05, duration=2.0, axes=("y", "z"))
times = np.arange(0.0, path.duration, 2e-3)
sample = path.sample(times)


def final_configuration(backend):
    """Where the arm ends when `backend` solves its QPs and joint 3 locks half-way."""
    planner = ftqp.Planner(robot, dt=2e-3, backend=backend)
    q, v = robot.neutral.copy(), np.zeros(robot.nv)
    planner.reset(q)
    target = ftqp.Target(pose=path.start)
    for k in range(len(times)):
        if k == len(times) // 2:
            planner.report(ftqp.Locked("panda_joint3"))
        step = planner.step(q, v, target.at(sample.pose[k], sample.twist[k], sample.acceleration[k]))
        q, v = step.q.copy(), step.v.copy()
    return q


reference = final_configuration("active_set")
for backend in ("daqp", "proxqp", {"name": "osqp", "tolerance": 1e-9}):
    name = backend if isinstance(backend, str) else backend["name"]
    difference = np.abs(final_configuration(backend) - reference).max()
    print(f"{name} ends {difference:.1e} rad from active_set")
