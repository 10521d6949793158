"""The motion after a lock where it creeps: one run by an L-stable method of order 2, in real time.

Next to configurations that are nearly singular dq/ds turns within a width of the least singular value, while
dq/dt decays linearly there, which an L-stable method passes in long steps. Slopes are central differences.

Source: Shampine and Reichelt 1997, section 3.1 (ode23s).
"""

from math import sqrt
from typing import Any, Final

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import CORRECT, NONE, UNRESOLVED
from ftqp.kernel.layout.other_records import LONG_WAY, SHARE
from ftqp.kernel.maths.linear_systems import lu_factor, lu_solve
from ftqp.kernel.maths.side_by_side import WIDTH, several
from ftqp.kernel.study.ends_ahead import (
    MOVING,
    NEAR,
    draws,
    ending_ahead,
    goal_ahead,
    put_slopes,
)
from ftqp.kernel.study.law_rates import LOOKS, note, rates_at

D: Final = 0.2928932188134524
"""1 / (2 + sqrt 2). Derived in the source."""
E32: Final = 7.414213562373095
"""6 + sqrt 2. Derived in the source."""
MOST: Final = 3
"""Trial steps at most, in those of the method before."""
FIRST: Final = 1e-4
LONGEST: Final = 1e6
"""Lengths of the first step and of any step [s], with the gain 1/s."""


@jit
def _look(S: Any, L: Any, error: float, speed: float, regular: float) -> int:
    """What is ahead of ``here``; an end is in ``there``."""
    if error < (NEAR * L.unit) ** 2:
        rates_at(S, L, L.here, L.w)  # eight times in ``eight``
        goal_ahead(S, L, L.eight, L.alone, several(L.reach, 0), 1)
        if L.found[0] > 0.5 and draws(S, L, 0):
            for i in range(S.chain.n):
                L.there[i] = L.trial[i * WIDTH]
            return CORRECT
    return ending_ahead(S, L, speed, regular)


@jit
def _rates_into(S: Any, L: Any, q: Any, out: Any) -> None:
    """v of the joints that move, (k,), at q, (n,)."""
    rates_at(S, L, q, L.v)
    for i in range(L.moves):
        out[i] = L.v[L.moving[i]]


@jit
def _moved(L: Any, h: float, by: Any) -> None:
    """there <- here + h by."""
    for i in range(L.moves):
        L.there[L.moving[i]] = L.here[L.moving[i]] + h * by[i]


@rare_jit
def creep(S: Any, L: Any, seat: int, trace: Any) -> int:
    """How the run of a seat, which is at ``here``, ends; where, is in ``there``."""
    n, k, h, time, gone = S.chain.n, L.moves, FIRST, L.time[seat], L.gone[seat]
    for trial in range(MOST * L.most):
        put_slopes(S, L, L.here)
        for i in range(k):
            L.f_0[i] = L.v[L.moving[i]]
        error, speed, regular = L.one_error[0], L.one_speed[0], L.one_regular[0]
        if trial % LOOKS == 0:
            ending = _look(S, L, error, speed, regular)
            if ending != MOVING:
                return ending
            if L.path[seat] > LONG_WAY:
                break
            put_slopes(S, L, L.here)
        for i in range(k):
            L.k_1[i] = L.f_0[i]
            for j in range(k):
                L.work[i, j] = (1.0 if i == j else 0.0) - h * D * L.slope[i, j]
        if not lu_factor(L.work, k, L.pivots):
            h *= 0.5
            continue
        for i in range(n):
            L.there[i] = L.here[i]
        lu_solve(L.work, k, L.pivots, L.k_1)
        _moved(L, 0.5 * h, L.k_1)
        _rates_into(S, L, L.there, L.f_1)
        for i in range(k):
            L.k_2[i] = L.f_1[i] - L.k_1[i]
        lu_solve(L.work, k, L.pivots, L.k_2)
        for i in range(k):
            L.k_2[i] += L.k_1[i]
        _moved(L, h, L.k_2)
        _rates_into(S, L, L.there, L.k_3)
        for i in range(k):
            L.k_3[i] -= E32 * (L.k_2[i] - L.f_1[i]) + 2.0 * (L.k_1[i] - L.f_0[i])
        lu_solve(L.work, k, L.pivots, L.k_3)
        wrong, moved = 0.0, 0.0
        for i in range(k):
            wrong += (h / 6.0 * (L.k_1[i] - 2.0 * L.k_2[i] + L.k_3[i])) ** 2
            moved += (h * L.k_2[i]) ** 2
        wrong = sqrt(wrong) / L.tolerance
        if wrong <= 1.0:
            L.path[seat] += sqrt(moved)
            gone += h * (SHARE + speed)
            time += h * max(L.slowness, sqrt(error) * L.per_speed)
            for i in range(n):
                L.here[i] = L.there[i]
            note(S, L, trace, L.here, 1, gone, time, L.one_error[0])
        h = min(LONGEST, h * min(5.0, max(0.2, 0.9 / (wrong + 1e-6) ** (1.0 / 3.0))))
    for i in range(n):
        L.there[i] = L.here[i]
    return NONE if L.path[seat] > LONG_WAY else UNRESOLVED
