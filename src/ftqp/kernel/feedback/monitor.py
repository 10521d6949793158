"""The monitor of joints that do not obey: residuals, one table of hypotheses, one table of responses.

The hypotheses, and how long each has to last, are ``ftqp.kernel.layout.hypotheses.Hypothesis``.
What is seen of an arm: how far joints are from their commands, how fast they are, and, of an arm that takes
torques, what torques are unusual. Who has failed is said by ``ftqp.kernel.monitor``.
"""

from typing import Any

from ftqp.kernel.feedback.disturbance import note_missing
from ftqp.kernel.feedback.error_band import error_band
from ftqp.kernel.feedback.learned_inertia import is_known
from ftqp.kernel.feedback.pairs import partner, reduce_gain
from ftqp.kernel.feedback.persistence import persisted
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.feedback.touch import detect_touch
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.latches.settling import latch
from ftqp.kernel.layout.enums import ALL_BRAKES, HEALTHY, NO_BRAKES, STOPPED_BY_LAG, TORQUE_DRIVE
from ftqp.kernel.layout.hypotheses import LEFT_BAND, TOO_FAST, TOUCHED
from ftqp.kernel.maths.elementary import larger
from ftqp.kernel.maths.side_by_side import WIDTH, all_of, load_lanes
from ftqp.kernel.monitor.verdicts import OVERSPEED, is_near


@jit
def _brake(feedback: Any, i: int) -> None:
    """Joint i asks for its brake, if the arm has any: else its own loop is all that can bring it back."""
    if feedback.brakes != NO_BRAKES:
        feedback.asks[i] = 1


@jit
def _brake_and_stop(watch: Any, feedback: Any, i: int) -> None:
    """And the arm is stopped, if it may be, and always where it has but one brake for all."""
    _brake(feedback, i)
    if watch.latched == 0 and (watch.stop_samples > 0 or feedback.brakes == ALL_BRAKES):
        latch(watch, STOPPED_BY_LAG)
        feedback.isolated_joint = i


@rare_jit
def watch_torques(K: Any) -> None:
    """What of a torque arm's torques is unusual, once its model is known: a push, or one of a pair."""
    feedback = K.feedback
    note_missing(K)
    if not is_known(K.state, K.learned):  # it may be the model that is wrong
        return
    reduce_gain(K)
    if K.faults.working == K.chain.n:
        detect_touch(K)
    else:  # what looked like one was the failure
        feedback.touched = feedback.persistence[TOUCHED, 0] = 0


@jit
def _is_thrown(K: Any, i: int) -> bool:
    """Whether the joint on joint i's axis has failed, so that this one has little inertia to hold against."""
    if K.feedback.kind != TORQUE_DRIVE or K.faults.working == K.chain.n:
        return False
    other = partner(K.feedback, K.chain, i)
    return bool(other >= 0 and K.faults.code[other] != HEALTHY)


@jit
def _may_be_too_fast(K: Any, then: int) -> bool:
    """Whether any joint is faster than its limit and its command."""
    for at in range(0, K.chain.n, WIDTH):
        most = larger(load_lanes(K.limits.v_max, at), abs(load_lanes(K.past.v[then], at)))
        if not all_of(abs(load_lanes(K.feedback.v_hat, at)) <= most):
            return True
    return False


@jit
def watch_motion(K: Any) -> None:
    """The joints that are out of hand, whatever the drive: out of their bands in a stop, or too fast.

    What an impact has thrown is brought back, and is not out of hand: a brake that closed now would be a
    second impact for the others. How fast a torque arm's joint is its samples alone
    say: an observer counts on what is sent against it.
    """
    feedback, past, top = K.feedback, K.past, K.limits.v_max
    then = slot(feedback, feedback.latency)
    if not (feedback.any_counted or K.watch.latched or _may_be_too_fast(K, then)):
        return
    feedback.any_counted = 0
    for i in range(K.chain.n):
        if K.faults.code[K.chain.lead[i]] != HEALTHY or feedback.thrown > 0.0:
            feedback.persistence[LEFT_BAND, i] = feedback.persistence[TOO_FAST, i] = 0
            continue
        if K.monitor.on:
            far = K.monitor.G[i] > K.monitor.level and not is_near(K, i)
        else:
            far = abs(feedback.seen[i] - past.q[then, i]) > error_band(feedback, past, i)
        out = K.watch.latched != 0 and far and not _is_thrown(K, i)
        v = K.held.speed[i] if feedback.kind == TORQUE_DRIVE else feedback.v_hat[i]
        fast = abs(v) > OVERSPEED * top[i] + max(top[i], abs(past.v[then, i]))
        if out or fast:
            feedback.any_counted = 1
        if persisted(K.state, feedback, TOO_FAST, i, fast):
            _brake_and_stop(K.watch, feedback, i)
        if persisted(K.state, feedback, LEFT_BAND, i, out):
            _brake(feedback, i)


@jit
def monitor(K: Any) -> None:
    """Looks for joints that do not obey although nobody has said so, and does what the table says.

    Source: docs/theory/feedback.md, "The monitor".
    """
    feedback = K.feedback
    if feedback.exact and not feedback.any_counted:
        return
    if feedback.kind == TORQUE_DRIVE and not feedback.exact:
        watch_torques(K)
    watch_motion(K)
