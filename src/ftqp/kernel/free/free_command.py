"""What the healthy joints of an arm with a free-swinging joint do in this tick, and what is said of it."""

from math import inf
from typing import Any

from ftqp.kernel.free.end_stop import end_stops, free_motion
from ftqp.kernel.free.holding import led
from ftqp.kernel.free.look_ahead import planned, shift_plan
from ftqp.kernel.free.swinging import braked
from ftqp.kernel.jit import jit
from ftqp.kernel.latches.stop_latch import slow_enough
from ftqp.kernel.layout.enums import (
    ARREST,
    HOLD,
    OK,
    POSE_KEPT,
    POSITION_KEPT,
    RELAXED,
    STOPPED,
    STOPPING,
    VELOCITY,
)
from ftqp.kernel.layout.thresholds import FREE_SHARE
from ftqp.kernel.rows.one_variable import draw

REACHED, ATTAINED = 0.01, 0.05
"""A tip that is nearer to its target than this counts as there [m] and [rad]."""


@jit
def _wanted(state: Any, faults: Any, limits: Any, kinematics: Any, free: Any, F: Any) -> None:
    """The accelerations of the healthy joints into ``F.a``."""
    mode, dt = free.mode, state.dt
    if mode == HOLD:
        led(state, faults, limits, kinematics, F, dt)
    for k in range(faults.working):
        j = faults.order[k]
        if mode == ARREST:
            F.a[j] = planned(state, limits, F, j, F.phase, F.left, dt)
        elif mode != HOLD:
            F.a[j] = braked(state, limits, j, dt)


@jit
def ask_for_motion(K: Any, F: Any) -> None:
    """1/2 |x - x_wanted|^2 over box, torque rows and end stop; needs ``begin_rest`` and the rows of C."""
    faults, state, qp = K.faults, K.state, K.qp
    _wanted(state, faults, K.limits, K.kinematics, K.free, F)
    for k in range(faults.working):
        j = faults.order[k]
        x = F.a[j] if state.level != VELOCITY else state.v[j] + state.dt * F.a[j]
        F.x[j] = x
        draw(qp, j, 1.0, x)
    for k in range(faults.working, K.chain.n):
        j = faults.order[k]
        F.x[j] = qp.lb[j] if k >= faults.movable else (state.v[j] if state.level == VELOCITY else 0.0)
    end_stops(K, F.x)
    for k in range(faults.working, faults.movable):
        i = faults.order[k]
        draw(qp, i, FREE_SHARE, free_motion(K.chain, qp, i, F.x) if qp.lb[i] < qp.ub[i] else 0.0)
    if K.free.mode == ARREST:
        F.left -= F.dt
        shift_plan(F, K.chain.n)


@jit
def outcome_beside_free(K: Any) -> int:
    """STOPPING and STOPPED where the task is given up, OK where nothing of it is, else RELAXED."""
    limits, faults, state, task, free = K.limits, K.faults, K.state, K.task, K.free
    if K.watch.latched:
        if free.mode == ARREST:
            return STOPPING
        slow = slow_enough(K)
        for k in range(faults.movable if free.mode == HOLD else faults.working):
            j = faults.order[k]
            top = limits.v_max[j] if limits.v_max[j] < inf else 1.0
            if abs(state.v[j]) > slow * top:
                return STOPPING
        K.watch.stopped = 1
        return STOPPED
    whole = free.rows == POSE_KEPT or (free.rows == POSITION_KEPT and not task.uses_rotation)
    whole = whole or (free.rows > POSITION_KEPT and task.tool_rows)
    near = task.position_error <= REACHED and task.rotation_error <= ATTAINED
    return OK if free.mode == HOLD and whole and near and not K.feedback.lagging else RELAXED
