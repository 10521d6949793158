"""A convex QP as a value: checked once, read-only ever after; and what solving one returns."""

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, array, frozen
from ftqp.core.errors import InputError

PARTS = ("H", "g", "A", "b", "C", "l", "u", "lb", "ub")
"""What a QP is made of."""
IN_ONE_PIECE = ("H", "g", "A", "C", "lb", "b", "l", "ub", "b", "u")
"""The parts in the order of ``QPBuffers.flat``."""
ANSWER = ("x", "y", "z", "z_box")
"""What solving one gives."""
SYMMETRY_TOLERANCE = 1e-9
"""Largest |H - H'| / max |H| that counts as rounding."""
CONVEXITY_TOLERANCE = 1e-10
"""Largest -lambda_min(H) / lambda_max(H) that counts as rounding."""


class Sized:
    """What has the parts of a QP, and so its sizes."""

    __slots__ = ()
    g: FloatArray
    b: FloatArray
    l: FloatArray

    @property
    def n(self) -> int:
        """Number of variables."""
        return len(self.g)

    @property
    def m(self) -> int:
        """Number of equality rows."""
        return len(self.b)

    @property
    def p(self) -> int:
        """Number of two-sided rows."""
        return len(self.l)


@dataclass(frozen=True, slots=True, init=False, eq=False)
class QP(Sized):
    """min 1/2 x'Hx + g'x subject to Ax = b, l <= Cx <= u, lb <= x <= ub.

    Absent parts are empty rows or infinite bounds. ``l == u`` is an equality, ``lb == ub`` fixes a variable.

    Attributes:
        H: The Hessian, (n, n), symmetric and positive semidefinite.
        g: The linear term, (n,).
        A: Equality rows, (m, n).
        b: Their right side, (m,).
        C: Two-sided rows, (p, n).
        l: Their lower bounds, (p,), -inf is none.
        u: Their upper bounds, (p,), inf is none.
        lb: Lower bounds of x, (n,), -inf is none.
        ub: Upper bounds of x, (n,), inf is none.
    """

    H: FloatArray
    g: FloatArray
    A: FloatArray
    b: FloatArray
    C: FloatArray
    l: FloatArray
    u: FloatArray
    lb: FloatArray
    ub: FloatArray

    def __init__(
        self,
        H: Any,
        g: Any,
        A: Any = None,
        b: Any = None,
        C: Any = None,
        l: Any = None,
        u: Any = None,
        lb: Any = None,
        ub: Any = None,
    ) -> None:
        """Check and copy the parts.

        Raises:
            InputError: Shapes that do not fit, NaN, an infinite number where a finite one belongs, crossed
                bounds, a right side without rows or rows without one, H not symmetric or not positive
                semidefinite.
        """
        n = _length("g", g)
        if n == 0:
            raise InputError("g is empty, expected at least one variable")
        parts = {"H": _convex(array("H", H, (n, n), "(n, n)")), "g": array("g", g, (n,), "(n,)")}
        refuse_halves(A, b, C, l, u)
        m = 0 if b is None else _length("b", b)
        parts["A"] = _rows("A", A, m, n, "(m, n)")
        parts["b"] = array("b", () if b is None else b, (m,), "(m,)")
        p = 0 if C is None else _length("u" if l is None else "l", u if l is None else l)
        parts["C"] = _rows("C", C, p, n, "(p, n)")
        parts["l"], parts["u"] = _bounds("l", l, "u", u, p, "(p,)")
        parts["lb"], parts["ub"] = _bounds("lb", lb, "ub", ub, n, "(n,)")
        for name, value in parts.items():
            object.__setattr__(self, name, frozen(value))

    def objective(self, x: FloatArray) -> float:
        """The objective 1/2 x'Hx + g'x.

        Args:
            x: A point, (n,).
        """
        return float(0.5 * x @ self.H @ x + self.g @ x)


class SolveStatus(Enum):
    """How solving a QP ended; the value is a sentence for the operator."""

    SOLVED = "the QP is solved: its optimality conditions hold"
    MAX_ITERATIONS = "the solver stopped at its iteration limit before the QP was solved"
    INFEASIBLE = "the QP has no solution: its constraints contradict each other"
    FAILED = "the solver failed: it gave no answer, or one that the optimality conditions refute"
    OUT_OF_TIME = "the solver ran out of its time limit before the QP was solved"


