"""The fastest motion of joints to rest at a place, within limits of speed, acceleration and jerk.

A change from speed v and acceleration a to a speed w is fastest with jerks +-J, 0, -+J. A motion to rest is
such a change, a while at w, and a change to 0. It is fastest without a while at w, or with w at its limit;
how far it goes rises with w, and with a while at w it takes the longer the lower w is. So w is found by
bisection, and joints arrive together. Joints whose states lie along their ways share one time law, and the
motion is straight. A joint has eight parts: one back into its limit of acceleration, three, one at constant
speed, and three. From one state of a hundred two changes of the same sign would be sooner, by up to 0.1 s.
Source: Berscheid and Kroeger 2021, whose step 1 and step 2 are wider: there motions end at any speed.
"""

from typing import Any

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.maths.elementary import sqrt

PARTS = 8
"""Parts of the motion of a joint."""
MEETS = 1e-9
"""A motion that ends so near to its place ends there [rad or m]. Rounding."""
HALVINGS = 100
"""So often an interval is halved at most, and rounding ends that sooner."""


@jit
def _change(times: Any, jerks: Any, at: int, v: float, a: float, w: float, a_max: float, jerk: float) -> None:
    """Three parts from speed v and acceleration |a| <= a_max to w, where the acceleration is zero."""
    sign = 1.0 if w >= v + 0.5 * a * abs(a) / jerk else -1.0
    own, rise, flat = sign * a, sign * (w - v), 0.0
    peak = sqrt(max(jerk * rise + 0.5 * own * own, 0.0))
    if peak > a_max:
        peak, flat = a_max, max((rise - (a_max * a_max - 0.5 * own * own) / jerk) / a_max, 0.0)
    times[at], jerks[at] = max(peak - own, 0.0) / jerk, sign * jerk
    times[at + 1], jerks[at + 1] = flat, 0.0
    times[at + 2], jerks[at + 2] = peak / jerk, -sign * jerk


@jit
def state_after(times: Any, jerks: Any, t: float, v: float, a: float) -> tuple[float, float, float]:
    """How far a motion that has begun at (v, a) has come so long after, its speed and its acceleration."""
    q = 0.0
    for k in range(PARTS):
        h, j = min(times[k], t), jerks[k]
        q += h * (v + h * (0.5 * a + h * j / 6.0))
        v += h * (a + 0.5 * h * j)
        a += h * j
        t -= h
    return q, v, a


@jit
def duration_of(times: Any) -> float:
    """How long the motion of a joint takes [s]."""
    total = 0.0
    for k in range(PARTS):
        total += times[k]
    return total


@jit
def _way(times: Any, jerks: Any, v: float, a: float, w: float, a_max: float, jerk: float) -> float:
    """How far a joint goes to rest by way of the speed w, without a while at it; its parts."""
    times[0] = jerks[0] = times[4] = jerks[4] = 0.0
    if abs(a) > a_max:
        jerks[0] = -jerk if a > 0.0 else jerk
        times[0] = (abs(a) - a_max) / jerk
    h = times[0]
    _change(times, jerks, 1, v + h * (a + 0.5 * h * jerks[0]), a + h * jerks[0], w, a_max, jerk)
    _change(times, jerks, 5, w, 0.0, 0.0, a_max, jerk)
    return state_after(times, jerks, duration_of(times), v, a)[0]


@jit
def brake(times: Any, jerks: Any, v: float, a: float, a_max: float, jerk: float) -> float:
    """Come to rest soonest: how far that is."""
    return _way(times, jerks, v, a, 0.0, a_max, jerk)


@rare_jit
def fastest(
    times: Any, jerks: Any, way: float, v: float, a: float, v_max: float, a_max: float, jerk: float
) -> float:
    """Go so far as fast as can be: the speed on the way, below zero backwards."""
    stop = _way(times, jerks, v, a, 0.0, a_max, jerk)
    sign = 1.0 if way >= stop else -1.0
    top = _way(times, jerks, v, a, sign * v_max, a_max, jerk)
    if sign * (way - top) >= 0.0:
        times[4] = (way - top) / (sign * v_max)
        return sign * v_max
    low, high = 0.0, v_max
    for _ in range(HALVINGS):
        w = 0.5 * (low + high)
        if w in (low, high):
            break
        if sign * (way - _way(times, jerks, v, a, sign * w, a_max, jerk)) >= 0.0:
            low = w
        else:
            high = w
    _way(times, jerks, v, a, sign * low, a_max, jerk)
    return sign * low


@jit
def _way_in(
    times: Any, jerks: Any, v: float, a: float, w: float, v_end: float, a_end: float, a_max: float,
    jerk: float, T: float,
) -> float:  # fmt: skip
    """How far a joint goes in a time of T by way of the speed w to another state; its parts.

    What leads from w to that state is what leads from there to w, backwards.
    """
    times[0] = jerks[0] = jerks[4] = 0.0
    _change(times, jerks, 1, v, a, w, a_max, jerk)
    _change(times, jerks, 5, v_end, -a_end, w, a_max, jerk)
    times[5], times[7], jerks[5], jerks[7] = times[7], times[5], jerks[7], jerks[5]
    times[4] = 0.0
    times[4] = T - duration_of(times)
    return state_after(times, jerks, T, v, a)[0]


@rare_jit
def between(
    times: Any, jerks: Any, way: float, v: float, a: float, v_end: float, a_end: float, v_max: float,
    a_max: float, jerk: float, T: float,
) -> bool:  # fmt: skip
    """Go so far in a time of T [s] from one speed and acceleration to others: whether that can be done.

    The farther the higher w is, as far as there is time for w; most of it is left between both speeds.
    """
    low, high = -v_max, v_max
    soonest = 0.5 * (v + v_end) + 0.25 * (a * abs(a) - a_end * abs(a_end)) / jerk
    for _ in range(HALVINGS):
        w = 0.5 * (low + high)
        if w in (low, high):
            break
        gone = _way_in(times, jerks, v, a, w, v_end, a_end, a_max, jerk, T)
        if gone <= way if times[4] >= 0.0 else w < soonest:
            low = w
        else:
            high = w
    gone = _way_in(times, jerks, v, a, 0.5 * (low + high), v_end, a_end, a_max, jerk, T)
    return bool(times[4] >= 0.0 and max(abs(a), abs(a_end)) <= a_max and abs(gone - way) <= MEETS)


@rare_jit
def slower(
    times: Any, jerks: Any, way: float, v: float, a: float, w: float, a_max: float, jerk: float, T: float
) -> None:
    """The same in a time of T [s], where the fastest takes less by way of w; where it goes nowhere, none."""
    low, high = 0.0, w
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        times[4] = max((way - _way(times, jerks, v, a, middle, a_max, jerk)) / middle, 0.0)
        if duration_of(times) > T:
            low = middle
        else:
            high = middle
    left = way - _way(times, jerks, v, a, high, a_max, jerk)
    times[4] = max(left / high, 0.0) if high != 0.0 else 0.0
