"""Straight stretches of the implicit method, taken in one go."""

from math import inf

from ftqp.kernel.dtrnn.projection import Network
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.lu import lu_solve

STEADY = 1e-2
"""Largest change of e in a step, as a share of e, that counts as a straight stretch at first ..."""
STRICTER = 0.1
"""... and the factor on that share after a stretch that made |e| larger. A guess that
`python solvers/study_dtrnn.py` has not contradicted."""
NEARLY = 0.99
"""Share of the way to the next bound that is taken. Short of it, so that rounding takes no component past its
bound."""


@jit
def _to_next_side(w: float, rate: float, low: float, high: float) -> float:
    """How many steps until w, moving by ``rate`` a step, passes an end of [low, high]."""
    least = inf
    if rate != 0.0:
        for bound in (low, high):
            steps = (bound - w) / rate
            if 0.0 < steps < least:
                least = steps
    return least


@jit
def drift(net: Network, gamma: float, steady: float) -> bool:
    """Take all steps of the implicit method up to the next change of an active bound, when they are alike.

    While no w = u - (Gamma u + z) passes a bound, e changes with u by (Gamma d)_i inside and by d_i at a
    bound. Where a step d = -gamma (I + Gamma)^-1 e hardly changes e, the next one is nearly d again, and so
    on, often for thousands of steps: a multiplier has to grow by |d| a step until the next bound gives way.
    Then u <- u + t d, with t d short of the first change of a side and t |change of e| <= |e|: this is the
    method's own path, walked faster.
    Source: docs/theory/recurrent-network.md, "Straight stretches".

    Args:
        net: its F and e are those of u.
        gamma: step size.
        steady: largest change of e in a step, as a share of e.
    """
    N = len(net.u)
    d = net.direction
    size, change = 0.0, 0.0
    for i in range(N):
        d[i] = -gamma * net.e[i]
        size = max(size, abs(net.e[i]))
    lu_solve(net.factor, N, net.pivots, d)
    steps = inf
    for i in range(N):
        row = net.Gamma[i]
        s = 0.0
        for j in range(N):
            s += row[j] * d[j]
        w = net.u[i] - net.F[i]
        inside = w > net.low[i] and w < net.high[i]
        change = max(change, abs(s) if inside else abs(d[i]))
        steps = min(steps, _to_next_side(w, d[i] - s, net.low[i], net.high[i]))
    steps = min(steps, size / change if change > 0.0 else inf)
    if not (change <= steady * size and 2.0 < steps < inf):
        return False
    for i in range(N):
        net.u[i] += NEARLY * steps * d[i]
    return True
