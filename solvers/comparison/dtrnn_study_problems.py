"""The QPs of study_dtrnn: random ones of a chosen difficulty, scaled ones, and those of a published path."""

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

    Args:
        rng: Source of randomness.
        condition: The condition of W.
        active: How many of the bounds are active, at most n - m.
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


def expanded(problem: QP) -> QP:
    """The same QP without fixed variables and two-sided rows: a row of C becomes an equality with a slack s.

    Rows are divided by their norm, rows without a bound left out, as ``ftqp.kernel.dtrnn.projection`` does
    it."""
    free = problem.lb < problem.ub
    H, A = problem.H[np.ix_(free, free)], problem.A[:, free]
    fixed = np.where(free, 0.0, problem.ub)
    g, b = (problem.g + problem.H @ fixed)[free], problem.b - problem.A @ fixed
    bounded = np.isfinite(problem.l) | np.isfinite(problem.u)
    C, moved = problem.C[bounded][:, free], problem.C[bounded] @ fixed
    norm = np.linalg.norm(C, axis=1)
    C, l, u = C / norm[:, None], (problem.l[bounded] - moved) / norm, (problem.u[bounded] - moved) / norm
    n, p = len(g), len(norm)
    return QP(
        np.block([[H, np.zeros((n, p))], [np.zeros((p, n)), np.zeros((p, p))]]),
        np.append(g, np.zeros(p)),
        np.block([[A, np.zeros((len(b), p))], [C, -np.eye(p)]]),
        np.append(b, np.zeros(p)),
        lb=np.append(problem.lb[free], l),
        ub=np.append(problem.ub[free], u),
    )


def rule(problem: QP) -> tuple[float, float]:
    """Scales of objective and rows that the network chooses for an expanded QP, from the spectra of W and A.

    s = 1/sqrt(max(lambda_min, 1e-9 lambda_max) lambda_max),  q = 10/max(sigma_min, 1e-3 sigma_max)

    Slacks, the variables without an objective, do not count.
    """
    real = np.abs(problem.H).sum(axis=1) > 0.0
    W = np.linalg.eigvalsh(problem.H[np.ix_(real, real)])
    s = 1.0 / np.sqrt(max(W[0], 1e-9 * W[-1]) * W[-1])
    A = np.linalg.svd(problem.A[:, real], compute_uv=False)
    return float(s), float(10.0 / max(A[-1], 1e-3 * A[0]))


def scaled(problem: QP, s: float, q: float) -> QP:
    """The QP with its objective times s and its rows of A times q; its solution x is the same."""
    return QP(s * problem.H, s * problem.g, q * problem.A, q * problem.b, lb=problem.lb, ub=problem.ub)


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
