"""Fault isolation: what is wrong with which joint, one answer a tick of suspicion, kinds as a number."""

from math import exp
from typing import Any

from ftqp.kernel.detection.culprit import culprit
from ftqp.kernel.detection.encoders import cannot_tell_frozen
from ftqp.kernel.detection.standing import (
    FEWEST,
    LONG,
    follows_late,
    friction_may_hold,
    is_slow,
    speed_of,
    stands,
    takes_up_speed,
)
from ftqp.kernel.detection.torque_share import fit_share
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.detection_room import BANKS, FAST, SLOW, WINDOW
from ftqp.kernel.layout.enums import (
    IS_DEGRADED,
    IS_FREE,
    IS_FROZEN,
    IS_LOCKED,
    IS_RUNAWAY,
    MOTOR_SLOW,
    OWN_SLOW,
    TORQUE_SLOW,
)

HELD = 0.02
"""A torque below this [N m or N] beside twice the friction holds no joint that could not rest without."""
BEYOND = 0.15
"""A runaway joint is so much faster than its reference, or against it [rad/s or m/s] ..."""
PUSHED = 0.45
"""... while its motion takes this share of its largest torque ..."""
JUMPED = 0.25
"""... of which this share came at once, because a brake that closes implies large torques, too, but never
such a speed (docs/theory/detection.md, "Runaway")."""
LEAD = 3
"""Ticks from a failure to the suspicion."""

LEAST_SHOWN = 0.1
"""Less than this of a step is not extrapolated from. The observer's step response is divided by, so that a
tenth makes ten times the noise of it."""
FULL = 0.85
"""A motor that gives this share of its largest torque unasked runs away."""

NOTHING_LEFT = 0.27
"""A share of the torque below this is none."""
LEAST_SHARE, LEAST_UNTOLD = -0.25, -0.6
"""Shares below are no lost torque; the second where the demand is not told."""

STICKY = 2.0
"""A demand below so many times its friction moves no joint, and does not show lost torque."""
PLAIN = 0.67
"""The difference of two torques of a motor is noise only: this share of its largest healthy size is odd."""
UNSURE = 1.3
"""Two standard deviations of a share, beside the square root of the sum that it was fitted over."""
LONGEST_WAIT = 3
"""A share that is not clear after so many times the patience will not be waited for."""
HALF = 0.5
"""A motor with this share of its torque may be stuck where it would not overcome friction with it."""
EXPLAINED, FLEETING = 0.6, 0.3
"""A fit that explains less of the squares is no loss of torque; the second behind a servo, which hides it."""
UNTOUCHED = 0.85
"""A share above this is healthy."""
PARALLEL = 0.8
"""A joint that stands is the culprit if it explains this share of what the best one explains."""
FAINT = 2.0
"""A demand below so many rooms of its residual does not show its share."""


@jit
def _jump_of_torque(D: Any, K: Any, i: int) -> float:
    """(M d)_i/F: the torque of joint i beside the healthy one, if it jumped when the suspicion began.

    F is what the fast observer shows by then of a step.
    """
    t = (D.watch + LEAD) * D.bandwidth_fast * D.dt
    shown = 1.0 - exp(-t) * (1.0 + t + 0.5 * t * t)
    jump = 0.0
    for j in range(D.n):
        jump += K.kinematics.M[i, j] * D.d[FAST, j]
    return jump / max(shown, LEAST_SHOWN)


@jit
def _healthy_torque(D: Any, K: Any, i: int, then: int) -> float:
    """(M a_r + h)_i."""
    total: float = K.kinematics.h[i]
    for j in range(D.n):
        total += K.kinematics.M[i, j] * D.past_a[then, j]
    return total


