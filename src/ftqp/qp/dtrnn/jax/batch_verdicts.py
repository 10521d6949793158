"""What surrounds the network of a batch: verdicts before it runs, multipliers after it."""

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.kernel.layout.enums import FAILED, INFEASIBLE, SOLVED

CONTRADICTION = 1e-8
"""A row without free variables that is violated by more than this share of its terms has no solution."""


def verdicts(
    H: FloatArray,
    g: FloatArray,
    A: FloatArray,
    b: FloatArray,
    C: FloatArray,
    l: FloatArray,
    u: FloatArray,
    lb: FloatArray,
    ub: FloatArray,
) -> IntArray:
    """What the data say already, (B,): FAILED with NaN, INFEASIBLE with crossed bounds, SOLVED for go on."""
    whole = [np.isfinite(part) for part in (H, g, A, b, C)] + [~np.isnan(part) for part in (l, u, lb, ub)]
    sound = np.logical_and.reduce([part.reshape(len(part), -1).all(axis=1) for part in whole])
    fixed = lb == ub
    at = np.where(fixed & np.isfinite(lb), lb, 0.0)
    contradicted = _crossed(l, u) | _crossed(lb, ub)
    for rows, low, high in ((A, b, b), (C, l, u)):
        with np.errstate(invalid="ignore"):  # NaN, which is FAILED
            no_freedom = ((rows == 0.0) | fixed[:, None, :]).all(axis=2)
            value = (rows @ at[:, :, None])[:, :, 0]
            terms = (np.abs(rows) @ np.abs(at)[:, :, None])[:, :, 0]
            allowed = CONTRADICTION * (1.0 + terms)
            contradicted |= (no_freedom & ~((low - value <= allowed) & (value - high <= allowed))).any(axis=1)
    return np.where(sound, np.where(contradicted, INFEASIBLE, SOLVED), FAILED)


def _crossed(low: FloatArray, high: FloatArray) -> BoolArray:
    """Whether some bounds leave nothing between them, (B,)."""
    crossed: BoolArray = ((low > high) | (low == np.inf) | (high == -np.inf)).any(axis=1)
    return crossed


def published(
    data: list[FloatArray], state: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The QPs' x, y, z, z_box from the network's states (x; slacks; multipliers), (B, n + p + m + p).

    x is clipped, y and z follow the convention of ``ftqp.QP``, and z_box_i = -(Hx + g + A'y + C'z)_i where
    x_i is fixed or the step x_i + z_box_i leaves the box there, else 0.
    """
    H, g, A, _, C, _, _, lb, ub = data
    n, m, p = g.shape[1], A.shape[1], C.shape[1]
    fixed = lb == ub
    with np.errstate(invalid="ignore"):  # NaN, of problems that failed
        x = np.where(fixed, lb, np.clip(state[:, :n], lb, ub))
        norm = np.sqrt((np.where(fixed[:, None, :], 0.0, C) ** 2).sum(axis=2))
        y, z = -state[:, n + p : n + p + m], -state[:, n + p + m :] / np.where(norm > 0.0, norm, 1.0)
        forces = x[:, None, :] @ H + y[:, None, :] @ A + z[:, None, :] @ C
        z_box = -(g + forces[:, 0, :])
        outside = (x + z_box < lb) | (x + z_box > ub)
    return x, y, z, np.where(fixed | outside, z_box, 0.0)
