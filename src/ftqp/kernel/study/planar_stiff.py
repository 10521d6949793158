"""The motion after a lock where it creeps: one run by an L-stable method of order 2, in real time.

Next to a curve of configurations that are nearly singular dq/ds jumps within a width of det A, while
dq/dt = g decays linearly there, which an L-stable method passes in long steps.

Source: Shampine and Reichelt 1997, section 3.1 (ode23s); the Jacobian is exact.
"""

from math import sqrt
from typing import Any, Final

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.endings import CORRECT, NONE, SINGULAR, UNRESOLVED
from ftqp.kernel.maths.lu import lu_factor, lu_solve
from ftqp.kernel.maths.side_by_side import WIDTH, put
from ftqp.kernel.study.planar_arm import SHARE, TINY, field
from ftqp.kernel.study.planar_goal import NEAR, goal_ahead
from ftqp.kernel.study.planar_rest import MOVING, rest_ahead, slopes

D: Final = 0.2928932188134524
"""1 / (2 + sqrt 2)."""
E32: Final = 7.414213562373095
"""6 + sqrt 2."""
STEPS: Final = 3000
"""Trial steps at most."""
FIRST: Final = 1e-4
"""Length of the first step [s], with the gain 1/s."""
SLOW: Final = 3e-2
"""Below this |dq/ds| rest is looked for."""
LONG_WAY: Final = 60.0
"""A run that went further without rest has none [rad]."""


@jit
def _place(P: Any, q: Any) -> None:
    """All eight configurations of ``single`` at q."""
    for i in range(len(P.link)):
        P.single[i * WIDTH : (i + 1) * WIDTH] = q[i]


@jit
def _rates_into(P: Any, q: Any, out: Any) -> Any:
    """g = I_S G e at q into ``out``; |e|^2 and |g|."""
    _place(P, q)
    error, det, size = field(P, P.single, P.single_free, P.single_rate)
    put(P.single_error, 0, error)
    put(P.single_det, 0, det)
    put(P.single_size, 0, size)
    det_here, size_here = P.single_det[0] + TINY, P.single_size[0]
    scale = (SHARE * det_here + size_here) / det_here
    for i in range(len(P.link)):
        out[i] = P.single_rate[i * WIDTH] * scale
    return P.single_error[0], size_here / det_here


@jit
def _matrix(P: Any, h: float) -> bool:
    """W = I - h d dg/dq at ``single``, factorised in ``work``; False where it is singular.

    g = F / det A, so that dg = dF / det A - g d(det A) / det A.
    """
    n = len(P.link)
    _, det, _ = slopes(P, P.single, P.single_free)
    det += TINY
    for l in range(n):
        for i in range(n):
            slope = (P.slope[i, l] - P.F[i] * P.det_slope[l] / det) / det
            P.work[i, l] = (1.0 if i == l else 0.0) - h * D * slope
    return lu_factor(P.work, n, P.pivots)


@rare_jit
def creep(P: Any, way: float) -> int:
    """How a run ends that is at ``here``, with the joints of ``single_free`` and a way behind it.

    The end is in ``trial``.
    """
    n, h = len(P.link), FIRST
    error, speed = _rates_into(P, P.here, P.f_0)
    for trial in range(STEPS):
        if trial % 4 == 0:
            ending = _verdict(P, error, speed)
            if ending != MOVING:
                return ending
            if way > LONG_WAY:
                return NONE
            _rates_into(P, P.here, P.f_0)
        if not _matrix(P, h):
            h *= 0.5
            continue
        for i in range(n):
            P.k_1[i] = P.f_0[i]
        lu_solve(P.work, n, P.pivots, P.k_1)
        for i in range(n):
            P.y[i] = P.here[i] + 0.5 * h * P.k_1[i]
        _rates_into(P, P.y, P.f_1)
        for i in range(n):
            P.k_2[i] = P.f_1[i] - P.k_1[i]
        lu_solve(P.work, n, P.pivots, P.k_2)
        for i in range(n):
            P.k_2[i] += P.k_1[i]
            P.y[i] = P.here[i] + h * P.k_2[i]
        next_error, next_speed = _rates_into(P, P.y, P.k_3)
        for i in range(n):
            after = P.k_3[i]
            P.k_3[i] = after - E32 * (P.k_2[i] - P.f_1[i]) - 2.0 * (P.k_1[i] - P.f_0[i])
            P.f_1[i] = after
        lu_solve(P.work, n, P.pivots, P.k_3)
        wrong, moved = 0.0, 0.0
        for i in range(n):
            wrong += (h / 6.0 * (P.k_1[i] - 2.0 * P.k_2[i] + P.k_3[i])) ** 2
            moved += (h * P.k_2[i]) ** 2
        wrong = sqrt(wrong) / P.tolerance
        if wrong <= 1.0:
            for i in range(n):
                P.here[i], P.f_0[i] = P.y[i], P.f_1[i]
            error, speed, way = next_error, next_speed, way + sqrt(moved)
        h *= min(5.0, max(0.2, 0.9 / (wrong + 1e-6) ** (1.0 / 3.0)))
        _place(P, P.here)
    return UNRESOLVED


@jit
def _verdict(P: Any, error: float, speed: float) -> int:
    """What is ahead of ``here``."""
    _place(P, P.here)
    if error < NEAR * NEAR:
        goal_ahead(P, P.single, P.single_free)
        if P.found[0] > 0.5:
            return CORRECT if P.found[0] < 1.5 else SINGULAR
    if speed < SLOW:
        return rest_ahead(P, P.single_free)
    return MOVING
