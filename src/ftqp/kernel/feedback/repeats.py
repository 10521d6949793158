"""Samples that repeat themselves although the joint should move: a frozen encoder, or a joint that stands.

What is normal is learned: the smallest step between two samples, how far the reference goes while a working
encoder repeats its number, and by the noise of the samples how rarely it does.
"""

from math import ceil, e
from typing import Any

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import FROZEN, LOOKED_THROUGH, POSITION_DRIVE, TORQUE_DRIVE
from ftqp.kernel.layout.hypotheses import FROZEN_SAMPLES, HELD_SAMPLES
from ftqp.kernel.layout.thresholds import BAND_TIME, COARSEST, ERROR_BAND
from ftqp.kernel.maths.elementary import any_of, is_finite, larger, select, smaller
from ftqp.kernel.maths.side_by_side import WIDTH, load_lanes, store_lanes
from ftqp.kernel.monitor.verdicts import MOVES

NORMAL = 2.0
"""A number that repeats while the reference goes so many times as far as it normally does is odd ..."""
LEAST = 1e-6
"""... and by this [rad or m] more, finer than encoders, so that rounding of a joint that rests is not."""
GOES_ALONG = 0.25
"""An odd number is looked through, lest feedback drive the joint away, if the reference is so fast that it
shows, as a slower joint is driven away slowly, and the joint was seen to go along, with this share of that
speed: one that sticks needs its feedback to come loose; ..."""
SUDDEN = 0.01
"""... and within this time [s] of its first repeat, because a joint that sticks while the reference turns
round has stood for longer when that is fast again."""
STICKS = 20.0
"""A number that is looked through counts as frozen when the reference is so far away that the feedback of a
torque drive would ask for so much [rad/s2 or m/s2]; one whose joint was not seen to go along may be that of a
joint that dry friction holds ..."""
BANDS = 3.0
"""... until it is so many times its error band away: a joint of 0.001 kg m2 with friction of 0.5 N m came
loose before."""
RAREST = 0.01
"""The least chance of a repeat that is believed, as a line may repeat a sample now and then."""
KNOWN_FOR = 200
"""So many samples tell their noise, to a twentieth: it is learned as the mean of so many. More repeats tell
no more, as what was learned before fades meanwhile."""
IN_DOUBT = 0.25
"""Of patience a sample costs this share where the joint may as well stand, so that a detector has 80 ms to
find a lock: four times what one took."""


@jit
def forget_repeats(feedback: Any, i: int, at: float) -> None:
    """Nothing is known of the encoder of joint i but that it should say where the joint is."""
    feedback.raw[i] = at
    feedback.same[i] = feedback.moved[i] = feedback.increment[i] = feedback.way[i] = 0.0
    feedback.grain[i] = 0.0
    feedback.restless[i] = feedback.held[i] = 0


@jit
def _normally(increment: Any, way: Any) -> Any:
    """How far the reference may go while a number repeats, before that is odd."""
    return NORMAL * larger(increment, way) + LEAST


@jit
def repeat_oddly(state: Any, feedback: Any, at: int, sample: Any, v: Any, noisy: bool) -> Any:
    """Which of the samples of the joints from ``at`` on repeat although the reference travelled on.

    They are compared with the last good ones, which are those of the last tick. Of ``noisy`` ones each that
    repeats counts.
    """
    equal = abs(sample - load_lanes(feedback.good, at)) <= 0.0
    moved = abs(load_lanes(feedback.moved, at) + state.dt * v)
    normal = _normally(load_lanes(feedback.increment, at), load_lanes(feedback.way, at))
    return equal & (moved > select(noisy, 0.0, normal))


@jit
def all_repeat_oddly(K: Any, then: int) -> bool:
    """Of an arm whose numbers all repeat: whether any joint's reference travelled on beyond what is normal.

    The steps of an encoder that has not changed its number yet may be as large as any.
    """
    feedback = K.feedback
    for at in range(0, K.chain.n, WIDTH):
        moved = abs(load_lanes(feedback.moved, at) + K.state.dt * load_lanes(K.past.v[then], at))
        increment = load_lanes(feedback.increment, at)
        step = select(increment > 0.0, increment, COARSEST)
        if any_of(moved > _normally(step, load_lanes(feedback.way, at))):
            return True
    return False


@jit
def _rare_enough(K: Any) -> float:
    """exp(-level): evidence is as that of the monitor."""
    enough = 1.0
    for _ in range(ceil(K.monitor.level)):  # a library asks no system for exp() and log()
        enough /= e
    return enough


@jit
def _after_repeats(K: Any, i: int, chances: float, enough: float) -> float:
    """``chances``, times that of joint i's number to have come as often again as it has.

    Samples that scatter by sigma and have the step d are alike at most d/sigma times.
    """
    chance = (K.feedback.increment[i] + LEAST) / max(K.held.sigma[i], LEAST)
    chance = min(max(chance, RAREST), 1.0)
    for _ in range(min(int(K.feedback.same[i]), KNOWN_FOR) + 1):
        chances *= chance
        if chances < enough or chance == 1.0:
            break
    return chances


