"""Joints that do not move though they should: slope and curvature of their last samples."""

from math import sqrt
from typing import Any

from ftqp.kernel.detection.suspicion import step_back
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.detection_room import SLOW, WINDOW
from ftqp.kernel.layout.enums import ERROR_RESIDUAL
from ftqp.kernel.layout.thresholds import LEAST_SPEED
from ftqp.kernel.maths.elementary import select
from ftqp.kernel.maths.side_by_side import WIDTH, put, several

FEWEST, LONG, BRIEF = 16, 44, 8
"""Samples of the windows: the shortest and the longest for a joint that stands, and that of its speed."""
SLOPE_SIGMAS, STILL_SHARE = 5.0, 0.2
"""A joint stands whose slope is within so many standard deviations of noise, or below this share of the
reference's speed ..."""
BEND_SIGMAS = 3.0
"""... and whose curvature is within so many. By these the shortest window follows from the noise
(docs/theory/detection.md, "Standstill"); all three are guesses that `python studies/detection.py` has not
contradicted."""
BEND_SHARE = 0.5
"""The window is so long that this noise is below this share of what would have stopped the joint. A
convention, because a bend of half the size must already show."""
LEAST_CHANGE, TAKEN_UP = 0.05, 0.5
"""The least change of the asked speed [rad/s or m/s] that shows whether a joint follows, and the share of it
that one which follows late has taken up."""
AS_LATE = 0.2
"""A joint without torque that goes on at the speed that it had is farther behind a command that changes its
own; within this share of the time that is looked at it is not."""
OBEYS = 0.5
"""A joint whose speed is within this share of its reference's goes along with it ..."""
FOLLOWED = 0.01
"""... if that is faster than this [rad/s or m/s], ten standard deviations of an observed speed where encoders
have 1e-4 rad at 1 kHz."""
HELD_BY_FRICTION = 3.0
"""Dry friction may hold a joint that stood until its reference has gone away by so many thresholds of the
position, of 6.2 mrad where nothing is known: an iiwa14 stood for 15 in good health."""
LEAD = 5
"""Ticks from a failure to the suspicion."""
FINEST = 1e-6
"""Noise below this [rad or m] counts as this. So that windows have a length without noise, too."""


@jit
def _fit(D: Any, i: int, first: int, count: int) -> tuple[float, float]:
    """Slope and curvature of the samples first ... first + count - 1 ticks ago, by least squares."""
    middle = 0.5 * (count - 1)
    square = (count * count - 1.0) / 12.0
    fourth = count * (count * count - 1.0) * (count * count - 4.0) / 180.0
    origin = D.kept[step_back(D, first), i]
    first_moment = second_moment = 0.0
    for k in range(count):
        x = D.kept[step_back(D, first + k), i] - origin
        t = middle - k
        first_moment += t * x
        second_moment += (t * t - square) * x
    slope = first_moment / (count * square * D.dt)
    return slope, 2.0 * second_moment / (fourth * D.dt * D.dt)


@jit
def speed_of(D: Any, i: int) -> float:
    """The slope of the last eight samples of joint i, which unlike an observer does not overshoot."""
    return _fit(D, i, 0, BRIEF)[0]


@jit
def _noise(D: Any) -> float:
    """Standard deviation of a sample, its rounding included."""
    return max(sqrt(D.sigma * D.sigma + D.quantum * D.quantum / 12.0), FINEST)


@jit
def _noise_of_bend(D: Any, count: int) -> float:
    """Standard deviation of the curvature of white noise: sigma sqrt(720/n)/(n dt)^2."""
    return _noise(D) * sqrt(720.0 / count) / ((count * D.dt) * (count * D.dt))


@jit
def _noise_of_slope(D: Any, count: int) -> float:
    """Standard deviation of the slope of white noise: sigma sqrt(12/n)/(n dt)."""
    return _noise(D) * sqrt(12.0 / count) / (count * D.dt)


@jit
def _asked_to_move(D: Any, i: int, count: int) -> float:
    """The least speed of the reference over the last samples, 0 where it turns round."""
    least = abs(D.kept_v[step_back(D, 0), i])
    sign = D.kept_v[step_back(D, 0), i]
    for k in range(1, count):
        v = D.kept_v[step_back(D, k), i]
        if v * sign <= 0.0:
            return 0.0
        least = min(least, abs(v))
    return least


@jit
def takes_up_speed(D: Any, i: int) -> bool:
    """Whether joint i speeds up, or slows down, with its command, be it late: a motor does that.

    Its speed is one that its command has had over the samples that are kept, and has changed by more than
    half as much. A joint without torque moves on as fast as it was, or falls as its command does not.
    """
    if D.ticks <= WINDOW:
        return False
    low = high = D.kept_v[step_back(D, 0), i]
    for k in range(1, WINDOW):
        v = D.kept_v[step_back(D, k), i]
        low, high = min(low, v), max(high, v)
    v = speed_of(D, i)
    if high - low < LEAST_CHANGE or v < low or v > high:
        return False
    return abs(v - _fit(D, i, WINDOW - 1 - BRIEF, BRIEF)[0]) > TAKEN_UP * (high - low)


