"""The last step from an approximate answer to an exact one: solve for the bounds that it has found active."""

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.qp.adapters.buffers import QPBuffers

STEPS = 2
"""The most systems that are solved: one for the active bounds of the answer, one for those that its own
solution asks for."""
EXACT = 1e-9
"""What an optimality condition may be off, as a share of the size of its terms; where a bound is, plus one.

Multipliers have no size of their own: in the units in which a QP is posed for a second attempt they may all
be smaller than this.
"""
REGULAR = 1e-12
"""Subtracted from the diagonal of the rows, so that rows that depend on each other can be solved for, too."""
REFINEMENTS = 2
"""Corrections of a solution, which take the regularisation out again."""


def polished(qp: QPBuffers, soft: FloatArray | None) -> bool:
    """Polish the solution in the buffers; False, and they are as before, where that does not succeed.

    The answer in the buffers is a guess of which bounds are active: a lower one where x - lb < -z, an upper
    one where ub - x < z. With the active variables at their bounds, F the others, W the equality rows and the
    active ones of C, and w their right sides,

        [ H_FF   W_F'  ] [ x_F ]   [ -(g + H x_B)_F ]
        [ W_F   -soft  ] [  y  ] = [    w - W x_B   ]

    Slacks of compliant rows are eliminated. The solution counts only if it fulfils every optimality condition
    of the QP; else it is the next guess, once.
    Source: Stellato et al. 2020, section 4, which solves once; to go on with the bounds that the solution
    asks for is the primal-dual active set method of Hintermueller, Ito and Kunisch 2003.

    Rows of compliance ``soft``, (m,), give way; None: they are hard.
    """
    if not np.isfinite(qp.solution).all():
        return False
    m, p = qp.m, qp.p
    inner = qp.n if soft is None else qp.n - m
    give = np.zeros(m + p)
    give[:m] = 0.0 if soft is None else soft
    H, g, rows = qp.H[:inner, :inner], qp.g[:inner], qp.rows[:, :inner]
    lb, ub, low, high = qp.lb[:inner], qp.ub[:inner], qp.lower[qp.n :], qp.upper[qp.n :]
    x, z_box, z = qp.x[:inner], qp.z_box[:inner], qp.multipliers[qp.n :]
    fixed, equal = lb == ub, low == high
    equal[:m] = True
    before = b""
    for _ in range(STEPS):
        value = rows @ x
        down, up = _active(x, lb, ub, z_box, fixed)
        below, above = _active(value, low, high, z, equal)
        now = down.tobytes() + up.tobytes() + below.tobytes() + above.tobytes()
        if now == before:
            return False
        before = now
        held, kept = down | up, np.flatnonzero(below | above)
        free = np.flatnonzero(~held)
        at = np.where(down, lb, np.where(up, ub, 0.0))
        W = rows[kept]
        right = np.concatenate([-(g + H @ at)[free], np.where(below, low, high)[kept] - W @ at])
        solution = _solved(H[np.ix_(free, free)], W[:, free], give[kept], right)
        if solution is None:
            return False
        x, z = at, np.zeros(m + p)
        x[free], z[kept] = solution[: len(free)], solution[len(free) :]
        force, pull = H @ x, rows.T @ z
        z_box = -(force + g + pull)
        size = max(np.abs(force).max(), np.abs(g).max(), np.abs(pull).max())
        if (np.abs(z_box[free]) > EXACT * size).any():
            return False
        z_box[free] = 0.0
        value = rows @ x - give * z
        reach = 1.0 + np.abs(x).max()
        if (
            _kept(x, lb, ub, EXACT * reach)
            and _kept(value, low, high, EXACT * (reach + np.abs(value)))
            and _signed(z_box, down & ~fixed, up, EXACT * size)
            and _signed(z, below & ~equal, above, EXACT * np.abs(z).max(initial=0.0))
        ):
            break
    else:
        return False
    np.clip(x, lb, ub, out=qp.x[:inner])
    qp.multipliers[qp.n :] = z
    qp.z_box[:] = 0.0
    qp.z_box[:inner] = z_box
    if soft is not None:
        qp.x[inner:] = -qp.A[:, inner:].diagonal() * qp.y / qp.H[inner:, inner:].diagonal()
    return True


def _active(
    value: FloatArray, low: FloatArray, high: FloatArray, z: FloatArray, equal: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """Which values are at their lower bound, equalities among them, and which at their upper one."""
    down: BoolArray = equal | (value - low < -z)
    up: BoolArray = ~down & (high - value < z)
    return down, up


def _solved(H: FloatArray, W: FloatArray, give: FloatArray, right: FloatArray) -> FloatArray | None:
    """The solution of the system of ``polished``; None where it has none."""
    f, N = len(H), len(right)
    system = np.zeros((N, N))
    system[:f, :f], system[f:, :f], system[:f, f:] = H, W, W.T
    rows = np.arange(f, N)
    system[rows, rows] = -give
    regular = system.copy()
    regular[rows, rows] -= REGULAR
    factors, pivots, failed = dgetrf(regular)
    if failed:
        return None
    solution: FloatArray
    solution, _ = dgetrs(factors, pivots, right)
    for _ in range(REFINEMENTS):
        correction, _ = dgetrs(factors, pivots, right - system @ solution)
        solution = solution + correction
    return solution if bool(np.isfinite(solution).all()) else None


def _kept(value: FloatArray, low: FloatArray, high: FloatArray, margin: FloatArray | float) -> bool:
    return not ((value < low - margin) | (value > high + margin)).any()


def _signed(z: FloatArray, down: BoolArray, up: BoolArray, margin: float) -> bool:
    return not (z[down] > margin).any() and not (z[up] < -margin).any()
