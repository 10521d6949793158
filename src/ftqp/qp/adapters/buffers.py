"""The arrays where a planner and a backend meet: one QP of fixed size, rewritten in place every tick."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class QPBuffers:
    """One QP and its solution as preallocated arrays.

    min 1/2 x'Hx + g'x, Ax = b, l <= Cx <= u, lb <= x <= ub.

    The content changes every tick, the shapes never do. Everything a solver wants in one piece lies in one
    piece: the rows are stacked as [A; C], bounds and multipliers as [box; equality; two-sided], and ``A``,
    ``b``, ``C``, ... are contiguous views of the stacks. Write ``b``; its copy inside ``upper``
    is the backend's business. Made by ``zeros``.

    Attributes:
        flat: The whole problem in one piece, matrices by rows: [H; g; A; C; lb; b; l; ub; b; u].
        data: Its first part, [H; g; A; C], (n * n + n + (m + p) * n,).
        bounds: Its second part, [lower; upper], (2 * (n + m + p),).
        solution: [x; z_box; y; z] in one piece, (2 * n + m + p,).
        H: Hessian, (n, n), symmetric.
        g: Linear term, (n,).
        rows: [A; C], (m + p, n).
        lower: [lb; b; l], (n + m + p,), -inf is no bound.
        upper: [ub; b; u], (n + m + p,), inf is no bound.
        A: Equality rows, (m, n).
        b: Their right side, (m,).
        C: Two-sided rows, (p, n).
        l: Their lower bounds, (p,).
        u: Their upper bounds, (p,); ``l == u`` is an equality.
        lb: Lower bounds of x, (n,).
        ub: Upper bounds of x, (n,); ``lb == ub`` fixes a variable.
        x: Solution, (n,).
        multipliers: [z_box; y; z], (n + m + p,).
        y: Multipliers of Ax = b, (m,).
        z: Multipliers of the two-sided rows, (p,), > 0 at an upper bound, < 0 at a lower one.
        z_box: Multipliers of the bounds of x, (n,), same signs.
        constant_hessian: Whether ``H`` keeps its values between solves, so that a warm solve may skip it.
    """

    flat: FloatArray
    data: FloatArray
    bounds: FloatArray
    solution: FloatArray
    H: FloatArray
    g: FloatArray
    rows: FloatArray
    lower: FloatArray
    upper: FloatArray
    A: FloatArray
    b: FloatArray
    C: FloatArray
    l: FloatArray
    u: FloatArray
    lb: FloatArray
    ub: FloatArray
    x: FloatArray
    multipliers: FloatArray
    y: FloatArray
    z: FloatArray
    z_box: FloatArray
    constant_hessian: bool = False

    @classmethod
    def zeros(cls, n: int, m: int, p: int, *, constant_hessian: bool = False) -> Self:
        """Buffers with H = I, no bounds, and zero elsewhere.

        Args:
            n: Number of variables, >= 1.
            m: Number of equality rows, >= 0.
            p: Number of two-sided rows, >= 0.
            constant_hessian: Whether ``H`` keeps its values between solves, so that a warm solve may skip it.

        Raises:
            InputError: There are no variables, or a count is negative.
        """
        if n < 1 or m < 0 or p < 0:
            raise InputError(f"a QP cannot have n = {n}, m = {m}, p = {p}; expected n >= 1, m >= 0, p >= 0")
        k = n + m + p
        size = n * n + n + (m + p) * n
        flat, solution = np.zeros(size + 2 * k), np.zeros(n + k)
        data, bounds = flat[:size], flat[size:]
        H, g, rows = data[: n * n].reshape(n, n), data[n * n : n * n + n], data[n * n + n :].reshape(m + p, n)
        lower, upper, multipliers = bounds[:k], bounds[k:], solution[n:]
        H[np.diag_indices(n)] = 1.0
        lower[:n] = lower[n + m :] = -np.inf
        upper[:n] = upper[n + m :] = np.inf
        return cls(
            flat=flat, data=data, bounds=bounds, solution=solution, H=H, g=g, rows=rows, lower=lower,
            upper=upper, A=rows[:m], b=lower[n : n + m], C=rows[m:], l=lower[n + m :], u=upper[n + m :],
            lb=lower[:n], ub=upper[:n], x=solution[:n], multipliers=multipliers, y=multipliers[n : n + m],
            z=multipliers[n + m :], z_box=multipliers[:n], constant_hessian=constant_hessian,
        )  # fmt: skip

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
