"""Another QP solver: one word changes, the motion does not.

How far the final configurations of three solvers are from that of the built-in one.
"""

import argparse
from typing import Any

import numpy as np

import ftqp

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--headless", action="store_true", help="no windows")
arguments.add_argument("--figure", metavar="FILE", help="save a picture here")
given = arguments.parse_args()

robot = ftqp.robots.load("panda")
path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.05, duration=2.0, axes=("y", "z"))
times = np.arange(0.0, path.duration, 2e-3)
sample = path.sample(times)


def motion(backend: str | dict[str, Any]) -> np.ndarray:
    """How the arm moves when `backend` solves its QPs and joint 3 locks half-way."""
    planner = ftqp.Planner(robot, dt=2e-3, backend=backend)
    q, v = robot.neutral.copy(), np.zeros(robot.nv)
    planner.reset(q)
    target, made = ftqp.Target(pose=path.start), []
    for k in range(len(times)):
        if k == len(times) // 2:
            planner.report(ftqp.Locked("panda_joint3"))
        step = planner.step(q, v, target.at(sample.pose[k], sample.twist[k], sample.acceleration[k]))
        q, v = step.q.copy(), step.v.copy()
        made.append(q)
    return np.array(made)


reference = motion("active_set")
differences = {}
backends: dict[str, str | dict[str, Any]]
backends = {"daqp": "daqp", "proxqp": "proxqp", "osqp": {"name": "osqp", "tolerance": 1e-9}}
for name, backend in backends.items():
    difference = np.abs(motion(backend) - reference).max(axis=1)
    differences[name] = (times, np.maximum(difference, 1e-17))
    print(f"{name} ends {difference[-1]:.1e} rad from active_set")

if given.figure:
    from ftqp.viz.figures.loop_picture import draw_loop

    label, title = "from active_set [rad]", "The same motion by three other solvers"
    draw_loop(given.figure, title, {label: differences}, logarithmic=[label], fault=(1.0, "joint 3 locks"))
