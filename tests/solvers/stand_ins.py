"""QPs whose answers are known."""

import numpy as np
from comparison.recorded import Recorded

from ftqp.qp import QP, QPBuffers

SOLUTION = np.array([1.0, -1.0])
SOLVABLE = QP(np.eye(2), [-3.0, 3.0], lb=[-1.0, -1.0], ub=[1.0, 1.0])
"""x = (1, -1), z_box = (2, -2)."""
INFEASIBLE = QP(np.eye(2), [-3.0, 3.0], A=[[1.0, 1.0]], b=[9.0], lb=[-1.0, -1.0], ub=[1.0, 1.0])


def sequence(*problems: QP) -> Recorded:
    """A sequence of problems of one size, with the right answer to SOLVABLE and none to others."""
    flats, solutions = [], []
    for problem in problems:
        qp = QPBuffers.zeros(problem.n, problem.m, problem.p)
        for part in ("H", "g", "A", "b", "C", "l", "u", "lb", "ub"):
            getattr(qp, part)[...] = getattr(problem, part)
        flats.append(qp.flat)
        known = problem is SOLVABLE
        x = SOLUTION if known else np.full(2, np.nan)
        z_box = 2.0 * SOLUTION if known else np.full(2, np.nan)
        solutions.append((x, np.zeros(problem.m), np.zeros(problem.p), z_box))
    return Recorded(
        name="stand-in", problems=list(problems), packed=np.array(flats), solutions=solutions, origin={}
    )
