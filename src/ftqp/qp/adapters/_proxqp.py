"""ProxQP: a primal-dual augmented Lagrangian solver (Bambade et al. 2022), from proxsuite."""

from dataclasses import dataclass

import numpy as np
from proxsuite import proxqp

from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers

WARM = proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
COLD = proxqp.InitialGuess.NO_INITIAL_GUESS
CLAIMS = {
    proxqp.QPSolverOutput.PROXQP_SOLVED: Claim.SOLVED,
    proxqp.QPSolverOutput.PROXQP_MAX_ITER_REACHED: Claim.MAX_ITERATIONS,
    proxqp.QPSolverOutput.PROXQP_PRIMAL_INFEASIBLE: Claim.INFEASIBLE,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ProxqpSettings:
    """Settings of ProxQP.

    Attributes:
        tolerance: Absolute tolerance of primal and dual residual and of the duality gap, > 0 (``eps_abs``,
            ``eps_duality_gap_abs``; the relative ones are 0). A larger one is faster and coarser. The gap is
            always checked: without it a warm start may stop at the old answer.
        max_iterations: The most outer iterations of a solve, and of the cold one that follows a warm one in
            vain, >= 1 (``max_iter``; ProxQP's own 10,000 run for minutes on an infeasible QP). A smaller cap
            bounds the time and gives up more often.
        max_inner_iterations: The most inner iterations in one outer one, >= 1 (``max_iter_in``).
        infeasibility_tolerance: The tolerance of ProxQP's certificate of infeasibility, > 0
            (``eps_primal_inf``). A larger one says "infeasible" sooner; its own 1e-4 too often.
    """

    tolerance: float = 1e-9
    max_iterations: int = 200
    max_inner_iterations: int = 50
    infeasibility_tolerance: float = 1e-7


class Proxqp(Backend):
    """ProxQP's dense solver with the box apart, initialised once, then updated."""

    package = "proxsuite"
    settings_type = ProxqpSettings

    def _prepare(self, qp: QPBuffers) -> None:
        n, m, p = qp.n, qp.m, qp.p
        solver = proxqp.dense.QP(n, m, p, True)
        chosen = self.settings
        solver.settings.eps_abs = solver.settings.eps_duality_gap_abs = chosen.tolerance
        solver.settings.eps_rel = solver.settings.eps_duality_gap_rel = 0.0
        solver.settings.check_duality_gap = True
        solver.settings.max_iter = chosen.max_iterations
        solver.settings.max_iter_in = chosen.max_inner_iterations
        solver.settings.eps_primal_inf = chosen.infeasibility_tolerance
        solver.settings.compute_timings = False
        # The buffers may be empty yet; a harmless QP of the same size makes ProxQP allocate.
        rows, one = np.eye(n)[np.arange(m + p) % n], np.ones(n + p)
        solver.init(
            np.eye(n), np.zeros(n), rows[:m], np.zeros(m), rows[m:], -one[:p], one[:p], -one[:n], one[:n]
        )
        solver.settings.initial_guess, self._cold = COLD, True
        self._solver, self._native = solver, solver.settings
        results = solver.results
        # Views of ProxQP's own memory, which has the box last.
        self._x, self._y, self._info = results.x, results.y, results.info
        self._z, self._z_box = results.z[:p], results.z[p:]

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        solver, info = self._solver, self._info
        if cold is not self._cold:
            self._native.initial_guess = COLD if cold else WARM
            self._cold = cold
        H = None if qp.constant_hessian and not cold else qp.H
        solver.update(H, qp.g, qp.A, qp.b, qp.C, qp.l, qp.u, qp.lb, qp.ub, cold)
        solver.solve()
        self.iterations = info.iter
        claim = CLAIMS.get(info.status, Claim.FAILED)
        if claim <= Claim.MAX_ITERATIONS:
            qp.x[:] = self._x
            qp.y[:] = self._y
            qp.z[:] = self._z
            qp.z_box[:] = self._z_box
        return claim