@jit
def _comes_back(D: Any, i: int, relative: float) -> bool:
    """Whether the loop of joint i may be what drives it: it comes nearer to its command, or has just done so.

    A joint that comes loose, or that something held or pulled, gets back the energy that its loop stored, and
    a loop that does not ring takes it no farther beyond its command than it came from: less than |e| on the
    other side within the window says that more than that energy is at work.
    """
    if D.e[i] * relative <= 0.0:
        return True
    other = 0.0
    for k in range(WINDOW):
        if D.kept_e[k, i] * D.e[i] < 0.0:
            other = max(other, abs(D.kept_e[k, i]))
    return abs(D.e[i]) <= other


@jit
def _runs_away(D: Any, K: Any, i: int, then: int) -> bool:
    """Whether joint i goes where nobody sent it with nearly all its torque.

    On a torque arm, whose loop takes it to its command, a joint that comes back does not run away.
    """
    if D.has_motor and abs(D.tau[i]) > FULL * D.tau_max[i]:
        asked = D.motor_torque[i]
        if asked * D.tau[i] < 0.0 or abs(asked) < FULL * FULL * D.tau_max[i]:
            return True
    v_ref, v = D.past_v[then, i], speed_of(D, i)
    against = v * v_ref < 0.0 and abs(v) > BEYOND
    beyond = v * v_ref >= 0.0 and abs(v) > abs(v_ref) + BEYOND
    if not (against or beyond):
        return False
    if D.from_command and _comes_back(D, i, v - v_ref):
        return False
    jump = _jump_of_torque(D, K, i)
    given = _healthy_torque(D, K, i, then) + jump
    if abs(given) < PUSHED * D.tau_max[i] or abs(jump) < JUMPED * D.tau_max[i]:
        return False
    return given * (v - v_ref) > 0.0 and jump * (v - v_ref) > 0.0


@jit
def _model_may_be_it(D: Any, i: int, then: int) -> bool:
    """Whether friction or a rotor that joint i may have takes as much as what is odd about its torque."""
    a = abs(D.past_a[then, i]) + abs(D.d[SLOW, i])
    less: bool = abs(D.x[TORQUE_SLOW, i]) < D.holds[i] + D.doubt[i] * a
    return less


@jit
def _held(D: Any, K: Any, i: int, then: int) -> int:
    """Joint i stands: locked, or its torque is too small for its friction, or its sensor is frozen.

    0 as long as it may be either and the loop still pushes harder.
    """
    friction = D.coulomb[i]
    load: float = K.kinematics.h[i]
    for j in range(D.n):
        if j != i:
            load += K.kinematics.M[i, j] * D.past_a[then, j]
    if friction_may_hold(D, i) or D.told_coulomb[i] >= 0.0:
        if _model_may_be_it(D, i, then):
            return 0
    elif D.holds[i] > 0.0 and abs(D.x[TORQUE_SLOW, i]) < STICKY * friction:
        return 0  # it went along, but friction that was learned stops it where its motor gives way
    kinds = IS_LOCKED
    if abs(load) < 2.0 * friction + HELD:
        kinds += IS_FREE
    if D.has_effort and D.asked and friction > 0.0:
        given = load - D.x[TORQUE_SLOW, i]
        held = abs(load) if given * load > 0.0 else 0.0
        if HALF * abs(given) < held + friction:
            if D.watch < 2 * D.patience:
                return 0
            kinds += IS_DEGRADED
    if cannot_tell_frozen(D, i):
        kinds += IS_FROZEN
    return kinds


@jit
def _shown(D: Any, i: int) -> float:
    """By how much joint i itself stands out in what shows lost torque; behind a servo it did so once."""
    if not D.has_effort or not D.known:
        return float(D.deviation[i])
    z = 0.0
    for b in range(BANKS):
        if D.has_motor:
            z = max(z, D.excess[MOTOR_SLOW + b, i] * D.sharp[MOTOR_SLOW + b, i] / PLAIN)
        else:
            z = max(z, D.excess[TORQUE_SLOW + b, i] * D.sharp[TORQUE_SLOW + b, i])
            z = max(z, D.excess[OWN_SLOW + b, i] * D.sharp[OWN_SLOW + b, i])
    return z


