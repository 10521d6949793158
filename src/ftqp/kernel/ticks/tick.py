"""The first half of a tick, from the measured state to a QP, as a sum of parts; the cascade is the second.

Who leads the arm decides which parts there are: the clock, a path that is followed by its progress, or an
inertial target above a base that moves. What a planner does not use is not compiled for it.
"""

from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.arm.pose_error import pose_error
from ftqp.kernel.feedback.gap import measure_gap, stand_by, wait
from ftqp.kernel.feedback.held import watch_arm
from ftqp.kernel.feedback.lead_bound import keep_near
from ftqp.kernel.feedback.learned_inertia import is_known, learn
from ftqp.kernel.feedback.monitor import monitor
from ftqp.kernel.feedback.observer import dynamics_at_estimate, observe
from ftqp.kernel.feedback.reference import leave_margin, take_jump, update_reference
from ftqp.kernel.feedback.samples import believe, slot
from ftqp.kernel.feedback.status_report import task_error
from ftqp.kernel.feedback.tip_correction import correct, look_at_tip
from ftqp.kernel.free.decision import ask_for_motion, outcome_beside_free, search_step
from ftqp.kernel.free.end_stop import end_stops
from ftqp.kernel.free.foretelling import foretell
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.judge.stage_problems import begin_first_stage, begin_rest
from ftqp.kernel.latches.settling import TASK_LEFT, settle
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    AS_STATED,
    FIRST_STAGE,
    FOLLOW,
    HARD,
    INVALID_INPUT,
    LEXICOGRAPHIC,
    MAIN_STAGE,
    QP_READY,
    REST_STAGE,
    SCALE,
    SETTLING_STAGE,
    SOLVE,
    TORQUE_DRIVE,
)
from ftqp.kernel.layout.thresholds import LAST
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.monitor.leading import speed_up_gently
from ftqp.kernel.monitor.watching import watch_servos
from ftqp.kernel.rows.constraint_rows import (
    IN_EVERY_TICK,
    add_constraints,
    add_other_rows,
    stood_at_torque_limit,
)
from ftqp.kernel.rows.failed_joints import (
    any_instant_lock,
    give_back,
    lock_instantly,
    loses,
    prescribed_motion,
    sort_joints,
)
from ftqp.kernel.rows.inertial_target import follow_base, reduce_by_lead
from ftqp.kernel.rows.joint_intervals import intervals
from ftqp.kernel.rows.objective import (
    add_drive,
    add_manipulability,
    aim_at_reference,
    joint_objective,
    objective,
)
from ftqp.kernel.rows.path_rows import STIFFNESS, begin_on_path, path_rows, rate_variable
from ftqp.kernel.rows.task_rows import compliance, fade_feedback, path_scale, softness, task_rows, turn_rows
from ftqp.kernel.rows.task_terms import share
from ftqp.kernel.scene.clearance import look_around, stop_unwatched
from ftqp.kernel.settling.metric import outlook
from ftqp.kernel.settling.settling_qp import (
    begin_settling,
    begin_settling_on_path,
    end_settling,
    settles,
    stand_still,
    waits,
)
from ftqp.kernel.ticks.accepted_inputs import state_is_finite, target_is_usable
from ftqp.kernel.ticks.going_on import may_go_on, may_go_on_as_measured, may_go_on_by_the_clock

SCALE_STAGE_RATIO = 1e-7
"""Scaled mode: compliance of the rows that keep the direction."""


@jit
def _begin(state: Any, faults: Any, cascade: Any, terms: Any, chain: Any, qp: Any) -> None:
    """Forget the last tick's QP and sort the joints."""
    state.ticks += 1
    terms.stands, terms.added = -1.0, 0.0
    qp.soft_rows, qp.soft_last = 0.0, LAST
    cascade.claim = -1
    cascade.qp_iterations = 0
    cascade.torque_excess = 0.0
    cascade.missed = cascade.outside = 0
    cascade.jump = 1.0
    sort_joints(faults, chain)


@jit
def _see_as_measured(K: Any) -> bool:
    """Begin a tick at the measured state: whether all inputs are usable."""
    _begin(K.state, K.faults, K.cascade, K.terms, K.chain, K.qp)
    K.feedback.active = 0
    valid = state_is_finite(K.state, K.chain) and target_is_usable(K.task)
    forward_kinematics(K, K.state)
    return valid


