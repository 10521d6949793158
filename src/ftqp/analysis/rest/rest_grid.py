"""All rests of an arm of three joints with two task rows for one locked value, found on a grid of the others.

Source: docs/theory/unidentified-failures.md, "Rest".
"""

import numpy as np

from ftqp.analysis.circular_intervals import wrapped
from ftqp.analysis.goals import GoalStudy
from ftqp.core.checks import BoolArray, FloatArray, IntArray

CELLS = 60
"""Cells of the grid along each of the two joints."""
INFLATED = 0.1
"""A cell may hold a zero where its corners miss a change of sign by less than this share of their spread."""
NEWTON = 30
"""Newton steps from a cell at most."""
SAME = 1e-5
"""Configurations nearer than this are one [rad or m]."""
FAR = 0.5
"""Longest Newton step [rad or m]."""


def fits_grid(study: GoalStudy) -> bool:
    """Whether the arm has three joints that turn and two task rows."""
    turns = not study.robot.chain.prismatic.any()
    return study.robot.nv == 3 and study.m == 2 and turns and not study.idle


def grid_rests(study: GoalStudy, M: FloatArray, i: int, value: float) -> FloatArray:
    """Configurations with joint i at a value where (W n)_i = 0 and e is along a_i, (k, 3) [rad]."""
    w = np.linalg.inv(M)[i]
    others = np.delete(np.arange(3, dtype=np.int64), i)
    nodes = np.linspace(-np.pi, np.pi, CELLS + 1)
    q = np.full(((CELLS + 1) ** 2, 3), value)
    q[:, others] = np.stack(np.meshgrid(nodes, nodes, indexing="ij"), axis=-1).reshape(-1, 2)
    pair = _pair(study, w, i, q)[0].reshape(CELLS + 1, CELLS + 1, 2)
    corners = np.stack([pair[:-1, :-1], pair[1:, :-1], pair[:-1, 1:], pair[1:, 1:]])
    low, high = corners.min(axis=0), corners.max(axis=0)
    slack = INFLATED * (high - low)
    marked = ((low - slack <= 0.0) & (high + slack >= 0.0)).all(axis=-1)
    half = 0.5 * (nodes[1] - nodes[0])
    start = np.full((int(marked.sum()), 3), value)
    start[:, others] = nodes[np.argwhere(marked)] + half
    return distinct(_newton(study, w, i, start, others), np.ones(3, dtype=np.bool_))


def _pair(study: GoalStudy, w: FloatArray, i: int, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(W n)_i with n = a_1 x a_2 of the rows of A, and e x a_i, (k, 2), and their derivatives, (k, 2, 3)."""
    e, A, D, H = study.free.values(q, rates=True)
    first = np.cross(A[:, 0], A[:, 1]) @ w
    second = e[:, 0] * A[:, 1, i] - e[:, 1] * A[:, 0, i]
    turning = np.cross(H[:, :, 0], A[:, None, 1]) + np.cross(A[:, None, 0], H[:, :, 1])
    d = np.empty((len(q), 2, 3))
    d[:, 0] = turning @ w
    d[:, 1] = -D[:, 0] * A[:, 1, None, i] + D[:, 1] * A[:, 0, None, i]
    d[:, 1] += e[:, 0, None] * H[:, :, 1, i] - e[:, 1, None] * H[:, :, 0, i]
    return np.column_stack([first, second]), d


def _newton(study: GoalStudy, w: FloatArray, i: int, q: FloatArray, others: IntArray) -> FloatArray:
    """Those of the starts that get to a zero, there."""
    for _ in range(NEWTON):
        pair, d = _pair(study, w, i, q)
        step = (np.linalg.pinv(d[:, :, others], rcond=1e-9) @ pair[:, :, None])[:, :, 0]
        longest = np.abs(step).max(axis=1, initial=0.0)
        q = q.copy()
        q[:, others] -= step * np.minimum(1.0, FAR / np.maximum(longest, 1e-300))[:, None]
    pair, _ = _pair(study, w, i, q)
    return np.asarray(q[np.abs(pair).max(axis=1, initial=0.0) < 1e-11])


def distinct(q: FloatArray, turns: BoolArray) -> FloatArray:
    """One of each set of configurations that are the same up to whole turns, (k, n) [rad or m]."""
    kept: list[FloatArray] = []
    for one in q:
        if all(np.abs(np.where(turns, wrapped(d), d)).max() > SAME for d in (one - other for other in kept)):
            kept.append(one)
    return np.array(kept).reshape(-1, len(turns))
