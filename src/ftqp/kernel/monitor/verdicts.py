"""The table of hypotheses, which is what decides: what each is believed upon, and what then follows.

A new kind of failure is a row. What a row finds is said in ``found``; the planner then counts on it.
Source: docs/theory/monitor.md, "The table".
"""

from functools import reduce
from typing import Any

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.latches.settling import latch
from ftqp.kernel.layout.enums import (
    FROZEN,
    HEALTHY,
    IS_BIASED,
    IS_DROPPED,
    IS_FREE,
    IS_FROZEN,
    IS_LOCKED,
    IS_RUNAWAY,
    STOPPED_BY_LAG,
    STOPPED_BY_SENSOR,
    TORQUE_DRIVE,
    VELOCITY_DRIVE,
)
from ftqp.kernel.layout.hypotheses import TOO_FAST, TOUCHED
from ftqp.kernel.layout.thresholds import GEAR
from ftqp.kernel.maths.elementary import is_finite
from ftqp.kernel.monitor.evidence import blur_of, forget_evidence, stands
from ftqp.kernel.monitor.leading import asks_all
from ftqp.kernel.monitor.servos import as_before, may_stick, ticks_to_settle

MOVES = 0.05
"""A joint without motor is named where it is faster than this [rad/s or m/s]: what it does without shows."""
ALONE = 2.0
"""A push or a hold is in many joints, a fault in one: the evidence against it is so many times as much."""
EXCESS, BLURS, FRICTIONS, MOST = 0.002, 12.0, 2.0, 0.015
"""A joint that is held is asked for so much more [rad or m], beside noise and what dry friction may hold
back, at most for so much, so that it shows when it is held no more, ..."""
WENT, SIGMAS = 0.5, 6.0
"""... by going this share of it, and so many standard deviations, ..."""
SUSPECTED = 0.2
"""A joint of a held arm was to move, one that moves is pushed, if so much of what decides spoke for it."""
OVERSPEED = 0.2
"""A joint faster than its limit by more than this share runs away; the single samples say so."""
AT_REST = 0.05
"""... and is slower than this [rad/s or m/s] there, as it went where it was asked to and no farther."""
MISTAKEN = 0.5
"""A joint without a motor is moved by its weight and by the others: the model may be wrong by this share."""
PUSHES = 1.0
"""What pushes an arm for longer [s] is a load, and is learned."""


@jit
def works(K: Any, i: int) -> bool:
    """Whether joint i is judged: it has a motor of its own, and nobody says that it has failed."""
    judged: bool = K.faults.code[i] == HEALTHY and K.chain.lead[i] == i and K.monitor.found[i] == 0
    return judged


@jit
def _others_move(K: Any) -> bool:
    """Whether any joint that works moves: where none does, the arm is held, and not a joint."""
    for j in range(K.chain.n):
        if works(K, j) and K.monitor.rests[j] == 0:
            return True
    return False


@jit
def _excess(K: Any, i: int) -> float:
    """By so much more than noise and what friction may hold back a joint that is held is asked for."""
    return float(min(EXCESS + BLURS * blur_of(K, i), MOST))


@jit
def _holds_still(K: Any, i: int) -> bool:
    """Whether nothing can be said of joint i, which takes torques: the arm is stopped, and brakes hard."""
    return bool(K.feedback.kind == TORQUE_DRIVE and K.watch.latched != 0)


@jit
def is_pushed(feedback: Any) -> bool:
    """Whether something pushes the tip: three columns of J' explain more than one joint does."""
    return bool(feedback.touched > 0 or feedback.persistence[TOUCHED, 0] > 0)


@jit
def is_near(K: Any, i: int) -> bool:
    """Whether joint i is where it should be, but for noise and what friction may hold back."""
    return bool(abs(K.state.q_command[i] - K.monitor.means[0, i]) < _excess(K, i))


@jit
def _may_be_carried(K: Any, i: int) -> bool:
    """Whether joint i is to stand in a stop beside one that swings or ran away: that one may carry it off.

    One that swung while the arm went on does not, if what stopped the arm is a joint that was too fast.
    """
    if K.watch.latched == 0:
        return False
    for j in range(K.chain.n):
        found = K.monitor.found[j]
        if j != i and (found == IS_RUNAWAY or (found == IS_FREE and K.watch.reason != STOPPED_BY_LAG)):
            return True
    return False


