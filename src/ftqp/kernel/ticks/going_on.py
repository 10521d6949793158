"""Whether a tick goes on to the task: its error is looked at, and a stop or a target without use ends it."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.pose_error import pose_error
from ftqp.kernel.feedback.gap import norms
from ftqp.kernel.feedback.late_targets import play_back
from ftqp.kernel.feedback.status_report import task_error
from ftqp.kernel.feedback.tip_correction import displace
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.judge.stage_problems import begin_stop
from ftqp.kernel.latches.settling import latch
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    BRAKING,
    BY_POSITION,
    HELD,
    INVALID_INPUT,
    REST_STAGE,
    STOPPED_BY_ERROR,
    TARGET_TWIST,
)
from ftqp.kernel.maths.linear_systems import assign, plus_products
from ftqp.kernel.rows.further_tasks import error_of
from ftqp.kernel.rows.task_rows import task_rows

NO_MOTION = 1e-9
"""A limit that asks for less than this moves nothing [rad/s, m/s or a row's own unit]. Rounding."""


@jit
def _speed_of(state: Any, x: float, v: float) -> float:
    """The velocity after the tick that x gives to what has the velocity v: v + dt x, or x itself."""
    return v + state.dt * x if state.level == ACCELERATION else x


@rare_jit
def limits_move(K: Any) -> bool:
    """Whether a limit moves the arm, whatever the task asks for: it does not let it rest after the tick.

    So a joint is led back into its range, a point to its side and bodies apart, and so a lock brakes.
    Limits of speed, acceleration and torque only keep the arm from resting at once, and do not count.
    """
    state, faults, limits, qp = K.state, K.faults, K.limits, K.qp
    for i in range(K.chain.n):
        v = state.v[i]
        if faults.code[i] == BRAKING and abs(v) > NO_MOTION:
            return True
        if limits.upper_by[i] == BY_POSITION and _speed_of(state, qp.ub[i], v) < -NO_MOTION:
            return True
        if limits.lower_by[i] == BY_POSITION and _speed_of(state, qp.lb[i], v) > NO_MOTION:
            return True
    for k in range(qp.rigid, qp.nc):
        v = plus_products(0.0, qp.C[k], state.v, K.chain.n)
        if _speed_of(state, qp.l[k], v) > NO_MOTION or _speed_of(state, qp.u[k], v) < -NO_MOTION:
            return True
    return False


@jit
def _stopping_time(K: Any) -> float:
    """How long the slowest joint takes to brake from its speed [s]."""
    time = 0.0
    for k in range(K.faults.working):
        i = K.faults.order[k]
        time = max(time, abs(K.state.v[i]) / K.limits.a_brake[i])
    return time


@jit
def _change_by_motion(K: Any) -> float:
    """By how many thresholds the motion of the arm changes the tip's error in a tick, in whatever direction.

    A tip that passes its target has an error that neither rises nor falls, and overshoots.
    """
    task, J, state = K.task, K.kinematics.J, K.state
    linear = angular = 0.0
    for c in range(6 if task.uses_rotation else 3):
        x = plus_products(-task.target[TARGET_TWIST + c], J[c], state.v, K.chain.n)
        if c < 3:
            linear += x * x
        else:
            angular += x * x
    return max(sqrt(linear) / K.watch.stop_position, sqrt(angular) / K.watch.stop_rotation) * state.dt


@rare_jit
def _count_off(K: Any, e: float, r: float) -> None:
    """``left``: what a limit that moves the arm has left of the error, until it can rest within thresholds.

    That is what the error (e, r) rises by while a limit moves the arm, and as much again, as a motion that a
    limit has begun goes on beyond it, and overshoots; but no more than the error itself, and half of what it
    changes by while the joints brake. An error that was there before, as of a task out of reach, is not the
    limit's. All is counted in thresholds, the larger one: on its way back a tip may trade some of its place
    for its attitude.
    """
    watch = K.watch
    worst, rise = max(e / watch.stop_position, r / watch.stop_rotation), 0.0
    change = _change_by_motion(K)
    if watch.last_position_error < inf:
        last_e, last_r = watch.last_position_error, watch.last_rotation_error
        rise = max(worst - max(last_e / watch.stop_position, last_r / watch.stop_rotation), 0.0)
        change = max(change, abs(e - last_e) / watch.stop_position, abs(r - last_r) / watch.stop_rotation)
    ahead = worst + 0.5 * change * _stopping_time(K) / K.state.dt
    if worst > 1.0 and limits_move(K):
        watch.left = min(watch.left + 2.0 * rise, ahead)
    elif ahead <= 1.0:
        watch.left = 0.0


@jit
def _emergency(K: Any) -> bool:
    """Latch when the reference's error is beyond its threshold and has risen on ``stop_samples`` ticks.

    Errors of tasks that go before the tip's count as its own, and so do those beside it that are required.
    What a limit that moves the arm has left of it does not count, see ``_count_off``.
    """
    task, watch, feedback, kinematics, terms = K.task, K.watch, K.feedback, K.kinematics, K.terms
    e, r = task.position_error, task.rotation_error
    if feedback.displaced or feedback.late > 0.0 or feedback.latency > 0 or K.monitor.sees:
        e, r = norms(task, kinematics, task.error)
    for t in range(terms.count):
        if (terms.hard[t] or (terms.shares[t] and terms.required[t])) and terms.weight[t] > 0.0:
            position, rotation = error_of(terms, t)
            e, r = max(e, position), max(r, rotation)
    if e > watch.stop_position or r > watch.stop_rotation or watch.left > 0.0:
        _count_off(K, e, r)
    beyond = (e > (1.0 + watch.left) * watch.stop_position and e > watch.last_position_error) or (
        r > (1.0 + watch.left) * watch.stop_rotation and r > watch.last_rotation_error
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
def _stay(K: Any) -> bool:
    """The whole arm is held: it stays where it is, and that is no stop."""
    _stop(K)
    if K.watch.latched == 0:
        K.cascade.outcome = HELD
    return False


@rare_jit
def _refuse_target(K: Any) -> bool:
    """A target that cannot be used: the arm is brought to rest until one can; its error is what it was."""
    _stop(K)
    assign(K.past.error[K.feedback.now], K.task.error, 6)
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
    task_error(K.task, K.feedback, K.kinematics, K.past)
    displace(K.task, K.feedback)
    if K.held.on:
        return _stay(K)
    return not _emergency(K) or _stop(K)


@jit
def may_go_on_by_the_clock(K: Any, valid: bool) -> bool:
    """The same, with the target played back late while the arm cannot follow."""
    if valid:
        K.task.has_tip_measured = 0
        pose_error(K)
        task_error(K.task, K.feedback, K.kinematics, K.past)
        play_back(K)
        if K.feedback.late > 0.0:
            pose_error(K)
    else:
        return _refuse_target(K)
    displace(K.task, K.feedback)
    if K.held.on:
        return _stay(K)
    return not _emergency(K) or _stop(K)


@jit
def may_go_on_as_measured(K: Any, valid: bool) -> bool:
    """The same above a moving base, where the measured state itself is led."""
    if not valid:
        return _refuse_target(K)
    pose_error(K)
    assign(K.task.seen, K.task.error, 6)
    K.task.position_error, K.task.rotation_error = norms(K.task, K.kinematics, K.task.error)
    return not _emergency(K) or _stop(K)
