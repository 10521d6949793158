"""The discrete-time recurrent network (DTRNN) as a solver of its own: one QP with its trace, or thousands."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, IntArray, array, frozen, numbers
from ftqp.core.errors import InputError
from ftqp.kernel.entry.workspace import solve_networks
from ftqp.qp.adapters._dtrnn import Dtrnn, DtrnnSettings
from ftqp.qp.adapters.backend import Claim, QPBuffers
from ftqp.qp.adapters.backend import settings as settings_of
from ftqp.qp.problem import IN_ONE_PIECE, QP, SYMMETRY_TOLERANCE, Solution, refuse_halves
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
    trace: bool = False,
    start: Solution | tuple[Any, Any] | None = None,
    **settings: Any,
) -> DtrnnSolution:
    """Solve a QP with the network; if a solve from ``start`` fails, it is repeated from zero.

    Args:
        problem: The QP.
        method: The iteration: ``implicit``, ``94lvi`` or ``e47``, see ``DtrnnSettings``.
        trace: Whether to keep |e|, r_eq and the gap of every iterate, which costs time and memory.
        start: A former solution, or (x, y) with y of Ax = b; None starts from zero.
        **settings: As of ``DtrnnSettings``: ``mode``, ``scaling``, ``newton``, ``gamma``, ``tolerance``,
            ``max_iterations``.
    """
    if not isinstance(problem, QP):
        raise InputError(f"the problem is a {type(problem).__name__}, expected an ftqp.QP")
    chosen = settings_of(DtrnnSettings, "dtrnn", {"method": method, **settings})
    solver = Dtrnn("dtrnn", chosen)
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
        residual=solver.residual,
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BatchSolution:
    """Solutions of B QPs, by the convention of ``Solution``; NaN where a code is above 1.

    Attributes:
        x: The solutions, (B, n).
        y: Multipliers of Ax = b, (B, m).
        z: Multipliers of the two-sided rows, (B, p).
        z_box: Multipliers of the bounds of x, (B, n).
        codes: What the network claims of each by its own stopping rule, as numbers of ``Claim``, (B,);
            ``ftqp.qp.residuals`` checks a single answer.
        iterations: Iterations of each, (B,).
        residual: |e| of each at the end, in the network's own scaled units, (B,).
    """

    x: FloatArray
    y: FloatArray
    z: FloatArray
    z_box: FloatArray
    codes: IntArray
    iterations: IntArray
    residual: FloatArray

    def claim(self, k: int) -> Claim:
        """What the network claims of the k-th answer by its own stopping rule.

        Args:
            k: Position of the QP, 0 to B - 1.
        """
        return Claim(int(self.codes[k]))

    def __len__(self) -> int:
        return len(self.codes)


def solve_batch(
    H: Any,
    g: Any,
    A: Any = None,
    b: Any = None,
    C: Any = None,
    l: Any = None,
    u: Any = None,
    lb: Any = None,
    ub: Any = None,
    *,
    method: str = "implicit",
    **settings: Any,
) -> BatchSolution:
    """Solve B independent QPs of the same sizes, each from zero.

    A QP with crossed bounds is infeasible, one with NaN or an indefinite Hessian failed; the others are not
    touched. They are shared out among all cores (``NUMBA_NUM_THREADS`` limits them).

    Args:
        H: Hessians, (B, n, n), or (n, n) for all; the same holds for every other part.
        g: Linear terms, (B, n).
        A: Equality rows, (B, m, n), or None.
        b: Their right sides, (B, m), or None.
        C: Two-sided rows, (B, p, n), or None.
        l: Their lower bounds, (B, p), -inf is none, or None.
        u: Their upper bounds, (B, p), inf is none, or None.
        lb: Lower bounds of x, (B, n), -inf is none, or None.
        ub: Upper bounds of x, (B, n), inf is none, or None.
        method: The iteration: ``implicit``, ``94lvi`` or ``e47``, see ``DtrnnSettings``.
        **settings: As of ``DtrnnSettings``: ``mode``, ``scaling``, ``newton``, ``gamma``, ``tolerance``,
            ``max_iterations``.

    Returns:
        The answers with the network's own claims; one call checks none of them by residuals.

    Raises:
        InputError: Shapes that do not fit, a wrong setting, or H not symmetric.
    """
    chosen = settings_of(DtrnnSettings, "dtrnn", {"method": method, **settings})
    problems, (n, m, p), count = _parts(H, g, A, b, C, l, u, lb, ub)
    solutions = np.full((count, 2 * n + m + p), np.nan)
    codes, iterations, residual = solve_networks(problems, solutions, (n, m, p), chosen.numbers()).T
    x, z_box, y, z = np.split(solutions, (n, 2 * n, 2 * n + m), axis=1)
    return BatchSolution(
        x=x, y=y, z=z, z_box=z_box, codes=codes.astype(np.int64), iterations=iterations.astype(np.int64),
        residual=residual.copy(),
    )  # fmt: skip


def _parts(
    H: Any, g: Any, A: Any, b: Any, C: Any, l: Any, u: Any, lb: Any, ub: Any
) -> tuple[FloatArray, tuple[int, int, int], int]:
    """All of a QP in one piece, as in ``QPBuffers.flat``, (B or 1, k), the sizes, and B."""
    refuse_halves(A, b, C, l, u)
    H, g = numbers("H", H), numbers("g", g)
    n = g.shape[-1] if g.ndim else 0
    if n == 0:
        raise InputError(f"g has shape {g.shape}, expected (n,) or (B, n) with n >= 1")
    A = np.zeros((0, n)) if A is None else numbers("A", A)
    b = np.zeros(0) if b is None else numbers("b", b)
    C = np.zeros((0, n)) if C is None else numbers("C", C)
    m, p = (b.shape[-1] if b.ndim else 0), (C.shape[-2] if C.ndim >= 2 else 0)
    l = np.full(p, -np.inf) if l is None else numbers("l", l)
    u = np.full(p, np.inf) if u is None else numbers("u", u)
    lb = np.full(n, -np.inf) if lb is None else numbers("lb", lb)
    ub = np.full(n, np.inf) if ub is None else numbers("ub", ub)
    given = dict(H=H, g=g, A=A, b=b, C=C, l=l, u=u, lb=lb, ub=ub)
    shapes = dict(H=(n, n), g=(n,), A=(m, n), b=(m,), C=(p, n), l=(p,), u=(p,), lb=(n,), ub=(n,))
    counts = {name: len(value) for name, value in given.items() if value.ndim == len(shapes[name]) + 1}
    count = max(counts.values(), default=1)
    for name, value in given.items():
        if value.shape not in (shapes[name], (count, *shapes[name]), (1, *shapes[name])):
            raise InputError(
                f"{name} has shape {value.shape}, expected {shapes[name]} or, for each of the {count} "
                f"problems, {(count, *shapes[name])}"
            )
        given[name] = value if value.ndim > len(shapes[name]) else value[None]
    if empty := [name for name, value in given.items() if not len(value)]:
        raise InputError(f"{empty[0]} holds no problem, expected one at least")
    H = given["H"]
    with np.errstate(invalid="ignore"):
        off = np.abs(H - np.swapaxes(H, 1, 2)).max(initial=0.0)
        if off > SYMMETRY_TOLERANCE * np.nanmax(np.abs(H), initial=0.0):
            raise InputError(
                f"H is not symmetric (|H - H'| reaches {off:.1e}); expected H = H'; pass (H + H')/2 if meant"
            )
    alone = max(len(value) for value in given.values())
    flat = [
        np.broadcast_to(value.reshape(len(value), -1), (alone, value[0].size))
        for value in map(given.__getitem__, IN_ONE_PIECE)
    ]
    return np.concatenate(flat, axis=1), (n, m, p), count
