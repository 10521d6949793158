"""Raw samples of encoders: which are dropped, frozen or biased, and which merely a glitch."""

from typing import Any

from ftqp.kernel.arm.kinematics import mimic_places
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import IS_BIASED, IS_DROPPED, IS_FROZEN
from ftqp.kernel.layout.hypotheses import BIASED_AFTER, DROPPED_AFTER, FROZEN_SAMPLES, WILD_AFTER
from ftqp.kernel.layout.thresholds import FROZEN_SIGMAS
from ftqp.kernel.maths.elementary import is_finite

ALIKE = 0.5
"""Offsets that differ by less than this share of the first one are the same."""


@jit
def _off(D: Any, i: int, sample: float, expected: float) -> bool:
    """Whether a sample that jumped is refused; as motion that grows it is taken."""
    hop = sample - expected
    alike = abs(hop - D.hop[i]) <= ALIKE * abs(D.hop[i])
    if D.off[i] > 0 and not alike and hop * D.hop[i] > 0.0 and abs(hop) > abs(D.hop[i]):
        return False
    D.off[i] += 1
    if D.off[i] == 1 or not alike:
        D.hop[i] = hop
        D.same[i] = 0
        D.turns[i] = 0
    D.turns[i] += 1
    return True


@jit
def _sensor_of(D: Any, i: int) -> int:
    """What the counts of joint i say of its sensor."""
    if D.missing[i] >= DROPPED_AFTER:
        return IS_DROPPED
    if D.turns[i] >= BIASED_AFTER or D.off[i] >= WILD_AFTER:
        return IS_BIASED
    if D.same[i] >= FROZEN_SAMPLES - 1 and D.sigma > 0.0 and D.quantum == 0.0:
        return IS_FROZEN
    return 0


@jit
def cannot_tell_frozen(D: Any, i: int) -> bool:
    """Whether joint i has repeated its number for so long that a frozen sensor is as likely as a brake.

    Where numbers come in steps that exceed the noise, a joint that stands repeats its number, too.
    """
    if D.sigma > 0.0 and D.quantum == 0.0:
        return False
    return D.same[i] >= FROZEN_SAMPLES - 1 and D.travel[i] > FROZEN_SIGMAS * D.sigma + 2.0 * D.quantum


@jit
def read_encoders(D: Any, K: Any, then: int) -> int:
    """Samples into ``seen`` and their distance from the reference into ``e``: how many sensors are lost now.

    A sample is expected where the last step leads, q_(k-1) + (q_(k-1) - q_(k-2)). One that is no number, or
    off by more than ``jump``, is replaced by what is expected. A joint that mimics another is where that has
    it.
    Source: docs/theory/detection.md, "Sensors".
    """
    news = 0
    for i in range(D.n):
        sample, expected = D.q[i], D.good[i] + D.step[i]
        refused, moved, doubted = True, 0.0, D.off[i] > 0
        if not is_finite(sample):
            D.missing[i] += 1
        else:
            D.missing[i] = 0
            if K.chain.continuous[i] and abs(sample - expected) > 3.0:
                turns = (sample - expected) / 6.283185307179586
                sample -= 6.283185307179586 * float(int(turns + (0.5 if turns > 0.0 else -0.5)))
            moved = sample - D.raw[i]
            if sample == D.raw[i]:
                D.same[i] += 1
                D.travel[i] += D.dt * abs(D.past_v[then, i])
            else:
                D.same[i] = 0
                D.travel[i] = 0.0
                D.raw[i] = sample
            if D.ticks > 1 and abs(sample - expected) > D.jump[i]:
                refused = _off(D, i, sample, expected)
            else:
                refused = False
        if refused:
            D.good[i] = expected
        else:
            D.off[i] = D.turns[i] = 0
            step = sample - D.good[i]
            if doubted and abs(moved) < abs(step):
                step = moved  # ``good`` was only what was expected of samples that were refused
            D.step[i] = step if D.ticks > 0 else 0.0
            D.good[i] = sample
        D.seen[i] = D.good[i]
        D.e[i] = D.good[i] - D.past_q[then, i]
        if D.sensor[i] == 0 and D.believed[i] == 0:
            D.sensor[i] = _sensor_of(D, i)
            if D.sensor[i] != 0:
                D.blind[i] = 1
                news += 1
        if D.blind[i]:
            D.e[i] = 0.0
            D.seen[i] = D.past_q[then, i]
    if K.chain.mimics:
        mimic_places(K.chain, D.seen)
    return news
