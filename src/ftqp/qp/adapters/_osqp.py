"""OSQP: an operator-splitting (ADMM) solver (Stellato et al. 2020)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import osqp
from scipy.sparse import csc_matrix

from ftqp.core.checks import FloatArray
from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers

NO_BOUND = 1e30
"""OSQP's infinity; a bound that is really infinite spoils its duality gap."""

CLAIMS = {
    1: Claim.SOLVED, 2: Claim.MAX_ITERATIONS, 3: Claim.INFEASIBLE, 4: Claim.INFEASIBLE,
    7: Claim.MAX_ITERATIONS,
}  # fmt: skip
"""OSQP's status values: solved (inaccurately), infeasible (inaccurately), iterations; others are failures."""

OUT_OF_TIME = 8
"""OSQP's status value of a solve that ran out of its time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OsqpSettings:
    """Settings of OSQP.

    Attributes:
        tolerance: Absolute tolerance of the residuals, > 0 (``eps_abs``; ``eps_rel`` is 0). A larger one is
            faster and coarser.
        max_iterations: The most iterations of a solve, and of the cold one that follows a warm one in vain,
            >= 1. A smaller cap bounds the time of a solve and gives up more often. (``max_iter``)
        rho: The ADMM step at a cold start, > 0 (``rho``). A larger one weighs constraints more.
        sigma: The ADMM regularisation, > 0 (``sigma``). A larger one is better conditioned and slower.
        alpha: The over-relaxation, in (0, 2) (``alpha``). 1 is none; towards 2 steps are longer.
        check_every: Iterations between checks of termination, >= 1 (``check_termination``). A larger number
            checks less and may overshoot the end.
        infeasibility_tolerance: The tolerance of OSQP's certificate of infeasibility, > 0 (``eps_prim_inf``).
            A larger one says "infeasible" sooner, and wrongly at last.
        time_limit: How long a solve may take, > 0 [s] (``time_limit``); None is without limit. A solve that
            runs out of it is no answer. With a limit the same input may give another answer on another day.
    """

    tolerance: float = 1e-9
    max_iterations: int = 2_000
    rho: float = 0.1
    sigma: float = 1e-6
    alpha: float = 1.6
    check_every: int = 25
    infeasibility_tolerance: float = 1e-6
    time_limit: float | None = None


class Osqp(Backend):
    """OSQP on a full pattern set up once, [I; A; C] and the upper H, without its own polishing."""

    package = "osqp"
    settings_type = OsqpSettings

    def _prepare(self, qp: QPBuffers) -> None:
        n, k = qp.n, len(qp.rows)
        # Column j of [I; A; C] has its one in row j and is full below the box; sorted, so values need no
        # permutation.
        pattern = np.empty((n, k + 1), dtype=np.int32)
        pattern[:, 0] = np.arange(n)
        pattern[:, 1:] = n + np.arange(k)
        values = np.ones((n, k + 1))
        constraints = csc_matrix(
            (values.ravel(), pattern.ravel(), np.arange(n + 1) * (k + 1)), shape=(n + k, n)
        )
        columns, rows = np.tril_indices(n)
        starts = np.concatenate(([0], np.cumsum(np.arange(1, n + 1))))
        triangle = csc_matrix(((rows == columns).astype(float), rows, starts), shape=(n, n))
        chosen = self.settings
        limit = {} if chosen.time_limit is None else {"time_limit": chosen.time_limit}
        model = osqp.OSQP(algebra="builtin")
        model.setup(
            triangle, np.zeros(n), constraints, -np.ones(n + k), np.ones(n + k), verbose=False,
            eps_abs=chosen.tolerance, eps_rel=0.0, max_iter=chosen.max_iterations, polishing=False,
            rho=chosen.rho, sigma=chosen.sigma, alpha=chosen.alpha, check_termination=chosen.check_every,
            eps_prim_inf=chosen.infeasibility_tolerance, **limit,
        )  # fmt: skip
        # The compiled solver inside: OSQP's Python wrapper around it costs 10 us a tick.
        self._solver: Any = model._solver
        self._values, self._rows = values.reshape(-1), values[:, 1:].T
        self._triangle = rows * n + columns
        self._H_values: FloatArray = np.empty(len(rows))
        self._lower, self._upper = np.empty(n + k), np.empty(n + k)
        # As arrays, because numpy takes longer over a scalar than over the comparison.
        self._least, self._greatest = np.full(n + k, -NO_BOUND), np.full(n + k, NO_BOUND)
        self._zero_x, self._zero_y = np.zeros(n), np.zeros(n + k)

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        solver = self._solver
        np.maximum(qp.lower, self._least, out=self._lower)
        np.minimum(qp.upper, self._greatest, out=self._upper)
        self._rows[...] = qp.rows
        H_values = None
        if cold or not qp.constant_hessian:
            H_values = qp.flat.take(self._triangle, None, self._H_values, "clip")
        if solver.update_data_vec(qp.g, self._lower, self._upper) or solver.update_data_mat(
            H_values, None, self._values, None
        ):
            return Claim.FAILED
        if cold:
            solver.update_rho(self.settings.rho)
            solver.warm_start(self._zero_x, self._zero_y)
        solver.solve()
        info = solver.info
        self.iterations = info.iter
        self.overran = info.status_val == OUT_OF_TIME
        claim = CLAIMS.get(info.status_val, Claim.FAILED)
        if claim <= Claim.MAX_ITERATIONS:
            solution = solver.solution
            qp.x[:] = solution.x
            qp.multipliers[:] = solution.y
        return claim