@jit
def _is_locked(K: Any, i: int) -> bool:
    """Joint i has not gone where it was sent, stands, and stands out."""
    M = K.monitor
    if M.G_lock[i] <= M.level or not _others_move(K) or _holds_still(K, i):
        return False
    if K.feedback.kind == TORQUE_DRIVE and is_near(K, i):  # a loop that shakes is no lock
        return False
    if _may_be_carried(K, i):
        return False
    if may_stick(K, i) and not asks_all(K, i):
        return False
    others = 0.0
    for j in range(K.chain.n):
        if j != i and works(K, j):
            others += M.G_lock[j]
            if M.G_lock[j] > M.G_lock[i]:
                return False
    # a lock may look like a push or a hold, and lasts
    common = is_pushed(K.feedback) or M.settles > 0 or ALONE * others > M.G_lock[i]
    return bool(M.G_lock[i] >= ALONE * M.level or not common)


@jit
def _is_driven(K: Any, i: int) -> bool:
    """Whether joint i, which has a servo, comes back to where it is sent, or begins to: no push does that."""
    M, off = K.monitor, K.state.q_command[i] - K.monitor.means[0, i]
    return bool(K.feedback.kind != TORQUE_DRIVE and (M.a[i] * off > 0.0 or M.v[i] * off > 0.0))


@jit
def _has_no_motor(K: Any, i: int) -> bool:
    """Joint i moves as if nothing drove it, and no other one does what it should not."""
    M = K.monitor
    too_fast = abs(M.v[i]) > (1.0 + OVERSPEED) * K.limits.v_max[i]
    if M.settles > 0 or M.G_free[i] <= M.level or M.rests[i] or abs(M.v[i]) <= MOVES or too_fast:
        return False
    if is_pushed(K.feedback) or _holds_still(K, i) or _is_driven(K, i) or _may_be_carried(K, i):
        return False
    for j in range(K.chain.n):
        if M.found[j] == IS_FREE or (j != i and ALONE * M.G[j] > M.G_free[i]):
            return False
    return True


@jit
def _is_pushed_away(K: Any, i: int) -> bool:
    """Whether joint i leaves its command where neither its weight nor the others lead it: a push does."""
    M, v = K.monitor, K.monitor.v[i]
    if K.feedback.kind == TORQUE_DRIVE or M.G[i] <= SUSPECTED * M.level:
        return False
    takes, most = M.weight[i] + M.inertia[i], max(abs(M.weight[i]), abs(M.inertia[i]))
    return bool(M.rests[i] == 0 and M.r[i] * v < 0.0 and takes * v > MISTAKEN * most * abs(v))


@jit
def _runs_away(K: Any, i: int) -> bool:
    """Joint i has been out of hand for so long that its brake is asked for, and no other joint is."""
    feedback = K.feedback
    if feedback.asks[i] == 0 or _may_be_carried(K, i):
        return False
    fast = feedback.persistence[TOO_FAST, i] > 0
    for j in range(K.chain.n):  # an arm that has gone out of hand is no joint's doing
        too_fast = feedback.persistence[TOO_FAST, j] > 0
        if j != i and works(K, j) and (too_fast or (feedback.asks[j] != 0 and not fast)):
            return False
    return True


@jit
def _has_no_sensor(K: Any, i: int) -> bool:
    """What the sensor of joint i says has been impossible for so long that the arm is stopped."""
    if K.feedback.lost[i] == 0:
        return False
    for j in range(K.chain.n):  # where no joint gives samples it is the line that fails
        if j != i and works(K, j) and K.feedback.bad[j] == 0:
            return True
    return K.faults.working == 1


@rare_jit
def _name(K: Any, i: int, kind: int) -> None:
    """Joint i has failed: its servo is again what it was before that, and all others are looked at anew."""
    M = K.monitor
    size = EXCESS + BLURS * blur_of(K, i) + FRICTIONS * max(M.theta[i, 2], 0.0)
    as_before(M, i)
    M.place[i] = (M.means[0, i] + M.means[1, i] + M.means[2, i]) / 3.0
    M.tell[i] = -min(size, MOST) if M.r[i] < 0.0 else min(size, MOST)
    M.found[i] = kind
    M.found_at[i] = K.state.ticks
    M.news = 1
    forget_evidence(K)


@jit
def _lock(K: Any, i: int) -> None:
    _name(K, i, IS_LOCKED)


@jit
def _run_away(K: Any, i: int) -> None:
    _name(K, i, IS_RUNAWAY)