@jit
def _another_has_failed(D: Any) -> bool:
    """Whether a joint is known to have failed."""
    for i in range(D.n):
        if D.believed[i]:
            return True
    return False


@jit
def _lost_torque(D: Any, K: Any, i: int, then: int) -> int:
    """Whether joint i gives less torque than it should, and how much is left; 0 where this is not it."""
    fit_share(D, K, i, then)
    if D.watch < D.patience or is_slow(D, i) or _model_may_be_it(D, i, then):
        return 0
    weak = IS_FREE + IS_DEGRADED
    if _another_has_failed(D):  # what a fault does to its neighbours looks most like lost torque
        if not (D.has_effort and D.known) and follows_late(D, i):
            return 0
        weak = IS_DEGRADED if takes_up_speed(D, i) else weak
    share = D.fit_share
    least = LEAST_SHARE if D.has_effort and D.known and D.asked else LEAST_UNTOLD
    if (
        _shown(D, i) < 1.0
        or not least < share < UNTOUCHED
        or D.fit_spread < (EXPLAINED if D.has_effort else FLEETING)
    ):
        return 0
    unsure = UNSURE / max(D.fit_gg[D.fit_best], 1e-12) ** 0.5
    if abs(share - NOTHING_LEFT) < unsure:
        return 0 if D.watch < LONGEST_WAIT * D.patience else weak
    if abs(D.fit_size) < STICKY * D.coulomb[i]:
        return 0
    room = D.room[TORQUE_SLOW, i] if D.has_effort and D.known else HELD
    if abs(D.fit_size) < FAINT * room + D.coulomb[i]:
        return weak
    if share < NOTHING_LEFT:
        return weak - IS_DEGRADED  # 0 where it speeds up as asked: then this is not it
    return IS_DEGRADED


@jit
def _standing(D: Any, joint: int) -> tuple[int, int]:
    """The joint that does not move though it should, or -1, and how many there are; ``standing`` marks them.

    Where a push at the tip is believed a joint has to stand for the longer window, and to stand alone: a hand
    that holds an arm holds every joint that carries it, but a brake holds one.
    """
    best = D.score[joint] if joint >= 0 else 0.0
    for i in range(D.n):
        if joint < 0:
            best = max(best, D.score[i])
    standing, most, count = -1, 0.0, 0
    for i in range(D.n):
        D.standing[i] = 0
        explains = D.z[i] > 1.0 and D.score[i] > PARALLEL * best
        likely = explains or D.z[i] == D.worst
        window = FEWEST if explains and not D.touched else LONG
        likely = likely and not D.blind[i] and D.deviation[i] > 1.0
        counts = D.has_effort != 0 or D.probed != 0 or not friction_may_hold(D, i)
        if likely and counts and stands(D, i, window):
            D.standing[i] = 1
            count += 1
            if D.score[i] > most:
                standing, most = i, D.score[i]
    return standing, count


@jit
def isolate_fault(D: Any, K: Any, then: int) -> tuple[int, int]:
    """The joint and the set of kinds that this tick speaks for; -1 and 0 where it speaks for none.

    Where something pushes the tip no joint is named. A joint that stands goes first, then one that runs
    away, then lost torque.
    Source: docs/theory/detection.md, "Kinds".
    """
    joint = culprit(D, K)
    D.suspect = joint
    standing, count = _standing(D, joint)
    if D.touched and count != 1:
        return -1, 0
    if standing >= 0:
        D.suspect = standing
        return standing, _held(D, K, standing, then)
    if joint < 0 or D.touched:
        return -1, 0
    running, most = -1, 0.0
    for i in range(D.n):
        if not D.blind[i] and D.z[i] > 1.0 and D.score[i] > PARALLEL * D.score[joint]:
            far = abs(D.e[i]) * (1.0 if _runs_away(D, K, i, then) else 0.0)
            if far > most:
                running, most = i, far
    if running >= 0:
        D.suspect = running
        return running, IS_RUNAWAY
    return joint, _lost_torque(D, K, joint, then)