@part_jit
def _see(K: Any) -> bool:
    """Begin a tick at the reference: what is believed of the arm, and how far the target is displaced."""
    feedback = K.feedback
    _begin(K.state, K.faults, K.cascade, K.terms, K.chain, K.qp)
    feedback.active = 1
    first, as_stated = feedback.fresh != 0, feedback.fresh == AS_STATED
    valid = target_is_usable(K.task)
    believe(K)
    watch_arm(K, first)
    observe(K, first)
    if K.monitor.on or K.monitor.names:
        watch_servos(K, first, slot(feedback, feedback.latency), is_known(K.state, K.learned))
    if feedback.kind == TORQUE_DRIVE:
        if not K.held.on:
            learn(K, as_stated, first)
        dynamics_at_estimate(K)
    if not K.held.on:
        monitor(K)
    if K.faults.working < K.chain.n:
        foretell(K, first)
    update_reference(K.state, K.faults, feedback, K.chain, K.past)
    look_at_tip(K)
    leave_margin(K.faults, feedback, K.chain, K.past)
    correct(K)
    if K.held.on:
        stand_by(feedback)
    else:
        measure_gap(K)
        wait(K)
    return valid


@part_jit
def _bound(K: Any) -> None:
    """Motion of the failed joints, kinematics at the acceleration level, and every joint's interval."""
    if any_instant_lock(K.faults, K.chain):
        motion(K, K.state)
        dynamics(K, K.state)
        lock_instantly(K)
        take_jump(K)
    prescribed_motion(K.state, K.faults, K.limits, K.chain, K.qp)
    if K.state.level == ACCELERATION:
        motion(K, K.state)
    if loses(K):
        give_back(K)
    intervals(K)
    keep_near(K)
    if K.monitor.on:
        speed_up_gently(K)


@jit
def _limit(K: Any) -> None:
    """The rows of C, where every tick needs them, or where the last command stood at one."""
    K.qp.nc = 0
    K.kinematics.has_dynamics = 0
    stop_unwatched(K.scene, K.watch)
    if K.scene.pairs > 0:
        look_around(K)
    if K.limits.dynamic and (not K.limits.on_demand or stood_at_torque_limit(K.qp)):
        add_constraints(K)
    elif IN_EVERY_TICK or K.keeps.asked > 0 or K.scene.held > 0:
        add_other_rows(K)


@jit
def _ask(K: Any) -> int:
    """How firmly the task is asked for, by its mode: QP_READY, or SOLVE when another QP comes first."""
    task, terms, turned, qp = K.task, K.terms, K.turned, K.qp
    ratio = task.slack_ratio
    K.cascade.stage = MAIN_STAGE
    end_settling(qp, K.settling)
    assign(task.asked, qp.b, task.m)
    if task.mode == HARD:
        if turned.on:
            compliance(task, terms, K.chain, qp, turned, 0.0)
        for k in range(task.m):
            if not turned.on or turned.softness[k] == 0.0:
                qp.soft[k] = 0.0
        qp.soft_last = 0.0
    elif task.mode == SCALE:
        ratio = SCALE_STAGE_RATIO
        compliance(task, terms, K.chain, qp, turned, ratio)
        path_scale(K.state, K.limits, K.chain, qp)
    elif task.mode == LEXICOGRAPHIC:
        begin_first_stage(K)
        K.cascade.stage = FIRST_STAGE
        return SOLVE
    else:
        compliance(task, terms, K.chain, qp, turned, ratio)
    if terms.shared:
        share(K, 1.0 / softness(task, terms, K.chain, qp, ratio))
    return QP_READY


@jit
def _turn(K: Any, settling: bool) -> None:
    """Posture criterion and directional damping, where the planner has them; settling without the latter."""
    if K.criteria.manipulability != 0.0 and not K.settling.gradient_suppressed:
        add_manipulability(K)
    K.turned.on = 0
    if K.turned.factor > 0.0 and not settling:
        turn_rows(K)


@jit
def _follow(K: Any, valid: bool) -> int:
    """The task's QP, led by the clock, whatever terms the planner has; needs intervals and the rows of C."""
    if not may_go_on_by_the_clock(K, valid):
        return SOLVE
    objective(K)
    task_rows(K, K.task.kp)
    settling = settles(K, K.task.kp)
    _turn(K, settling)
    if settling:
        begin_settling(K, K.task.kp)
        K.cascade.stage = SETTLING_STAGE
        return SOLVE
    return _ask(K)


