"""The motion of any arm after a lock where it creeps: one run by an L-stable method of order 2, in real time.

Next to configurations that are nearly singular dq/ds turns within a width of the least singular value, while
dq/dt decays linearly there, which an L-stable method passes in long steps. Slopes are central differences.

Source: Shampine and Reichelt 1997, section 3.1 (ode23s).
"""

from math import sqrt
from typing import Any, Final

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.endings import UNRESOLVED
from ftqp.kernel.maths.lu import lu_factor, lu_solve
from ftqp.kernel.study.planar_rest import MOVING
from ftqp.kernel.study.planar_stiff import E32, FIRST, D
from ftqp.kernel.study.resolved_rates import law_rates
from ftqp.kernel.study.spatial_rest import put_slopes, verdict

STEPS: Final = 1000
"""Trial steps at most."""


@jit
def _matrix(S: Any, L: Any, h: float) -> bool:
    """W = I - h d dv/dq at ``q``, factorised in ``work``; False where it is singular."""
    n = S.chain.n
    for i in range(n):
        for j in range(n):
            L.work[i, j] = (1.0 if i == j else 0.0) - h * D * L.slope[i, j]
    return lu_factor(L.work, n, L.pivots)


@rare_jit
def creep(S: Any, L: Any, way: float) -> int:
    """How a run ends that is at ``q`` with a way behind it; its end is in ``trial``, else in ``q``.

    ``k1`` and ``k4`` are the rates at the ends of a step, ``k2``, ``k3`` and ``y`` the method's k_1 to k_3.
    """
    n, h = S.chain.n, FIRST
    law_rates(S, L, L.q, L.k1)
    size, speed, fresh = L.miss, L.speed, False
    for trial in range(STEPS):
        if trial % 4 == 0:
            ending = verdict(S, L, size, speed, way)
            if ending != MOVING:
                return ending
            fresh = False
        if not fresh:
            put_slopes(S, L, L.q)
            fresh = True
        if not _matrix(S, L, h):
            h *= 0.5
            continue
        for i in range(n):
            L.k2[i] = L.k1[i]
        lu_solve(L.work, n, L.pivots, L.k2)
        for i in range(n):
            L.next[i] = L.q[i] + 0.5 * h * L.k2[i]
        law_rates(S, L, L.next, L.k4)
        for i in range(n):
            L.k3[i] = L.k4[i] - L.k2[i]
        lu_solve(L.work, n, L.pivots, L.k3)
        for i in range(n):
            L.k3[i] += L.k2[i]
            L.next[i] = L.q[i] + h * L.k3[i]
            L.v[i] = L.k4[i]
        law_rates(S, L, L.next, L.k4)
        for i in range(n):
            L.y[i] = L.k4[i] - E32 * (L.k3[i] - L.v[i]) - 2.0 * (L.k2[i] - L.k1[i])
        lu_solve(L.work, n, L.pivots, L.y)
        wrong, moved = 0.0, 0.0
        for i in range(n):
            wrong += (h / 6.0 * (L.k2[i] - 2.0 * L.k3[i] + L.y[i])) ** 2
            moved += (h * L.k3[i]) ** 2
        wrong = sqrt(wrong) / L.tolerance
        if wrong <= 1.0:
            size, speed, way, fresh = L.miss, L.speed, way + sqrt(moved), False
            for i in range(n):
                L.q[i], L.k1[i] = L.next[i], L.k4[i]
        h *= min(5.0, max(0.2, 0.9 / (wrong + 1e-6) ** (1.0 / 3.0)))
    for i in range(n):
        L.trial[i] = L.q[i]
    return UNRESOLVED
