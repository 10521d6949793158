"""QPs whose answers are known, and backends that say what they are told to say."""

import os
import time
from typing import Any

import numpy as np
from bench.contenders import Contender
from comparison.recorded import Recorded

from ftqp.qp import QP, Backend, Claim, QPBuffers

SOLUTION = np.array([1.0, -1.0])
SOLVABLE = QP(np.eye(2), [-3.0, 3.0], lb=[-1.0, -1.0], ub=[1.0, 1.0])
"""x = (1, -1), z_box = (2, -2)."""
INFEASIBLE = QP(np.eye(2), [-3.0, 3.0], A=[[1.0, 1.0]], b=[9.0], lb=[-1.0, -1.0], ub=[1.0, 1.0])


class Scripted(Backend):
    """Answers every QP with the same claim and the same point."""

    package = "ftqp"

    def __init__(self, claim: Claim, x: Any = SOLUTION, z_box: Any = (2.0, -2.0)) -> None:
        super().__init__("scripted")
        self._claim, self._x, self._z_box = claim, x, z_box

    def _prepare(self, qp: QPBuffers) -> None:
        pass

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        qp.x[:], qp.z_box[:] = self._x, self._z_box
        qp.y[:] = qp.z[:] = 0.0
        return self._claim


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


class Villain(Contender):
    """A contender whose backend does what its name says."""

    def made(self) -> Backend:
        """Its backend."""
        return Deed(self.name)


class Deed(Backend):
    """Solves nothing and does harm, unless it is good."""

    package = "ftqp"

    def __init__(self, deed: str) -> None:
        super().__init__(deed)

    def _prepare(self, qp: QPBuffers) -> None:
        pass

    def _run(self, qp: QPBuffers, cold: bool) -> Any:
        if self.name == "hangs":
            time.sleep(600.0)
        if self.name == "dies":
            os._exit(3)
        if self.name == "raises":
            raise RuntimeError("the solver broke")
        if self.name == "nonsense":
            return "solved"
        qp.x[:], qp.z_box[:] = SOLUTION, (2.0, -2.0)
        qp.y[:] = qp.z[:] = 0.0
        return Claim.SOLVED
