"""What is wrong with a joint: one verdict a tick of suspicion, a set of kinds as a number."""

from typing import Any

from ftqp.kernel.detection.culprit import culprit
from ftqp.kernel.detection.encoders import cannot_tell_frozen
from ftqp.kernel.detection.standing import speed_of, stands
from ftqp.kernel.detection.torque_share import fit_share
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.detection_room import FAST, SLOW
from ftqp.kernel.layout.enums import (
    IS_DEGRADED,
    IS_FREE,
    IS_FROZEN,
    IS_LOCKED,
    IS_RUNAWAY,
    TORQUE_SLOW,
)

HELD = 0.02
"""A torque below this [N m or N] beside twice the friction holds no joint that could not rest without."""
BEYOND = 0.15
"""A runaway joint is so much faster than its reference, or against it [rad/s or m/s] ..."""
PUSHED = 0.45
"""... while its motion takes this share of its largest torque."""
FULL = 0.85
"""A motor that gives this share of its largest torque unasked runs away."""
NOTHING_LEFT = 0.27
"""A share of the torque below this is none."""
LEAST_SHARE, MOST_SHARE = -0.6, 1.4
"""Shares beyond these are no lost torque."""
UNTOUCHED = 0.85
"""A share above this is healthy."""
PARALLEL = 0.8
"""A joint that stands is the culprit if it explains this share of what the best one explains."""
FAINT = 2.0
"""A demand below so many rooms of its residual does not show its share."""


@jit
def _implied(D: Any, K: Any, i: int, bank: int, then: int) -> float:
    """(M (a_r + d) + h)_i: the torque that the motion of joint i takes."""
    total: float = K.kinematics.h[i]
    for j in range(D.n):
        total += K.kinematics.M[i, j] * (D.past_a[then, j] + D.d[bank, j])
    return total


@jit
def _runs_away(D: Any, K: Any, i: int, then: int) -> bool:
    """Whether joint i goes where nobody sent it with nearly all its torque."""
    if D.has_motor and abs(D.tau[i]) > FULL * D.tau_max[i]:
        asked = D.motor_torque[i]
        if asked * D.tau[i] < 0.0 or abs(asked) < FULL * FULL * D.tau_max[i]:
            return True
    v_ref, v = D.past_v[then, i], speed_of(D, i)
    against = v * v_ref < 0.0 and abs(v) > BEYOND
    beyond = v * v_ref >= 0.0 and abs(v) > abs(v_ref) + BEYOND
    if not (against or beyond):
        return False
    implied = _implied(D, K, i, FAST, then)
    return abs(implied) > PUSHED * D.tau_max[i] and implied * (v - v_ref) > 0.0


@jit
def _held(D: Any, K: Any, i: int, then: int) -> int:
    """Joint i stands: locked, or without torque and held by friction, or its sensor is frozen."""
    load = abs(_implied(D, K, i, SLOW, then) - K.kinematics.M[i, i] * (D.past_a[then, i] + D.d[SLOW, i]))
    kinds = IS_LOCKED
    if load < 2.0 * D.coulomb[i] + HELD:
        kinds += IS_FREE
    if cannot_tell_frozen(D, i):
        kinds += IS_FROZEN
    return kinds


@jit
def _lost_torque(D: Any, K: Any, i: int, then: int) -> int:
    """Whether joint i gives less torque than it should, and how much is left; 0 where this is not it."""
    fit_share(D, K, i, then)
    if D.watch < D.patience:
        return 0
    share = D.fit_share
    if not LEAST_SHARE < share < UNTOUCHED:
        return 0
    room = D.room[TORQUE_SLOW, i] if D.has_effort and D.ticks > D.warm else HELD
    if abs(D.fit_size) < FAINT * room + D.coulomb[i]:
        return IS_FREE + IS_DEGRADED
    return IS_FREE if share < NOTHING_LEFT else IS_DEGRADED


@jit
def tell_apart(D: Any, K: Any, then: int) -> tuple[int, int]:
    """The joint and the set of kinds that this tick speaks for; -1 and 0 where it speaks for none.

    A joint that stands goes first, then one that runs away, then lost torque.
    Source: docs/theory/detection.md, "Kinds".
    """
    joint = culprit(D, K)
    standing, most = -1, 0.0
    for i in range(D.n):
        D.standing[i] = 0
        if not D.blind[i] and D.z[i] > 1.0 and D.score[i] > PARALLEL * D.score[joint] and stands(D, i):
            D.standing[i] = 1
            if D.score[i] > most:
                standing, most = i, D.score[i]
    D.suspect = joint
    if standing >= 0:
        D.suspect = standing
        return standing, _held(D, K, standing, then)
    if joint < 0:
        return -1, 0
    if _runs_away(D, K, joint, then):
        return joint, IS_RUNAWAY
    return joint, _lost_torque(D, K, joint, then)
