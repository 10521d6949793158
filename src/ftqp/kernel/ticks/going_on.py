"""Whether a tick goes on to the task: its error is looked at, and a stop or a target without use ends it."""

from typing import Any

from ftqp.kernel.arm.pose_error import pose_error
from ftqp.kernel.feedback.gap import norms
from ftqp.kernel.feedback.late_targets import play_back
from ftqp.kernel.feedback.status_report import see_error
from ftqp.kernel.feedback.tip_correction import displace
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.judge.stage_problems import begin_stop
from ftqp.kernel.latches.stop_latch import latch
from ftqp.kernel.layout.enums import INVALID_INPUT, REST_STAGE, STOPPED_BY_ERROR
from ftqp.kernel.rows.further_tasks import error_of
from ftqp.kernel.rows.task_rows import task_rows


@jit
def _emergency(task: Any, watch: Any, feedback: Any, kinematics: Any, terms: Any) -> bool:
    """Latch when the reference's error is beyond its threshold and has risen on ``stop_samples`` ticks.

    Errors of tasks that go before the tip's count as its own, and so do those beside it that are required.
    """
    e, r = task.position_error, task.rotation_error
    if feedback.displaced or feedback.late > 0.0 or feedback.latency > 0:
        e, r = norms(task, kinematics, task.error)
    for t in range(terms.count):
        if (terms.hard[t] or (terms.shares[t] and terms.required[t])) and terms.weight[t] > 0.0:
            position, rotation = error_of(terms, t)
            e, r = max(e, position), max(r, rotation)
    beyond = (e > watch.stop_position and e > watch.last_position_error) or (
        r > watch.stop_rotation and r > watch.last_rotation_error
    )
    watch.rising = watch.rising + 1 if beyond else 0
    watch.last_position_error, watch.last_rotation_error = e, r
    if watch.stop_samples > 0 and watch.rising >= watch.stop_samples and watch.latched == 0:
        latch(watch, STOPPED_BY_ERROR)
    return watch.latched != 0


@rare_jit
def _stop(K: Any) -> bool:
    """The rows of the task are there to be looked at, but the arm is brought to rest."""
    task_rows(K, K.task.kp)
    K.cascade.outcome = begin_stop(K)
    K.cascade.stage = REST_STAGE
    return False


@rare_jit
def _refuse_target(K: Any) -> bool:
    """A target that cannot be used: the arm is brought to rest until one can; its error is what it was."""
    _stop(K)
    for k in range(6):
        K.past.error[K.feedback.now, k] = K.task.error[k]
    if K.watch.latched == 0:
        K.cascade.outcome = INVALID_INPUT
    return False


@jit
def may_go_on(K: Any, valid: bool) -> bool:
    """The task's error and the stop test; False when the arm is to be brought to rest."""
    if not valid:
        return _refuse_target(K)
    K.task.has_tip_measured = 0  # it is in the displacement
    pose_error(K)
    see_error(K.task, K.feedback, K.kinematics, K.past)
    displace(K.task, K.feedback)
    return not _emergency(K.task, K.watch, K.feedback, K.kinematics, K.terms) or _stop(K)


@jit
def may_go_on_by_the_clock(K: Any, valid: bool) -> bool:
    """The same, with the target played back late while the arm cannot follow."""
    if valid:
        K.task.has_tip_measured = 0
        pose_error(K)
        see_error(K.task, K.feedback, K.kinematics, K.past)
        play_back(K)
        if K.feedback.late > 0.0:
            pose_error(K)
    else:
        return _refuse_target(K)
    displace(K.task, K.feedback)
    return not _emergency(K.task, K.watch, K.feedback, K.kinematics, K.terms) or _stop(K)


@jit
def may_go_on_as_measured(K: Any, valid: bool) -> bool:
    """The same above a moving base, where the measured state itself is led."""
    if not valid:
        return _refuse_target(K)
    pose_error(K)
    for k in range(6):
        K.task.seen[k] = K.task.error[k]
    K.task.position_error, K.task.rotation_error = norms(K.task, K.kinematics, K.task.error)
    return not _emergency(K.task, K.watch, K.feedback, K.kinematics, K.terms) or _stop(K)
