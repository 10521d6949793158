"""The first half of a tick, from measured state to a QP; the second is ``ftqp.kernel.judge.ladder``."""

from math import atan2, pi
from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.arm.pose_error import pose_error
from ftqp.kernel.jit import jit
from ftqp.kernel.judge.ladder import begin_first_stage, begin_stop
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    HARD,
    INVALID_INPUT,
    LEXICOGRAPHIC,
    MAIN_STAGE,
    READY,
    SCALE,
    SOLVE,
    TARGET_HAS_ROTATION,
)
from ftqp.kernel.maths.finite import is_finite
from ftqp.kernel.rows.failed_joints import any_instant_lock, lock_instantly, prescribed_motion
from ftqp.kernel.rows.inertial_target import follow_base, reduce_by_lead
from ftqp.kernel.rows.joint_intervals import intervals
from ftqp.kernel.rows.manipulability import add_manipulability
from ftqp.kernel.rows.objective import add_drive, objective
from ftqp.kernel.rows.path_rows import STIFFNESS, begin_on_path, rate_variable
from ftqp.kernel.rows.task_rows import compliance, error_norms, path_scale, task_rows
from ftqp.kernel.rows.torque_rows import add_torques
from ftqp.kernel.rows.turned_rows import fade_feedback, turn_rows

SCALE_STAGE_RATIO = 1e-7
"""Scaled mode: compliance of the rows that keep the direction."""


@jit
def accept_state(K: Any, q: Any, v: Any) -> None:
    """Copy the measured state; q is (n,) joint values or (nq,) with (cos, sin) for each continuous joint.

    An angle given by cosine and sine is unwrapped to the turn of the last command.
    """
    n = K.n
    if len(q) == n:
        for i in range(n):
            K.q[i] = q[i]
    else:
        k = 0
        for i in range(n):
            if K.continuous[i]:
                angle = atan2(q[k + 1], q[k]) - K.q_command[i]
                turns = angle / (2.0 * pi)
                whole = float(int(turns + (0.5 if turns >= 0.0 else -0.5))) if is_finite(turns) else 0.0
                K.q[i] = K.q_command[i] + angle - 2.0 * pi * whole
                if not (is_finite(q[k]) and is_finite(q[k + 1])):
                    K.q[i] = q[k] + q[k + 1]
                k += 2
            else:
                K.q[i] = q[k]
                k += 1
    for i in range(n):
        K.v[i] = v[i]


@jit
def _inputs_are_finite(K: Any) -> bool:
    """Whether all inputs are finite; a q or v that is not gives way to the last command.

    Number by number: fast math may fold a sum of x - x into zero, NaN or not.
    """
    good = True
    for i in range(K.n):
        good = good and is_finite(K.q[i]) and is_finite(K.v[i])
    if not good:
        for i in range(K.n):
            K.q[i] = K.q_command[i]
            K.v[i] = K.v_command[i]
    for k in range(TARGET_HAS_ROTATION):
        good = good and is_finite(K.target[k])
    if K.has_tip_measured:
        for r in range(4):
            for c in range(4):
                good = good and is_finite(K.tip_measured[r, c])
    return good


@jit
def _emergency(K: Any) -> bool:
    """Latch when the task error is beyond its threshold and has risen on ``stop_samples`` samples."""
    e, r = K.position_error, K.rotation_error
    beyond = (e > K.stop_position and e > K.last_position_error) or (
        r > K.stop_rotation and r > K.last_rotation_error
    )
    K.rising = K.rising + 1 if beyond else 0
    K.last_position_error, K.last_rotation_error = e, r
    if K.stop_samples > 0 and K.rising >= K.stop_samples:
        K.latched = 1
    return K.latched != 0


@jit
def prepare(K: Any) -> int:
    """Everything up to the first QP of the ladder: READY when that is the task's, SOLVE when it is another.

    Order: state check, prescribed motion of failed joints, kinematics, bounds, torque rows, errors, stop
    test, objective,
    task rows.
    """
    K.ticks += 1
    K.soft_rows = 0.0
    K.claim = -1
    K.qp_iterations = 0
    K.torque_excess = 0.0
    valid = _inputs_are_finite(K)
    forward_kinematics(K)
    if K.base_moves and not follow_base(K):
        valid = False
    if any_instant_lock(K):
        motion(K)
        dynamics(K)
        lock_instantly(K)
    prescribed_motion(K)
    if K.level == ACCELERATION:
        motion(K)
    intervals(K)
    if K.base_moves and K.anti_windup:
        reduce_by_lead(K)
    K.nc = 0
    K.has_torques = 0
    if K.dynamic and K.guard == 0.0:
        add_torques(K)
    if not valid:
        begin_stop(K)
        K.verdict = INVALID_INPUT
        return SOLVE
    pose_error(K)
    error_norms(K)
    if _emergency(K):
        begin_stop(K)
        return SOLVE
    if K.on_path:
        motion(K)
        begin_on_path(K)
    objective(K)
    if K.driven:
        add_drive(K)
    task_rows(K)
    if K.manipulability != 0.0:
        add_manipulability(K)
    if K.on_path:
        fade_feedback(K)
    K.turned = 0
    if K.damping_factor > 0.0:
        turn_rows(K)
    K.stage = MAIN_STAGE
    for k in range(K.m):
        K.b_task[k] = K.b[k]
    if K.mode == HARD:
        if K.turned:
            compliance(K, 0.0)
        for k in range(K.m):
            if not K.turned or K.damp[k] == 0.0:
                K.soft[k] = 0.0
    elif K.mode == SCALE and K.on_path:
        compliance(K, STIFFNESS)
        rate_variable(K)
    elif K.mode == SCALE:
        compliance(K, SCALE_STAGE_RATIO)
        path_scale(K)
    elif K.mode == LEXICOGRAPHIC:
        begin_first_stage(K)
        return SOLVE
    else:
        compliance(K, K.slack_ratio)
    return READY
