"""Any solver of the package qpsolvers, as ``qpsolvers:<name>``: wide choice, no warm start, more overhead."""

import warnings
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import qpsolvers
from scipy.sparse import csc_matrix

from ftqp.core.checks import positive, whole_number
from ftqp.core.errors import InputError, MissingPackage, unknown
from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers

OTHER_SOLVERS = (
    "copt", "cvxopt", "ecos", "gurobi", "highs", "hpipm", "jaxopt_osqp", "kvxopt", "mosek", "nppro", "pdhcg",
    "pyqpmad", "qpalm", "qpax", "qpoases", "qpswift", "qtqp", "quadprog", "sip",
)  # fmt: skip
"""Names that qpsolvers knows beside those of ``_DIALECTS``."""


class _Dialect(NamedTuple):
    """What a solver calls ``tolerance`` and ``max_iterations``, and the values it gets without being told."""

    tolerance: tuple[str, ...]
    max_iterations: str
    defaults: dict[str, float]


_ABSOLUTE = {"eps_abs": 1e-9, "eps_rel": 0.0}
# Their own defaults are too coarse for a control loop, or leave them uncapped.
_DIALECTS = {
    "clarabel": _Dialect(
        ("tol_feas", "tol_gap_abs", "tol_gap_rel"), "max_iter",
        {"tol_feas": 1e-9, "tol_gap_abs": 1e-9, "tol_gap_rel": 1e-9, "max_iter": 100},
    ),
    "daqp": _Dialect(("primal_tol",), "iter_limit", {"primal_tol": 1e-11, "iter_limit": 1000}),
    "osqp": _Dialect(("eps_abs",), "max_iter", {**_ABSOLUTE, "max_iter": 10_000}),
    "piqp": _Dialect(
        ("eps_abs", "eps_duality_gap_abs"), "max_iter",
        {**_ABSOLUTE, "eps_duality_gap_abs": 1e-9, "max_iter": 100},
    ),
    "proxqp": _Dialect(("eps_abs",), "max_iter", {**_ABSOLUTE, "max_iter": 100}),
    "scs": _Dialect(("eps_abs",), "max_iters", {**_ABSOLUTE, "max_iters": 100_000}),
}  # fmt: skip


def solver_names() -> tuple[str, ...]:
    """The solvers that qpsolvers finds installed."""
    return tuple(sorted(qpsolvers.available_solvers))


class Qpsolvers(Backend):
    """One of qpsolvers' solvers, called anew at every solve.

    ``tolerance`` and ``max_iterations`` are translated for clarabel, daqp, osqp, piqp, proxqp and scs, which
    get tight values without being told; other settings go to the solver by the solver's own names. Two-sided
    rows become one-sided ones, infinite sides vanish, equal sides become equalities. qpsolvers says only if
    there is a solution: FAILED stands for infeasible and out of iterations too; ``iterations`` is 0.
    """

    package = "qpsolvers"

    def __init__(self, solver: str, given: Mapping[str, Any]) -> None:
        super().__init__(f"qpsolvers:{solver}")
        if solver not in qpsolvers.available_solvers:
            known = {*_DIALECTS, *OTHER_SOLVERS}
            if solver in known:
                raise MissingPackage(f"backend {self.name!r}", solver, f'pip install "qpsolvers[{solver}]"')
            raise unknown("solver", solver, "qpsolvers", sorted({*known, *qpsolvers.available_solvers}))
        self._solver = solver
        self._native = _translated(self.name, solver, given)
        self._sparse = solver in qpsolvers.sparse_solvers and solver not in qpsolvers.dense_solvers

    def _prepare(self, qp: QPBuffers) -> None:
        """Nothing to keep: qpsolvers sets its solvers up at every call."""

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        equal = qp.l == qp.u
        fixed = np.flatnonzero(equal)
        below = np.flatnonzero(~equal & (qp.l > -np.inf))
        above = np.flatnonzero(~equal & (qp.u < np.inf))
        G, h = np.vstack([-qp.C[below], qp.C[above]]), np.concatenate([-qp.l[below], qp.u[above]])
        A, b = np.vstack([qp.A, qp.C[fixed]]), np.concatenate([qp.b, qp.l[fixed]])
        matrix = csc_matrix if self._sparse else np.array
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                rows: dict[str, Any] = {"lb": qp.lb.copy(), "ub": qp.ub.copy()}
                rows |= {"G": matrix(G), "h": h} if len(h) else {}
                rows |= {"A": matrix(A), "b": b} if len(b) else {}
                problem = qpsolvers.Problem(matrix(qp.H), qp.g.copy(), **rows)
                solution = qpsolvers.solve_problem(problem, self._solver, None, False, **self._native)
        except (TypeError, AttributeError, qpsolvers.ParamError) as error:
            raise InputError(f"{self.name} refused the settings {self._native}: {error}") from error
        except (qpsolvers.QPError, ValueError, ArithmeticError, AssertionError):
            return Claim.FAILED
        if solution.x is None or not solution.found:
            return Claim.FAILED
        qp.x[:] = solution.x
        qp.multipliers[:] = 0.0
        if solution.z_box is not None and len(solution.z_box) == qp.n:
            qp.z_box[:] = solution.z_box
        if solution.y is not None and len(solution.y) == len(b):
            qp.y[:] = solution.y[: qp.m]
            qp.z[fixed] = solution.y[qp.m :]
        if solution.z is not None and len(solution.z) == len(h):
            qp.z[below] -= solution.z[: len(below)]
            qp.z[above] += solution.z[len(below) :]
        return Claim.SOLVED


def _translated(name: str, solver: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Settings under the solver's own names, over the defaults that it gets here."""
    dialect = _DIALECTS.get(solver)
    if dialect is None:
        for common in ("tolerance", "max_iterations"):
            if common in given:
                raise InputError(f"{name} has no setting {common!r} here; use the solver's own name for it")
        return dict(given)
    native = {**dialect.defaults, **given}
    if "tolerance" in native:
        tolerance = positive(f"{name}.tolerance", native.pop("tolerance"))
        native.update(dict.fromkeys(dialect.tolerance, tolerance))
    if "max_iterations" in native:
        cap = native.pop("max_iterations")
        whole_number(f"{name}.max_iterations", cap, 1)
        native[dialect.max_iterations] = cap
    return native