@part_jit
def prepare(K: Any) -> int:
    """A tick led by the clock: QP_READY when the QP is the task's, SOLVE when it is another."""
    valid = _see(K)
    _bound(K)
    _limit(K)
    return _follow(K, valid)


@part_jit
def prepare_on_path(K: Any, path: Any) -> int:
    """A tick led by the progress along a path."""
    task, qp = K.task, K.qp
    K.task.late = 0  # rows are given up by who leads
    valid = _see(K)
    _bound(K)
    _limit(K)
    if not may_go_on(K, valid):
        return SOLVE
    motion(K, K.state)
    begin_on_path(K, path)
    objective(K)
    blocked = stand_still(task, K.settling, path)
    task_rows(K, task.kp)
    outlook(K, path)
    if path.driven:
        add_drive(K, path)
    settling = waits(K, path) and settles(K, task.kp)
    path_rows(K, path)
    if K.criteria.manipulability != 0.0 and not K.settling.gradient_suppressed:
        add_manipulability(K)
    fade_feedback(K, path)
    K.cascade.stage = SETTLING_STAGE if settling else MAIN_STAGE
    assign(task.asked, qp.b, task.m)
    ratio = task.slack_ratio if settling or blocked or path.aside > 0.0 else STIFFNESS
    compliance(task, K.terms, K.chain, qp, K.turned, ratio)
    rate_variable(K, path)
    if settling:
        begin_settling_on_path(K, path, task.kp)
        return SOLVE
    end_settling(qp, K.settling)
    if K.terms.shared:
        share(K, 1.0 / softness(task, K.terms, K.chain, qp, ratio))
    return QP_READY


@part_jit
def prepare_on_base(K: Any, base: Any) -> int:
    """A tick led by an inertial target above a base that moves."""
    K.task.late = 0  # rows are given up by who leads
    valid = _see_as_measured(K)
    if not follow_base(K, base):
        valid = False
    _bound(K)
    if base.anti_windup:
        reduce_by_lead(K.state, K.faults, K.limits, K.qp, base)
    _limit(K)
    if not may_go_on_as_measured(K, valid):
        return SOLVE
    objective(K)
    kp = base.gain / K.state.dt
    task_rows(K, kp)
    settling = settles(K, kp)
    _turn(K, settling)
    if settling:
        begin_settling(K, kp)
        K.cascade.stage = SETTLING_STAGE
        return SOLVE
    return _ask(K)


@part_jit
def prepare_free(K: Any, F: Any) -> int:
    """A tick of an arm with a free-swinging joint: its policy in the place of the task.

    Where gravity does not move the joint, the task is followed, with the joint's row and its end stop; where
    it is only measured, with neither.
    """
    valid = _see(K)
    if K.faults.movable == K.faults.working:
        _bound(K)
        _limit(K)
        return _follow(K, valid)
    search_step(K, F)
    forward_kinematics(K, K.state)
    _bound(K)
    _limit(K)
    if K.free.mode == FOLLOW:
        end_stops(K, K.state.a_command if K.state.level == ACCELERATION else K.state.v_command)
        return _follow(K, valid)
    K.task.has_tip_measured = 0
    pose_error(K)
    task_error(K.task, K.feedback, K.kinematics, K.past)
    task_rows(K, K.task.kp)
    K.turned.on = 0
    settle(K.settling, TASK_LEFT, K.state.dt)
    begin_rest(K, K.state.dt, 0.0)
    K.cascade.stage = REST_STAGE
    ask_for_motion(K, F)
    K.cascade.outcome = outcome_beside_free(K) if valid else INVALID_INPUT
    return SOLVE


@part_jit
def prepare_on_joints(K: Any, joints: Any) -> int:
    """A tick led by a motion of the joints: no task rows, the tip's target is where the motion puts it."""
    K.task.late = K.task.held = 0  # rows are given up by who leads
    valid = _see(K)
    aim_at_reference(K, joints)
    _bound(K)
    _limit(K)
    if not may_go_on(K, valid):
        return SOLVE
    task_rows(K, K.task.kp)
    joint_objective(K, joints)
    K.turned.on = 0
    K.cascade.stage = MAIN_STAGE
    return QP_READY