@jit
def _behind(D: Any, i: int, ago: int) -> float:
    """How many ticks joint i was behind its command so many ticks ago, or -1 where it never was there."""
    q = D.kept[step_back(D, ago), i]
    off = D.kept_e[step_back(D, ago), i]
    for k in range(1, WINDOW - ago):
        s = step_back(D, ago + k)
        before = q - (D.kept[s, i] - D.kept_e[s, i])
        if before * off <= 0.0:
            return k - (before / (before - off) if before != off else 0.0)
        off = before
    return -1.0


@jit
def follows_late(D: Any, i: int) -> bool:
    """Whether joint i goes where its command has gone before, as far behind it as it was: a motor does that.

    Of one that was behind all that is kept of its command nothing else can be said. It is asked where another
    joint has failed before.

    Source: docs/theory/detection.md, "Lost torque".
    """
    if D.ticks <= WINDOW:
        return False
    now, then = _behind(D, i, 0), _behind(D, i, FEWEST)
    if then < 0.0:
        return D.kept_e[step_back(D, FEWEST), i] * D.kept_v[step_back(D, FEWEST), i] < 0.0
    return now > 0.0 and abs(now - then) < AS_LATE * FEWEST


@jit
def is_slow(D: Any, i: int) -> bool:
    """Whether joint i may be about to stand: nothing else is said of it then."""
    asked = abs(D.kept_v[step_back(D, 0), i])
    slow = max(SLOPE_SIGMAS * _noise_of_slope(D, FEWEST), STILL_SHARE * asked)
    return asked > LEAST_SPEED and abs(_fit(D, i, 0, FEWEST)[0]) < slow


@jit
def follow_motion(D: Any, then: int) -> None:
    """``went``: how far each joint has gone along with its reference; ``gone``: how far that has gone away.

    Both begin anew when the reference turns round; ``went`` also where the joint stops before it is a
    threshold of the position, ``gone`` once it is one, and where the reference comes nearer.
    Source: docs/theory/detection.md, "Standstill".
    """
    for at in range(0, D.n, WIDTH):
        v, w, room = several(D.past_v[then], at), several(D.w[SLOW], at), several(D.room[ERROR_RESIDUAL], at)
        went, gone, way = several(D.went, at), several(D.gone, at), D.dt * v
        along = (abs(w) < OBEYS * abs(v)) & (abs(v) > FOLLOWED)
        went = select(went * v < 0.0, 0.0, went)
        went = select(along, went + way, select(abs(went) < room, 0.0, went))
        gone = select(gone * v < 0.0, 0.0, gone) + way
        leaves = (several(D.e, at) * v < 0.0) & ~(along & (abs(went) >= room))
        put(D.went, at, went)
        put(D.gone, at, select(leaves, gone, 0.0))


@jit
def _is_left_behind(D: Any, i: int) -> bool:
    """Whether the reference has gone away from joint i, which stands, farther than friction explains.

    Where its torque is known that says more.
    """
    left: bool = abs(D.gone[i]) >= HELD_BY_FRICTION * D.room[ERROR_RESIDUAL, i]
    return D.has_effort == 0 and left


@jit
def friction_may_hold(D: Any, i: int) -> bool:
    """Whether dry friction that nobody knows of may be why joint i stands.

    It holds a joint that stood when its reference turned round, and stops none that goes along with it.
    Source: docs/theory/detection.md, "Standstill".
    """
    went: bool = abs(D.went[i]) >= D.room[ERROR_RESIDUAL, i]
    return D.told_coulomb[i] < 0.0 and not went and not _is_left_behind(D, i)


@jit
def stands(D: Any, i: int, least: int) -> bool:
    """Whether joint i stands though its reference moves with v: slope and curvature of n samples are nil.

    Where that has left it behind it need not move any more, as a path waits for a joint that does not come.

    A joint that is thrown back stands for a moment, too, but bends by v/T, with T the time since it was
    suspected. n is the least that shows half of that, n^(5/2) = 6 sqrt(720) sigma T/(v dt^2), but not below
    ``least``.
    Source: docs/theory/detection.md, "Standstill".
    """
    asked = _asked_to_move(D, i, FEWEST)
    if _is_left_behind(D, i):
        asked = max(asked, LEAST_SPEED)
    if asked < LEAST_SPEED or D.ticks <= LONG:
        return False
    since = max(D.watch + LEAD, FEWEST)
    wanted = (BEND_SIGMAS / BEND_SHARE * sqrt(720.0) * _noise(D) * since / (asked * D.dt)) ** 0.4
    count = min(max(int(wanted) + 1, least), LONG)
    slope, bend = _fit(D, i, 0, count)
    if abs(bend) > BEND_SIGMAS * _noise_of_bend(D, count):
        return False
    return abs(slope) <= max(SLOPE_SIGMAS * _noise_of_slope(D, count), STILL_SHARE * asked)
