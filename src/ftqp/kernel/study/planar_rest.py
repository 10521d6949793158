"""Rest of a planar arm some of whose joints do not move: slopes of the field, a search with a verdict."""

from math import sqrt
from typing import Any, Final

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.endings import CORRECT, ERRONEOUS, SINGULAR
from ftqp.kernel.maths.lu import lu_factor, lu_solve
from ftqp.kernel.maths.side_by_side import WIDTH
from ftqp.kernel.study.planar_arm import levers, weighted
from ftqp.kernel.study.planar_goal import FLAT, REACH

MOVING: Final = -1
"""Not at rest, as far as is known."""
SEARCHES: Final = 12
"""Newton steps at most."""
STILL: Final = 1e-11
"""A Newton step this short has converged [rad]."""
AT_GOAL: Final = 1e-6
"""|e| at a rest that counts as the goal [mean link lengths]."""
SQUARINGS: Final = 24
"""Of the Cayley transform, until its powers have grown or died."""


@jit
def slopes(P: Any, q: Any, free: Any) -> Any:
    """F, dF/dq and d(det A)/dq at the first of eight configurations; |e|^2, det A and |F|^2.

    With y = adj(A) e, D_l = sum over i of dj_i m_i' and dj_i = -p_max(i, l): dA = D + D', de = -j_l,
    dy = adj(dA) e + adj(A) de, dm_i = sum over k of M_ik dj_k, and dF_i = dm_i.y + m_i.dy. Rows and columns
    of joints that do not move are zero.
    """
    n = len(P.link)
    levers(P, q)
    weighted(P)
    ex, ey = P.goal[0] - P.px[0], P.goal[1] - P.py[0]
    a, b, d = 0.0, 0.0, 0.0
    for i in range(n):
        at = i * WIDTH
        a, b = a - P.py[at] * P.mx[at], b - P.py[at] * P.my[at]
        d += P.px[at] * P.my[at]
    yx, yy = d * ex - b * ey, a * ey - b * ex
    size = 0.0
    for i in range(n):
        at = i * WIDTH
        P.F[i] = free[at] * (P.mx[at] * yx + P.my[at] * yy)
        size += P.F[i] * P.F[i]
    for l in range(n):
        if free[l * WIDTH] < 0.5:
            P.slope[:, l] = 0.0
            P.det_slope[l] = 0.0
            continue
        xx, xy, yx_, yy_ = 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            at, far = i * WIDTH, max(i, l) * WIDTH
            xx -= P.px[far] * P.mx[at]
            xy -= P.px[far] * P.my[at]
            yx_ -= P.py[far] * P.mx[at]
            yy_ -= P.py[far] * P.my[at]
        da, db, dd = 2.0 * xx, xy + yx_, 2.0 * yy_
        dex, dey = P.py[l * WIDTH], -P.px[l * WIDTH]
        dyx = dd * ex - db * ey + d * dex - b * dey
        dyy = da * ey - db * ex + a * dey - b * dex
        P.det_slope[l] = da * d + a * dd - 2.0 * b * db
        for i in range(n):
            at = i * WIDTH
            dmx, dmy = 0.0, 0.0
            for k in range(n):
                far = max(k, l) * WIDTH
                dmx -= P.M[i, k] * P.px[far]
                dmy -= P.M[i, k] * P.py[far]
            P.slope[i, l] = free[at] * (dmx * yx + dmy * yy + P.mx[at] * dyx + P.my[at] * dyy)
    return ex * ex + ey * ey, a * d - b * b, size


@jit
def rest_ahead(P: Any, free: Any) -> int:
    """Search a zero of F from the configuration ``single`` on: CORRECT, ERRONEOUS, SINGULAR, or MOVING.

    A zero counts where it lies within REACH and all eigenvalues of the reduced slopes are on the left; it is
    in ``trial`` then.
    """
    n = len(P.link)
    for i in range(n):
        P.trial[i * WIDTH : (i + 1) * WIDTH] = P.single[i * WIDTH]
    way = 0.0
    for _ in range(SEARCHES):
        slopes(P, P.trial, free)
        for i in range(n):
            P.y[i] = -P.F[i]
            for j in range(n):
                P.work[i, j] = P.slope[i, j]
            if free[i * WIDTH] < 0.5:
                P.work[i, i] = 1.0
        if not lu_factor(P.work, n, P.pivots):
            return MOVING
        lu_solve(P.work, n, P.pivots, P.y)
        length, way = 0.0, 0.0
        for i in range(n):
            length += P.y[i] * P.y[i]
            moved = P.trial[i * WIDTH] + P.y[i]
            P.trial[i * WIDTH : (i + 1) * WIDTH] = moved
            way += (moved - P.single[i * WIDTH]) ** 2
        if not way < REACH * REACH:
            return MOVING
        if length < STILL * STILL:
            break
    else:
        return MOVING
    error, det, _ = slopes(P, P.trial, free)
    if not all_left(P, free):
        return MOVING
    if error < AT_GOAL * AT_GOAL:
        return CORRECT
    return ERRONEOUS if det > FLAT else SINGULAR


@jit
def all_left(P: Any, free: Any) -> bool:
    """Whether all eigenvalues of the reduced slopes have negative real parts.

    Of two joints that move by det > 0 and trace < 0, else by the powers of the Cayley transform
    C = (s - S)^-1 (s + S): they die out just where S is stable, as |(s + x)/(s - x)| < 1 where Re x < 0.
    """
    n = len(P.link)
    moving, first, second = 0, 0, 0
    for i in range(n):
        if free[i * WIDTH] > 0.5:
            first, second = second, i
            moving += 1
    S = P.slope
    if moving == 2:
        det = S[first, first] * S[second, second] - S[first, second] * S[second, first]
        return det > 0.0 and S[first, first] + S[second, second] < 0.0
    scale = 0.0
    for i in range(n):
        for j in range(n):
            scale = max(scale, abs(S[i, j]))
    if moving == 1 or not scale > 0.0:
        return S[second, second] < 0.0
    for i in range(n):
        if free[i * WIDTH] < 0.5:
            S[i, i] = -scale
    return powers_die(P, n, scale)


@jit
def powers_die(P: Any, n: int, scale: float) -> bool:
    """Whether the powers of the Cayley transform of ``slope`` die out; the slopes are lost."""
    S, B = P.slope, P.work
    for i in range(n):
        for j in range(n):
            B[i, j] = (scale if i == j else 0.0) - S[i, j]
            S[i, j] += scale if i == j else 0.0
    if not lu_factor(B, n, P.pivots):
        return False
    for j in range(n):
        for i in range(n):
            P.y[i] = S[i, j]
        lu_solve(B, n, P.pivots, P.y)
        for i in range(n):
            S[i, j] = P.y[i]
    for _ in range(SQUARINGS):
        size = 0.0
        for i in range(n):
            for j in range(n):
                s = 0.0
                for k in range(n):
                    s += S[i, k] * S[k, j]
                B[i, j] = s
                size += s * s
        for i in range(n):
            for j in range(n):
                S[i, j] = B[i, j]
        if not size < 1e30:
            return False
        if size < 1e-6:
            return True
    return sqrt(size) < 1e-3
