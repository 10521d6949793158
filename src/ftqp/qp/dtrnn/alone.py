"""The discrete-time recurrent network (DTRNN) as a solver of its own, with the trace of its convergence."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, array, frozen
from ftqp.core.errors import InputError
from ftqp.qp.adapters.backend import Claim
from ftqp.qp.adapters.buffers import QPBuffers
from ftqp.qp.adapters.settings import settings
from ftqp.qp.dtrnn.dtrnn_settings import METHODS, MODES, DtrnnSettings
from ftqp.qp.dtrnn.many import BatchSolution, solve_batch
from ftqp.qp.judge.solving import judged, loaded
from ftqp.qp.problem import QP, Solution, SolveStatus

__all__ = [
    "METHODS",
    "MODES",
    "BatchSolution",
    "DtrnnSettings",
    "DtrnnSolution",
    "Trace",
    "solve",
    "solve_batch",
]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trace:
    """How a solve converged, one entry an iterate, the start first.

    Attributes:
        residual: |e|, on the scale that the network worked on then, (k + 1,).
        r_eq: max |Ax - b| of the clipped iterate, rows of C included, (k + 1,).
        gap: bound of the distance from the optimum: f(x) - f* <= gap where r_eq = 0, (k + 1,).
        newton: whether the step from this iterate was a Newton jump, (k + 1,).
    """

    residual: FloatArray
    r_eq: FloatArray
    gap: FloatArray
    newton: BoolArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DtrnnSolution(Solution):
    """A solution with the trace of its convergence.

    In paper mode SOLVED means what it means in the paper: |e| <= tolerance. That bounds the task residual,
    not the error of x; ``residuals`` says what it is worth.

    Attributes:
        residual: |e| at the end.
        trace: how it converged, if asked for.
    """

    residual: float
    trace: Trace | None


def solve(
    problem: QP,
    method: str = "implicit",
    *,
    mode: str = "product",
    scaling: bool | None = None,
    newton: bool | None = None,
    gamma: float | None = None,
    tolerance: float | None = None,
    max_iterations: int | None = None,
    trace: bool = False,
    start: Solution | tuple[Any, Any] | None = None,
) -> DtrnnSolution:
    """Solve a QP with the network; ``DtrnnSettings`` says what the settings mean.

    Args:
        problem: the QP.
        method: ``implicit``, ``94lvi`` or ``e47``.
        mode: ``product`` or ``paper``.
        scaling: whether to scale.
        newton: whether to try Newton jumps.
        gamma: step size.
        tolerance: of |e|.
        max_iterations: most iterations.
        trace: whether to keep |e|, r_eq and the gap of every iterate.
        start: a former solution, or (x, y) with y of Ax = b; None starts from zero.

    Raises:
        InputError: not a QP, a wrong setting, or a start that does not fit.
    """
    # Here and not above: the backend loads numba.
    from ftqp.qp.adapters._dtrnn import Dtrnn

    if not isinstance(problem, QP):
        raise InputError(f"the problem is a {type(problem).__name__}, expected an ftqp.QP")
    given = dict(
        method=method,
        mode=mode,
        scaling=scaling,
        newton=newton,
        gamma=gamma,
        tolerance=tolerance,
        max_iterations=max_iterations,
    )
    chosen = settings(DtrnnSettings, "dtrnn", given)
    solver = Dtrnn(chosen)
    buffers = loaded(problem)
    solver.setup(buffers)
    if start is not None:
        _begin(solver, buffers, start)
    if trace:
        solver.trace = np.zeros((chosen.cap + 1, 4))
    claim = solver.solve(cold=start is None)
    common = judged(problem, solver, buffers, claim)
    status = SolveStatus.SOLVED if chosen.paper and claim is Claim.SOLVED else common.status
    return DtrnnSolution(
        x=common.x,
        y=common.y,
        z=common.z,
        z_box=common.z_box,
        status=status,
        iterations=common.iterations,
        residuals=common.residuals,
        backend=common.backend,
        certificate=common.certificate,
        residual=float(solver.numbers[-1]),
        trace=_trace(solver.trace[: solver.iterations + 1]) if trace else None,
    )


def _begin(solver: Any, buffers: QPBuffers, start: Solution | tuple[Any, Any]) -> None:
    """Write a start into the buffers."""
    if isinstance(start, Solution):
        parts = {"x": start.x, "y": start.y, "z": start.z}
    elif isinstance(start, tuple) and len(start) == 2:
        parts = {"x": start[0], "y": start[1]}
    else:
        raise InputError(f"start is a {type(start).__name__}, expected a Solution or a tuple (x, y)")
    buffers.solution[:] = 0.0
    for name, value in parts.items():
        into = getattr(buffers, name)
        into[:] = array(f"start {name}", value, into.shape)
    solver.start()


def _trace(rows: FloatArray) -> Trace:
    residual, r_eq, gap = (frozen(column.copy()) for column in rows.T[:3])
    newton: BoolArray = rows[:, 3] > 0.0
    return Trace(residual=residual, r_eq=r_eq, gap=gap, newton=frozen(newton))
