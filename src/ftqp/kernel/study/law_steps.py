"""The motion after a lock, eight runs at once: steps of orders 3 and 2, each run with its own length.

Source: Bogacki and Shampine 1989, the 3(2) pair.
"""

import math
from typing import Any, Final

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import any_of, larger, select, smaller, sqrt
from ftqp.kernel.maths.side_by_side import WIDTH, put, several
from ftqp.kernel.study.law_rates import TINY, clock, scaled_rates

LOOKS: Final = 4
"""Steps from one look at how a run may end to the next."""
LONGEST: Final = 1.0
"""Of a step, in s: the fastest motion near rest has the rate 2. Derived from the method's region of
stability, which ends beyond 2."""
FIRST: Final = 0.05
"""Length of the first step."""
SAFETY: Final = 0.9
GROWTH: Final = 5.0
SHRINKAGE: Final = 0.2
"""Largest changes of the length from step to step. Conventions of adaptive methods."""
NEVER: Final = 1e300
"""A time that does not come. A convention."""


@jit
def begin(S: Any, L: Any, seats: int) -> None:
    """The rates at the starts of runs that are fresh."""
    fresh = several(L.fresh, 0) > 0.5
    if not any_of(fresh):
        return
    error, speed, regular = scaled_rates(S, L, L.q, L.k4, seats)
    for at in range(0, S.chain.n * WIDTH, WIDTH):
        put(L.k1, at, select(fresh, several(L.k4, at), several(L.k1, at)))
    put(L.error, 0, select(fresh, error, several(L.error, 0)))
    put(L.speed, 0, select(fresh, speed, several(L.speed, 0)))
    put(L.regular, 0, select(fresh, regular, several(L.regular, 0)))
    put(L.rate, 0, select(fresh, clock(L, error, speed), several(L.rate, 0)))
    put(L.h, 0, select(fresh, FIRST, several(L.h, 0)))
    for array in (L.path, L.time, L.gone, L.fresh):
        put(array, 0, select(fresh, 0.0, several(array, 0)))
    put(L.arrived, 0, select(fresh, NEVER, several(L.arrived, 0)))


@jit
def step(S: Any, L: Any, seats: int) -> None:
    """One trial step of every run; where its error is too large, the run stays and its step gets shorter.

    Times are integrated by the same formula. A run whose |e| falls below ``success`` is told when it did,
    by linear interpolation.
    """
    size = S.chain.n * WIDTH
    h, r1 = several(L.h, 0), several(L.rate, 0)
    for at in range(0, size, WIDTH):
        put(L.next, at, several(L.q, at) + 0.5 * h * several(L.k1, at))
    e2, s2, _ = scaled_rates(S, L, L.next, L.k2, seats)
    for at in range(0, size, WIDTH):
        put(L.next, at, several(L.q, at) + 0.75 * h * several(L.k2, at))
    e3, s3, _ = scaled_rates(S, L, L.next, L.k3, seats)
    ninth = h * (1.0 / 9.0)
    for at in range(0, size, WIDTH):
        move = 2.0 * several(L.k1, at) + 3.0 * several(L.k2, at) + 4.0 * several(L.k3, at)
        put(L.next, at, several(L.q, at) + ninth * move)
    e4, s4, regular = scaled_rates(S, L, L.next, L.k4, seats)
    wrong = several(L.zero, 0)
    for at in range(0, size, WIDTH):
        miss = (
            (-5.0 / 72.0) * several(L.k1, at)
            + (1.0 / 12.0) * several(L.k2, at)
            + (1.0 / 9.0) * several(L.k3, at)
            - 0.125 * several(L.k4, at)
        )
        wrong = wrong + miss * miss
    wrong = wrong * h * h / (L.tolerance * L.tolerance) + 1e-20
    good = wrong <= 1.0
    moved = several(L.zero, 0)
    for at in range(0, size, WIDTH):
        here, there = several(L.q, at), several(L.next, at)
        moved = moved + (there - here) * (there - here)
        put(L.q, at, select(good, there, here))
        put(L.k1, at, select(good, several(L.k4, at), several(L.k1, at)))
    put(L.path, 0, several(L.path, 0) + select(good, sqrt(moved), 0.0))
    put(L.gone, 0, several(L.gone, 0) + select(good, h, 0.0))
    took = ninth * (2.0 * r1 + 3.0 * clock(L, e2, s2) + 4.0 * clock(L, e3, s3))
    if L.success > 0.0:
        _arrive(L, good, e4, took)
    put(L.time, 0, several(L.time, 0) + select(good, took, 0.0))
    put(L.rate, 0, select(good, clock(L, e4, s4), r1))
    put(L.error, 0, select(good, e4, several(L.error, 0)))
    put(L.speed, 0, select(good, s4, several(L.speed, 0)))
    put(L.regular, 0, select(good, regular, several(L.regular, 0)))
    # wrong is the square of the error: its power 5/32 is the error's power 0.31
    root = sqrt(sqrt(sqrt(wrong)))
    change = SAFETY / (root * sqrt(sqrt(root)))
    change = smaller(larger(change, SHRINKAGE), GROWTH)
    put(L.h, 0, smaller(h * change, LONGEST))


@jit
def _arrive(L: Any, good: Any, error: Any, took: Any) -> None:
    """When |e| fell below ``success``."""
    before, now = sqrt(several(L.error, 0)), sqrt(error)
    share = smaller(larger((before - L.success) / (before - now + TINY), 0.0), 1.0)
    arrived = several(L.arrived, 0)
    first = good & (now < L.success) & (arrived >= NEVER)
    put(L.arrived, 0, select(first, several(L.time, 0) + share * took, arrived))


@jit
def note(S: Any, L: Any, trace: Any, q: Any, stride: int, gone: float, time: float, error: float) -> None:
    """Put q, s, t and |e| of the one run that is followed on record, (rows, n + 3), where somebody asks.

    Where the record is full, every second row is dropped, and those that come are as far apart in s.
    """
    n, size = S.chain.n, len(trace)
    if size == 0 or (L.rows > 0 and not gone > trace[L.rows - 1, n] + L.spacing):
        return
    if L.rows == size:
        L.rows, L.spacing = size // 2, 2.0 * gone / size
        for k in range(L.rows):
            for i in range(n + 3):
                trace[k, i] = trace[2 * k, i]
    for i in range(n):
        trace[L.rows, i] = q[i * stride]
    trace[L.rows, n], trace[L.rows, n + 1], trace[L.rows, n + 2] = gone, time, math.sqrt(error)
    L.rows += 1