@rare_jit
def no_arm_repeats_so(K: Any) -> bool:
    """Of an arm whose numbers all repeat: whether those of one that stands would not: the line fails."""
    chances, enough = 1.0, _rare_enough(K)
    for i in range(K.chain.n):
        chances = _after_repeats(K, i, chances, enough)
        if chances < enough:
            return True
    return False


@jit
def _repeats_by_chance(K: Any, i: int) -> bool:
    """Whether joint i's number may have come again as often as it has while its encoder works."""
    enough = _rare_enough(K)
    return _after_repeats(K, i, 1.0, enough) >= enough


@jit
def learn_block(state: Any, feedback: Any, at: int, sample: Any, v: Any) -> None:
    """What the samples of the joints from ``at`` on, of which none repeats oddly, tell of their encoders."""
    change, moved = sample - load_lanes(feedback.good, at), load_lanes(feedback.moved, at)
    increment, step = load_lanes(feedback.increment, at), abs(change)
    equal = step <= 0.0
    least = select(increment > 0.0, smaller(increment, step), step)
    store_lanes(feedback.moved, at, select(equal, moved + state.dt * v, 0.0))
    store_lanes(feedback.increment, at, select(equal, increment, least))
    store_lanes(
        feedback.way,
        at,
        select(equal, load_lanes(feedback.way, at), larger(load_lanes(feedback.way, at), abs(moved))),
    )
    store_lanes(feedback.same, at, select(equal, load_lanes(feedback.same, at) + 1.0, 0.0))


@jit
def _learn(state: Any, feedback: Any, i: int, sample: float, v: float) -> None:
    """The same of joint i, whose number may have repeated oddly: how far is not normal then."""
    if feedback.age[i] == 1:  # the last sample was good
        feedback.raw[i] = feedback.good[i]
    if sample == feedback.raw[i]:
        feedback.same[i] += 1.0
        feedback.moved[i] += state.dt * v
        return
    step = abs(sample - feedback.raw[i])
    if is_finite(step):
        feedback.increment[i] = min(step, feedback.increment[i]) if feedback.increment[i] > 0.0 else step
    if feedback.held[i] == 0:
        feedback.way[i] = max(feedback.way[i], abs(feedback.moved[i]))
    feedback.raw[i] = sample
    feedback.same[i] = feedback.moved[i] = 0.0
    feedback.restless[i] = feedback.held[i] = 0


@jit
def never_repeats(feedback: Any, i: int) -> bool:
    """Whether no encoder that works would repeat its number as that of joint i does."""
    return bool(feedback.restless[i])


@jit
def explain(feedback: Any, i: int) -> bool:
    """Joint i is said to have failed: whether that explains why its number seemed frozen."""
    explained: bool = feedback.held[i] == FROZEN
    feedback.held[i] = 0
    return explained


@jit
def look_at_repeats(K: Any, i: int, sample: float, v: float) -> None:
    """Finds out whether the number of joint i repeats oddly: ``held``, until the number changes.

    One that its noise would have changed by now is frozen. Else it is looked through, whatever feedback would
    do with it, at the second repeat, if the joint was seen to go along before; and of a torque drive frozen
    once the reference is far away, farther where friction may hold the joint. A servo on positions holds its
    joint by itself, and a velocity drive does without feedback: there a joint that may as well stand behind a
    brake is no frozen encoder.
    Source: docs/theory/feedback.md, "Samples".
    """
    state, feedback = K.state, K.feedback
    _learn(state, feedback, i, sample, v)
    same, kind = feedback.same[i], feedback.kind
    if same < HELD_SAMPLES or feedback.held[i] == FROZEN:
        return
    normal, far = _normally(feedback.increment[i], feedback.way[i]), abs(feedback.moved[i])
    if far <= normal:
        return
    if not _repeats_by_chance(K, i):
        feedback.restless[i], feedback.held[i] = 1, FROZEN
        return
    along = feedback.v_hat[i] * v > GOES_ALONG * v * v
    sudden = same * state.dt < SUDDEN + 0.5 * state.dt or same < HELD_SAMPLES + 0.5
    if sudden and abs(v) > MOVES and along and kind != POSITION_DRIVE:
        feedback.held[i] = LOOKED_THROUGH
    far_away = max(NORMAL * normal, STICKS / (feedback.stiffness * feedback.stiffness))
    if feedback.held[i] != LOOKED_THROUGH:
        far_away = max(far_away, BANDS * (ERROR_BAND + BAND_TIME * abs(v)))
    if kind == TORQUE_DRIVE and same >= FROZEN_SAMPLES and far > far_away:
        feedback.held[i] = FROZEN
