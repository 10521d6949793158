"""Every QP of the square path, recorded while the active set drives, and the network's iterations on them."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from tests.papers.jin2017 import DT, run

import ftqp
from ftqp.core.checks import FloatArray, IntArray
from ftqp.kernel.entry.workspace import solve_networks
from ftqp.qp import Claim, Recorder, Recording
from ftqp.qp.dtrnn import DtrnnSettings
from ftqp.qp.solving import loaded

LOCK = ((15.0, ftqp.Locked(0, mode="instant", reset="kinematic")),)
EXPERIMENTS: dict[str, dict[str, Any]] = {
    "RMP": dict(scheme="rmp", faults=LOCK),
    "DLSM": dict(scheme="dlsm", faults=LOCK),
    "IIWT": dict(scheme="iiwt"),
    "MTN": dict(scheme="mtn", faults=LOCK),
    "gravity": dict(scheme="dlsm", bounds="viability", vertical=True),
}
"""The rows of the table of iterations in docs/evidence/jin2017.md."""


@cache
def recording(name: str) -> Recording:
    """The 2001 QPs of one row of the table, with their solutions."""
    recorder = Recorder("active_set")
    run(**EXPERIMENTS[name], backend=recorder)
    return recorder.recording(dt=DT)


@dataclass(frozen=True, slots=True, kw_only=True)
class Solved:
    """What the network needed, one entry a QP.

    Attributes:
        iterations: Iterations of each; the cap where it did not converge.
        claims: How each ended.
        error: Largest |x - x*| of each.
    """

    iterations: IntArray
    claims: list[Claim]
    error: FloatArray

    @property
    def not_converged(self) -> int:
        """How many ran into the cap."""
        return self.claims.count(Claim.MAX_ITERATIONS)


def solved(name: str, chosen: DtrnnSettings, *, warm: bool, every: int) -> Solved:
    """Solve every ``every``-th QP of a row; warm from the last answer while the same joints are locked."""
    qps = recording(name)
    n, m, p = qps.g.shape[1], qps.b.shape[1], qps.l.shape[1]
    numbers, solution = chosen.numbers(), np.zeros((1, 2 * n + m + p))
    iterations, claims, error, locked = [], [], [], None
    for k in range(0, len(qps), every):
        fixed = tuple(qps.lb[k] == qps.ub[k])
        again = warm and fixed == locked
        flat = loaded(qps.problem(k)).flat[None]
        ((claim, spent, _),) = solve_networks(flat, solution, (n, m, p), numbers, warm=again)
        locked = fixed
        iterations.append(int(spent))
        claims.append(Claim(int(claim)))
        error.append(float(np.abs(solution[0, :n] - qps.x[k]).max()))
    return Solved(iterations=np.array(iterations), claims=claims, error=np.array(error))
