"""The motion after a lock, eight runs at once: steps of orders 3 and 2, each run with its own length.

Source: Bogacki and Shampine 1989, the 3(2) pair.
"""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import any_of, larger, select, smaller, sqrt
from ftqp.kernel.maths.side_by_side import WIDTH, put, several
from ftqp.kernel.study.planar_arm import TINY, clock, field

STEPS = 4
"""Steps between two looks at whether a run has ended."""
LONGEST = 1.0
"""Of a step, in s: the fastest motion near rest has the rate 2."""
FIRST = 0.05
"""Length of the first step."""
SAFETY = 0.9
GROWTH, SHRINKAGE = 5.0, 0.2
"""Largest change of the length from step to step."""
NEVER = 1e300
"""A time that does not come."""


@jit
def begin(P: Any) -> None:
    """The field at the starts of runs that are fresh."""
    fresh = several(P.fresh, 0) > 0.5
    if not any_of(fresh):
        return
    error, det, size = field(P, P.q, P.free, P.k4)
    for at in range(0, len(P.q), WIDTH):
        put(P.k1, at, select(fresh, several(P.k4, at), several(P.k1, at)))
    put(P.error, 0, select(fresh, error, several(P.error, 0)))
    put(P.det, 0, select(fresh, det, several(P.det, 0)))
    put(P.speed, 0, select(fresh, size / (0.5 * det + size + TINY), several(P.speed, 0)))
    put(P.rate, 0, select(fresh, clock(P, error, det, size), several(P.rate, 0)))
    put(P.h, 0, select(fresh, FIRST, several(P.h, 0)))
    for array in (P.path, P.time, P.fresh):
        put(array, 0, select(fresh, 0.0, several(array, 0)))
    put(P.arrived, 0, select(fresh, NEVER, several(P.arrived, 0)))


@jit
def step(P: Any) -> None:
    """One trial step of every run; where its error is too large, the run stays and its step gets shorter.

    Times are integrated by the same formula. A run whose |e| falls below ``success`` is told when it did,
    by linear interpolation.
    """
    size = len(P.q)
    h, r1 = several(P.h, 0), several(P.rate, 0)
    for at in range(0, size, WIDTH):
        put(P.next, at, several(P.q, at) + 0.5 * h * several(P.k1, at))
    e2, d2, s2 = field(P, P.next, P.free, P.k2)
    for at in range(0, size, WIDTH):
        put(P.next, at, several(P.q, at) + 0.75 * h * several(P.k2, at))
    e3, d3, s3 = field(P, P.next, P.free, P.k3)
    ninth = h * (1.0 / 9.0)
    for at in range(0, size, WIDTH):
        move = 2.0 * several(P.k1, at) + 3.0 * several(P.k2, at) + 4.0 * several(P.k3, at)
        put(P.next, at, several(P.q, at) + ninth * move)
    e4, d4, s4 = field(P, P.next, P.free, P.k4)
    wrong = several(P.zero, 0)
    for at in range(0, size, WIDTH):
        miss = (
            (-5.0 / 72.0) * several(P.k1, at)
            + (1.0 / 12.0) * several(P.k2, at)
            + (1.0 / 9.0) * several(P.k3, at)
            - 0.125 * several(P.k4, at)
        )
        wrong = wrong + miss * miss
    wrong = wrong * h * h / (P.tolerance * P.tolerance) + 1e-20
    good = wrong <= 1.0
    moved = several(P.zero, 0)
    for at in range(0, size, WIDTH):
        here, there = several(P.q, at), several(P.next, at)
        moved = moved + (there - here) * (there - here)
        put(P.q, at, select(good, there, here))
        put(P.k1, at, select(good, several(P.k4, at), several(P.k1, at)))
    put(P.path, 0, several(P.path, 0) + select(good, sqrt(moved), 0.0))
    r4 = clock(P, e4, d4, s4)
    took = ninth * (2.0 * r1 + 3.0 * clock(P, e2, d2, s2) + 4.0 * clock(P, e3, d3, s3))
    if P.success > 0.0:
        _arrive(P, good, e4, took)
    put(P.time, 0, several(P.time, 0) + select(good, took, 0.0))
    put(P.rate, 0, select(good, r4, r1))
    put(P.error, 0, select(good, e4, several(P.error, 0)))
    put(P.det, 0, select(good, d4, several(P.det, 0)))
    put(P.speed, 0, select(good, s4 / (0.5 * d4 + s4 + TINY), several(P.speed, 0)))
    # wrong is the square of the error: its power 5/32 is the error's power 0.31
    root = sqrt(sqrt(sqrt(wrong)))
    change = SAFETY / (root * sqrt(sqrt(root)))
    change = smaller(larger(change, SHRINKAGE), GROWTH)
    put(P.h, 0, smaller(h * change, LONGEST))


@jit
def _arrive(P: Any, good: Any, error: Any, took: Any) -> None:
    """When |e| fell below ``success``."""
    before, now = sqrt(several(P.error, 0)), sqrt(error)
    share = smaller(larger((before - P.success) / (before - now + TINY), 0.0), 1.0)
    arrived = several(P.arrived, 0)
    first = good & (now < P.success) & (arrived >= NEVER)
    put(P.arrived, 0, select(first, several(P.time, 0) + share * took, arrived))