@rare_jit
def _lose_sensor(K: Any, i: int) -> None:
    """Its servo holds it where it was sent last. If its numbers run faster than it may, the joint may run."""
    kind = IS_BIASED if is_finite(K.state.q[i]) else IS_DROPPED
    fast = abs(K.held.speed[i]) > (1.0 + OVERSPEED) * K.limits.v_max[i]
    if kind == IS_BIASED and fast and K.watch.latched == 0:
        latch(K.watch, STOPPED_BY_SENSOR)
    _name(K, i, IS_FROZEN if K.feedback.held[i] == FROZEN else kind)


@jit
def _free(K: Any, i: int) -> None:
    _name(K, i, IS_FREE)


@rare_jit
def _let_be_pushed(K: Any, i: int) -> None:
    """No motor is off, and nobody is judged until the arm has come to rest from it."""
    K.monitor.settles = max(K.monitor.settles, int(PUSHES / K.state.dt))
    for j in range(K.chain.n):
        K.monitor.blind[j] = max(K.monitor.blind[j], ticks_to_settle(K, j))
    forget_evidence(K)


@jit
def follows_again(K: Any, i: int) -> bool:
    """Whether a joint that was found to be locked has gone where it was asked to."""
    M, way = K.monitor, K.monitor.y_f[2, i] - K.monitor.place[i]
    if K.feedback.kind == TORQUE_DRIVE:  # it is sent no torque: what holds nothing falls
        return bool(abs(way) > _excess(K, i) and abs(M.v[i]) > AT_REST)
    along = way if M.tell[i] > 0.0 else -way
    share, asked = WENT, abs(K.gate.sent[i] - M.place[i] - M.droop[i] - M.tell[i]) < GEAR
    if K.feedback.kind == VELOCITY_DRIVE:  # there and back, half as far to either side if let go half-way
        share, asked, along = 0.5 * WENT, True, abs(way)
    far = max(share * abs(M.tell[i]), SIGMAS * blur_of(K, i) + GEAR)
    return bool(asked and along > far and abs(M.v[i]) < AT_REST)


@rare_jit
def withdraw(K: Any, i: int) -> None:
    """Joint i works after all; what speeds were sent to it while it was held led nowhere."""
    M = K.monitor
    M.found[i] = 0
    M.news = 1
    if K.feedback.kind == VELOCITY_DRIVE:
        M.u[i], M.blind[i] = M.y[i], ticks_to_settle(K, i)
        for k in range(3):
            M.u_f[k, i] = M.y_f[k, i]
    elif K.feedback.kind == TORQUE_DRIVE:  # it goes on from where it is, and as fast
        top = K.limits.v_max[i]
        K.gate.q[i], K.gate.v[i] = K.feedback.q_now[i], min(max(K.feedback.v_now[i], -top), top)
        K.state.a_command[i], M.blind[i] = 0.0, ticks_to_settle(K, i)
    forget_evidence(K)


@jit
def arm_is_held(K: Any) -> bool:
    """Whether all joints stand, and what speaks for it decides, taken together: that is one cause."""
    M, total = K.monitor, 0.0
    for j in range(K.chain.n):
        if works(K, j):
            if M.rests[j] == 0:
                return False
            total += M.G_lock[j]
    return bool(total > M.level)


@rare_jit
def hold_arm(K: Any) -> None:
    """The arm is held from the next tick on: nobody is named, and nothing is supposed of any joint."""
    for j in range(K.chain.n):
        K.held.asked[j] = 1.0 if K.monitor.G_lock[j] > SUSPECTED * K.monitor.level else 0.0
    K.monitor.holds = 1
    forget_evidence(K)


TABLE: Any = (
    (_has_no_sensor, _lose_sensor),
    (_runs_away, _run_away),
    (_is_locked, _lock),
    (_is_pushed_away, _let_be_pushed),
    (_has_no_motor, _free),
)
"""What is believed of a joint, and what follows from it, the first that is so."""


@jit
def _nothing(K: Any, i: int) -> bool:
    """Nothing is the case."""
    return False


def _then(first: Any, row: Any) -> Any:
    """The rows before, then this one."""
    is_so, respond = row

    @jit
    def both(K: Any, i: int) -> bool:
        if first(K, i):
            return True
        if is_so(K, i):
            respond(K, i)
            return True
        return False

    return both


judge: Any = reduce(_then, TABLE, _nothing)
"""Whether any row holds of joint i; what follows has been done."""


@jit
def judge_joint(K: Any, i: int) -> None:
    """What the table says of joint i after a look."""
    M = K.monitor
    M.rests[i] = 1 if stands(K, i) else 0
    if not M.names:
        return
    if works(K, i):
        judge(K, i)
    elif M.found[i] == IS_LOCKED and follows_again(K, i):
        withdraw(K, i)
