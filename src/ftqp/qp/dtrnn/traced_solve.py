"""The discrete-time recurrent network (DTRNN) as a solver of its own, with the trace of its convergence."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, array, frozen
from ftqp.core.errors import InputError
from ftqp.qp.adapters._dtrnn import Dtrnn
from ftqp.qp.adapters.backend import Claim, QPBuffers, settings
from ftqp.qp.dtrnn.dtrnn_settings import DtrnnSettings
from ftqp.qp.problem import QP, Solution
from ftqp.qp.solving import checked, loaded


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trace:
    """How a solve converged, one entry an iterate, the start first.

    Attributes:
        residual: |e|, on the scale that the network worked on then, (k + 1,).
        r_eq: The largest |Ax - b| of the clipped iterate, rows of C included, (k + 1,).
        gap: A bound of the distance from the optimum: f(x) - f* <= gap where r_eq = 0, (k + 1,).
        newton: Whether the step from this iterate was a Newton jump, (k + 1,).
    """

    residual: FloatArray
    r_eq: FloatArray
    gap: FloatArray
    newton: BoolArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DtrnnSolution(Solution):
    """A solution of the network, with the trace of its convergence.

    ``status`` follows from the KKT residuals, as with every backend. The network's own stopping rule is in
    ``claim``: in paper mode |e| <= tolerance, which bounds the task residual and not the error of x, so that
    a claim of SOLVED may go with a status of FAILED.

    Attributes:
        claim: What the network says of its answer by its own stopping rule.
        residual: |e| at the end, in the network's own scaled units.
        trace: How the solve converged, or None if it was not asked for.
    """

    claim: Claim
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
    """Solve a QP with the network.

    Args:
        problem: The QP.
        method: The iteration: ``implicit``, ``94lvi`` or ``e47``, see ``DtrnnSettings``.
        mode: When to stop: ``product`` proves the answer, ``paper`` stops at a small |e|.
        scaling: Whether to scale objective and rows; None is what suits method and mode.
        newton: Whether to try Newton jumps; None is yes in product mode.
        gamma: Step size in (0, 2), without unit; None is what suits the method.
        tolerance: Largest |e| that ends the solve, > 0; None is 1e-9, in paper mode 1e-5.
        max_iterations: Most iterations, >= 1; None is 2000, in paper mode 20000. If a solve from ``start``
            fails, it is repeated from zero with the iterations that are left.
        trace: Whether to keep |e|, r_eq and the gap of every iterate, which costs time and memory.
        start: A former solution, or (x, y) with y of Ax = b; None starts from zero.
    """
    if not isinstance(problem, QP):
        raise InputError(f"the problem is a {type(problem).__name__}, expected an ftqp.QP")
    given = dict(
        method=method, mode=mode, scaling=scaling, newton=newton, gamma=gamma, tolerance=tolerance,
        max_iterations=max_iterations,
    )  # fmt: skip
    chosen = settings(DtrnnSettings, "dtrnn", given)
    solver = Dtrnn(chosen)
    buffers = loaded(problem)
    solver.setup(buffers)
    if start is not None:
        _begin(solver, buffers, start)
    if trace:
        solver.trace = np.zeros((chosen.cap + 1, 4))
    claim = solver.solve(cold=start is None)
    common = checked(problem, solver, buffers, claim)
    return DtrnnSolution(
        **{field.name: getattr(common, field.name) for field in fields(common)},
        claim=claim,
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
