"""DAQP: a dual active-set solver (Arnstrom et al. 2022)."""

from dataclasses import dataclass

import daqp
import numpy as np

from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers

EQUALITY = 5
"""DAQP's sense flag of a row that is always active and never leaves the working set."""

CLAIMS = {1: Claim.SOLVED, -1: Claim.INFEASIBLE, -4: Claim.MAX_ITERATIONS}
"""DAQP's exit flags; all others (cycling, unbounded, not convex, dependent equalities, ...) are failures."""

OUT_OF_TIME = -7
"""DAQP's exit flag of a solve that ran out of its time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DaqpSettings:
    """Settings of DAQP.

    Attributes:
        tolerance: How far a bound may be violated, > 0 (DAQP's ``primal_tol``, whose own default of 1e-6 is
            too coarse here). A larger one is faster and coarser; below 1e-8 DAQP calls QPs infeasible that
            are solvable by a hair.
        max_iterations: The most iterations, >= 1. A smaller cap bounds the time of a solve and gives up more
            often. One is a change of the working set.
        dual_tolerance: How far a multiplier may have the wrong sign, > 0 (``dual_tol``). A larger one stops
            earlier, farther from the optimum.
        pivot_tolerance: The smallest pivot that is taken without reordering, > 0 (``pivot_tol``). A larger
            one is safer with nearly dependent rows and slower.
        progress_tolerance: The least progress that does not count as cycling, > 0 (``progress_tol``). A
            larger one gives up sooner.
        time_limit: How long a solve may take, > 0 [s] (``time_limit``); None is without limit. A solve that
            runs out of it is no answer. With a limit the same input may give another answer on another day.
    """

    tolerance: float = 1e-11
    max_iterations: int = 1000
    dual_tolerance: float = 1e-12
    pivot_tolerance: float = 1e-8
    progress_tolerance: float = 1e-14
    time_limit: float | None = None


class Daqp(Backend):
    """DAQP's ``Model``, set up once: box, equalities (sense 5), two-sided rows; it notices equal bounds."""

    package = "daqp"
    settings_type = DaqpSettings

    def _prepare(self, qp: QPBuffers) -> None:
        n, m, p = qp.n, qp.m, qp.p
        self._sense = np.zeros(n + m + p, dtype=np.intc)
        self._sense[n : n + m] = EQUALITY
        # None stands for "unchanged", and DAQP cannot look at a matrix without rows.
        self._rows = qp.rows if m + p else None
        self._model = daqp.Model()
        # The buffers may be empty yet; a harmless QP of the same size makes DAQP allocate.
        rows = np.eye(n)[np.arange(m + p) % n]
        self._model.setup(
            np.eye(n), np.zeros(n), rows, np.ones(n + m + p), -np.ones(n + m + p), 0 * self._sense
        )
        chosen = self.settings
        self._model.settings = {
            "primal_tol": chosen.tolerance,
            "dual_tol": chosen.dual_tolerance,
            "iter_limit": chosen.max_iterations,
            "pivot_tol": chosen.pivot_tolerance,
            "progress_tol": chosen.progress_tolerance,
            "time_limit": chosen.time_limit or 0.0,
        }

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        if cold:
            state = self._model.update(qp.H, qp.g, self._rows, qp.upper, qp.lower, self._sense)
        elif qp.constant_hessian:
            state = self._model.update(None, qp.g, self._rows, qp.upper, qp.lower)
        else:
            state = self._model.update(qp.H, qp.g, self._rows, qp.upper, qp.lower)
        if state < 0:
            return Claim.INFEASIBLE if state == -1 else Claim.FAILED
        x, _, flag, info = self._model.solve()
        self.iterations = info["iterations"]
        self.overran = flag == OUT_OF_TIME
        claim = CLAIMS.get(flag, Claim.FAILED)
        if claim <= Claim.MAX_ITERATIONS:
            qp.x[:] = x
            qp.multipliers[:] = info["lam"]
        return claim
