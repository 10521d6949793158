"""How much later a torque arm's samples come than was stated, learned where it shakes; how stiff its loop is.

A loop that does not know its delay is too stiff for it, and takes every motion for a following error. The
torque that led to a sample was then sent a time delta earlier than is supposed, so that the equation of each
joint misses

    y = delta dtau/dt,

in which delta is the same for all joints: one more unknown, by least squares. It is looked for only in what
shakes, because there y is large and nothing else that the model lacks has the phase of dtau/dt.
An arm that shakes to and fro although no delay explains it rings: its gears give way, its encoders are
coarse, or its rotors are light. Its loop is then softened, before anybody is accused.
Source: docs/theory/feedback.md, "Samples that come later than stated".
"""

from math import floor, sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.feedback_rooms import LATER, POLES, SOFTER
from ftqp.kernel.layout.thresholds import LEAST_SHIFT, STANDS

SLOWLY = 0.2
"""Share of the difference by which the slow means follow at each estimate: what changes within 25 ms is
looked at, and not what a motion asks for."""
SHAKES, BY_NOISE = 2.0, 20.0
"""A joint shows something where its acceleration is farther than this from its slow mean [rad/s2 or m/s2],
and so many times what noise alone makes of it: noise goes through the loop into the torques, too, and would
look like a delay of 1/(2 w). Chosen by `ftqp campaign wrong-model`."""
ADOPTED = 0.75
"""Another delay counts once it is so many ticks from the one that does: beyond a half, so that
it does not go to and fro."""
STAYS = 1.0
"""Information of staying with the delay that counts [1/ticks2]: it is known to about a tick."""
MOST_KNOWN = 100.0
"""Information that is kept [1/ticks2]: a tenth of a tick is as well as it need be known, and one that changes
is then learned anew."""
EXPLAINS = 0.5
"""A delay is one that explains at least this share of what the equations miss, squared: what pushes or holds
an arm shakes it, too, and is no delay. By convention half, where it explains more than it leaves."""
KNOWN_AFTER = 50
"""So many estimates, a quarter of a second, tell what the model lacks from a delay, and from a motor that
fails."""
RINGS = 6.0
"""A joint rings that swings to and fro so many times lately, of which it forgets e times within as many
estimates as those: at 12 Hz and more, twice the bandwidth of the loop, which follows nothing so fast."""
QUIET = 2 * KNOWN_AFTER
"""So many in a row, in which the arm moves and nothing shakes, say that the delay is right."""
SETTLES = 2 * POLES
"""So many estimates after a change the filters hold torques of both delays."""


@jit
def forget_delay(K: Any) -> None:
    """Samples come when it was stated."""
    learned = K.learned
    _set_loop(K, 0, 0)
    learned.until_later = learned.quiet = learned.shook = 0
    learned.delay_known = learned.delay_moment = learned.delay_missed = 0.0


@jit
def _set_loop(K: Any, later: int, softer: int) -> None:
    """Samples come so many ticks later than stated, and the loop was softened so often."""
    learned, feedback = K.learned, K.feedback
    for i in range(K.chain.n):
        learned.swings[i] = learned.swung[i] = 0.0
    if later == learned.later and softer == learned.softer:
        return
    feedback.latency += later - learned.later
    learned.later, learned.softer = later, softer
    paces = learned.paces[softer, later]
    feedback.stiffness, feedback.pole, feedback.kappa = paces[0], paces[1], paces[2]
    feedback.missing_noise, learned.gain = paces[3], paces[4]


@jit
def hear_delay(K: Any, i: int, off: float, weight: float) -> None:
    """The equation of joint i misses ``off``, which counts ``weight``: what that says of the delay."""
    learned = K.learned
    y, a = off - learned.off_mean[i], learned.a[i] - learned.a_mean[i]
    x = (learned.slope[i] - learned.slope_mean[i]) * K.state.dt
    learned.off_mean[i] += SLOWLY * y
    learned.a_mean[i] += SLOWLY * a
    learned.slope_mean[i] += SLOWLY * (learned.slope[i] - learned.slope_mean[i])
    learned.swings[i] -= learned.swings[i] / KNOWN_AFTER
    shakes = max(SHAKES, BY_NOISE * learned.felt * sqrt(learned.noise[i]))
    if learned.until_later > 0 or weight <= 0.0 or abs(a) < shakes:
        return
    if a * learned.swung[i] <= 0.0:
        learned.swings[i] += 1.0
        learned.swung[i] = a
    if learned.estimates < KNOWN_AFTER:
        return
    learned.shook = 1
    far = max(abs(y) - 2.0 * LATER * abs(x), 0.0)
    if weight * far * far < LEAST_SHIFT * LEAST_SHIFT:
        learned.delay_known += weight * x * x
        learned.delay_moment += weight * x * y
        learned.delay_missed += weight * y * y


@jit
def _is_believed(K: Any) -> bool:
    """Whether the arm has moved for a while and nothing shook: the delay that counts is right, and stays.

    What shakes later is pushed, or held, or a fault; unless it goes on for as long. ``quiet`` is above
    ``QUIET`` while the delay is believed.
    """
    learned, state = K.learned, K.state
    shook, moves = learned.shook, False
    for i in range(K.chain.n):
        moves = moves or abs(state.v_command[i]) > STANDS * K.limits.v_max[i]
    learned.shook = 0
    if learned.quiet <= QUIET:
        learned.quiet = 0 if shook else learned.quiet + int(moves)
        if learned.quiet < QUIET:
            return False
        learned.quiet = 2 * QUIET
    learned.quiet = learned.quiet - 1 if shook else min(learned.quiet + 1, 2 * QUIET)
    learned.delay_known = learned.delay_moment = learned.delay_missed = 0.0
    if learned.quiet <= QUIET:
        learned.quiet = 0
    return True


@jit
def _soften(K: Any) -> None:
    """The loop becomes softer where a joint rings."""
    learned = K.learned
    for i in range(K.chain.n):
        if learned.swings[i] > RINGS and learned.softer < SOFTER:
            _set_loop(K, learned.later, learned.softer + 1)


@jit
def follow_delay(K: Any) -> None:
    """Another number of ticks counts once it is likely; what shakes before the rotors are known is theirs.

    What more than ``LATER`` of them would have to explain, or what no delay does, rings; and a loop that was
    softened for it has room for a delay.
    """
    learned = K.learned
    if learned.estimates < KNOWN_AFTER or learned.softer > 0 or _is_believed(K):
        _soften(K)
        return
    if learned.until_later > 0:
        learned.until_later -= 1
        return
    if learned.delay_known > MOST_KNOWN:
        less = MOST_KNOWN / learned.delay_known
        learned.delay_moment *= less
        learned.delay_missed *= less
        learned.delay_known = MOST_KNOWN
    left = learned.delay_moment / (STAYS + learned.delay_known)
    likely = min(max(learned.later + floor(left + 0.5), 0), LATER)
    while learned.paces[0, likely, 0] <= 0.0:  # so late a sample is beyond what is kept of the past
        likely -= 1
    change = likely - learned.later
    moment, known = learned.delay_moment, learned.delay_known
    if moment * moment < EXPLAINS * learned.delay_missed * known or abs(moment) > LATER * known:
        _soften(K)
        return
    if abs(left) > ADOPTED and change != 0:
        learned.delay_missed += change * (change * learned.delay_known - 2.0 * learned.delay_moment)
        learned.delay_moment -= change * learned.delay_known
        learned.until_later = SETTLES
        _set_loop(K, likely, learned.softer)