@dataclass(frozen=True, slots=True, kw_only=True)
class Residuals:
    """How far a point is from solving a QP, in the QP's units; inf with NaN.

    ``ftqp.qp.solving.residuals`` has the formulas.

    Attributes:
        primal: The largest of |Ax - b| and the violations of l <= Cx <= u and lb <= x <= ub.
        dual: The largest entry of |Hx + g + A'y + C'z + z_box|.
        complementarity: The largest, over bounds, of the smaller of multiplier and distance from the bound.
        gap: The duality gap |x'Hx + g'x + b'y + sum(z+ u - z- l) + sum(z_box+ ub - z_box- lb)|.
    """

    primal: float
    dual: float
    complementarity: float
    gap: float

    @property
    def largest(self) -> float:
        """The largest of the four."""
        return max(self.primal, self.dual, self.complementarity, self.gap)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Certificate:
    """A proof that a QP has no feasible point (Farkas).

    A'y + C'z + z_box = 0 while every x within the bounds would need

    0 = y'Ax + z'Cx + z_box'x <= b'y + sum(z+ u - z- l) + sum(z_box+ ub - z_box- lb) < 0.

    Attributes:
        y: Multipliers of Ax = b, (m,): the violation of each row at the point closest to all constraints.
        z: Multipliers of the two-sided rows, (p,): likewise.
        z_box: Multipliers of the bounds of x, (n,): not zero where a bound stands in the way.
        violation: The largest entry of y and z: what at least one constraint must give, in its own unit.
    """

    y: FloatArray
    z: FloatArray
    z_box: FloatArray
    violation: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solution:
    """What ``ftqp.qp.solve`` returns; L = 1/2 x'Hx + g'x + y'(Ax - b) + z'Cx + z_box'x.

    Attributes:
        x: The solution, (n,); NaN when there is none, the last iterate at MAX_ITERATIONS.
        y: Multipliers of Ax = b, (m,).
        z: Multipliers of the two-sided rows, (p,), > 0 at an upper bound, < 0 at a lower one.
        z_box: Multipliers of the bounds of x, (n,), with the same signs.
        status: How it ended, by the residuals and not by the word of the solver.
        iterations: Iterations in the solver's own counting.
        residuals: How well the answer solves the QP.
        backend: The solver's name.
        certificate: The proof of infeasibility, for INFEASIBLE.
    """

    x: FloatArray
    y: FloatArray
    z: FloatArray
    z_box: FloatArray
    status: SolveStatus
    iterations: int
    residuals: Residuals
    backend: str
    certificate: Certificate | None = None


def refuse_halves(A: Any, b: Any, C: Any, l: Any, u: Any) -> None:
    """Refuse rows without a right side or bounds, and these without rows."""
    if (A is None) != (b is None):
        given, absent = ("b", "A") if A is None else ("A", "b")
        raise InputError(f"{given} was given without {absent}; give both or neither")
    if C is None and not (l is None and u is None):
        given = "u" if l is None else "l"
        raise InputError(f"{given} was given without C; give the rows as well, or use lb and ub")
    if C is not None and l is None and u is None:
        raise InputError("C was given without bounds; give l, u or both")


def _length(name: str, value: Any) -> int:
    try:
        shape = np.shape(value)
    except ValueError as error:
        raise InputError(f"{name} is not an array of numbers: {value!r:.80}; expected a vector") from error
    if len(shape) != 1:
        raise InputError(f"{name} has shape {shape}, expected a vector")
    return int(shape[0])


def _rows(name: str, value: Any, count: int, n: int, symbol: str) -> FloatArray:
    """Rows as (count, n); no rows may be given as anything empty."""
    if value is None or (count == 0 and np.size(value) == 0):
        return np.zeros((0, n))
    return array(name, value, (count, n), symbol)


def _bounds(
    low_name: str, low: Any, high_name: str, high: Any, n: int, symbol: str
) -> tuple[FloatArray, FloatArray]:
    lows = np.full(n, -np.inf) if low is None else array(low_name, low, (n,), symbol, finite=False)
    highs = np.full(n, np.inf) if high is None else array(high_name, high, (n,), symbol, finite=False)
    for i in np.flatnonzero((lows > highs) | (lows == np.inf) | (highs == -np.inf)):
        raise InputError(
            f"{low_name}[{i}] = {lows[i]:g} and {high_name}[{i}] = {highs[i]:g} leave nothing between them; "
            f"expected {low_name} <= {high_name}, with -inf and inf for no bound"
        )
    return lows, highs


def _convex(H: FloatArray) -> FloatArray:
    """H with its rounding symmetrised away."""
    size = float(np.abs(H).max())
    with np.errstate(over="ignore"):
        off = float(np.abs(H - H.T).max())
    if off > SYMMETRY_TOLERANCE * size:
        raise InputError(
            f"H is not symmetric (|H - H'| reaches {off:.1e}); expected H = H'; pass (H + H')/2 if meant"
        )
    H = 0.5 * H + 0.5 * H.T
    least = float(np.linalg.eigvalsh(H / size).min()) if size > 0.0 else 0.0
    if least < -CONVEXITY_TOLERANCE:
        raise InputError(
            f"H is indefinite (smallest eigenvalue {least * size:.3g}); expected a positive semidefinite "
            "Hessian, a QP that is not convex is not solved here"
        )
    return H
