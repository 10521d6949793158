"""The QPs of study_dtrnn: random ones of a chosen difficulty, and those of a published path."""

from functools import partial
from typing import Any

import numpy as np
from comparison.recipes import JIN, SQUARE, load, locked
from comparison.recorded import Recorded, recorded

import ftqp
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.qp import QP, Recorder, SolveStatus, solve
from ftqp.sim.schedule import Schedule

VARIABLES, ROWS = 7, 3
"""Size of the random QPs: an arm of seven joints with a position task."""
TICKS = 2001
"""Ticks of the square path: 20 s at 0.01 s."""
OBJECTIVES = ("RMP", "DLSM", "IIWT", "MTN", "gravity")
"""What is minimised on the square; ``gravity`` is DLSM in a vertical plane with viability bounds."""
LOCK = locked(0, 15.0, "instant")


def random_qp(rng: np.random.Generator, condition: float, active: int) -> tuple[QP, FloatArray]:
    """A QP 1/2 (x - x_0)'W(x - x_0) with Ax = b and a box, and its solution, (n,).

    W has eigenvalues from 1 down to 1/condition, evenly apart on a logarithmic axis, along random directions;
    A, x_0 and a feasible point are normally distributed. As many bounds as shall be active cut off the
    solution without bounds; the others are 0.1 to 2 away from the solution.
    """
    n, m = VARIABLES, ROWS
    directions, _ = np.linalg.qr(rng.normal(size=(n, n)))
    W = (directions * np.logspace(0.0, -np.log10(condition), n)) @ directions.T
    W = 0.5 * (W + W.T)
    while True:
        A, g = rng.normal(size=(m, n)), -W @ rng.normal(size=n)
        b = A @ rng.normal(size=n)
        x = solve(QP(W, g, A, b)).x
        lb, ub = np.full(n, -np.inf), np.full(n, np.inf)
        for i in rng.permutation(n)[:active]:
            cut = rng.uniform(0.1, 1.0)
            if rng.random() < 0.5:
                ub[i] = x[i] - cut
            else:
                lb[i] = x[i] + cut
        answer = solve(QP(W, g, A, b, lb=lb, ub=ub))
        if answer.status is SolveStatus.SOLVED and np.count_nonzero(answer.z_box) == active:
            x = answer.x
            lb = np.where(np.isfinite(lb), lb, x - rng.uniform(0.1, 2.0, n))
            ub = np.where(np.isfinite(ub), ub, x + rng.uniform(0.1, 2.0, n))
            return QP(W, g, A, b, lb=lb, ub=ub), x


def square(objective: str) -> tuple[Recorded, BoolArray]:
    """The QPs of the square of Jin et al. 2017 in order, and at which a warm start must not be used, (2001,).

    Joint 1 locks at 15 s with RMP, DLSM and MTN; nothing fails with IIWT and in the vertical plane.
    """
    planner: dict[str, Any] = dict(JIN)
    robot = partial(load, "planar6")()
    if objective == "gravity":
        robot = ftqp.robots.load("planar6", vertical=True)
        planner["bounds"] = "viability"
    elif objective != "DLSM":
        planner["scheme"] = objective.lower()
    schedule = Schedule(() if objective in ("IIWT", "gravity") else (LOCK,))
    recorder = Recorder("active_set")
    leader = ftqp.Planner(robot, **planner, emergency=None, backend=recorder)
    recorder.follow(leader)
    path = SQUARE(robot.pose(robot.neutral))
    ftqp.Simulation(leader, path, q=robot.neutral, schedule=schedule, duration=(TICKS - 1) * leader.dt).run()
    recording = recorder.recording(dt=leader.dt)
    return recorded(objective, recording), recording.cold
