"""Thousands of QPs of the same sizes at once, on all cores."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.core.one_engine import check_engine
from ftqp.kernel.entry.workspace import solve_many
from ftqp.qp.adapters.backend import Claim, settings
from ftqp.qp.dtrnn.dtrnn_settings import DtrnnSettings
from ftqp.qp.problem import SYMMETRY_TOLERANCE, refuse_halves


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
    engine: str | None = None,
    mode: str = "product",
    scaling: bool | None = None,
    newton: bool | None = None,
    gamma: float | None = None,
    tolerance: float | None = None,
    max_iterations: int | None = None,
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
        engine: Deprecated and without effect, as there is one engine, the compiled one; leave it out.
        mode: When to stop: ``product`` proves the answer, ``paper`` stops at a small |e|.
        scaling: Whether to scale objective and rows; None is what suits method and mode.
        newton: Whether to try Newton jumps; None is yes in product mode.
        gamma: Step size in (0, 2), without unit; None is what suits the method.
        tolerance: Largest |e| that ends a solve, > 0; None is 1e-9, in paper mode 1e-5.
        max_iterations: Most iterations of each, >= 1; None is 2000, in paper mode 20000.

    Returns:
        The answers with the network's own claims; one call checks none of them by residuals.

    Raises:
        InputError: Shapes that do not fit, a wrong setting, another engine, or H not symmetric.
    """
    check_engine(engine)
    given = dict(
        method=method, mode=mode, scaling=scaling, newton=newton, gamma=gamma, tolerance=tolerance,
        max_iterations=max_iterations,
    )  # fmt: skip
    chosen = settings(DtrnnSettings, "dtrnn", given)
    parts = _parts(H, g, A, b, C, l, u, lb, ub)
    count = max(len(value) for value in parts.values())
    x, y, z, z_box, codes, iterations, residual = solve_many(tuple(parts.values()), chosen.numbers(), count)
    return BatchSolution(x=x, y=y, z=z, z_box=z_box, codes=codes, iterations=iterations, residual=residual)


def _parts(H: Any, g: Any, A: Any, b: Any, C: Any, l: Any, u: Any, lb: Any, ub: Any) -> dict[str, FloatArray]:
    """Every part with a leading axis of B or 1, contiguous."""
    refuse_halves(A, b, C, l, u)
    H, g = _numbers("H", H), _numbers("g", g)
    n = g.shape[-1] if g.ndim else 0
    if n == 0:
        raise InputError(f"g has shape {g.shape}, expected (n,) or (B, n) with n >= 1")
    A = np.zeros((0, n)) if A is None else _numbers("A", A)
    b = np.zeros(0) if b is None else _numbers("b", b)
    C = np.zeros((0, n)) if C is None else _numbers("C", C)
    m, p = (b.shape[-1] if b.ndim else 0), (C.shape[-2] if C.ndim >= 2 else 0)
    l = np.full(p, -np.inf) if l is None else _numbers("l", l)
    u = np.full(p, np.inf) if u is None else _numbers("u", u)
    lb = np.full(n, -np.inf) if lb is None else _numbers("lb", lb)
    ub = np.full(n, np.inf) if ub is None else _numbers("ub", ub)
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
        if value.ndim == len(shapes[name]):
            given[name] = np.ascontiguousarray(value[None])
    H = given["H"]
    with np.errstate(invalid="ignore"):
        off = np.abs(H - np.swapaxes(H, 1, 2)).max(initial=0.0)
        if off > SYMMETRY_TOLERANCE * np.nanmax(np.abs(H), initial=0.0):
            raise InputError(
                f"H is not symmetric (|H - H'| reaches {off:.1e}); expected H = H'; pass (H + H')/2 if meant"
            )
    return given


def _numbers(name: str, value: Any) -> FloatArray:
    try:
        return np.ascontiguousarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} is not an array of numbers: {value!r:.80}") from error
