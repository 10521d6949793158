"""Stops that a planner is asked for, and what ends them."""

from math import inf
from typing import Any

import numpy as np

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, mimic, mimic_places, motion
from ftqp.kernel.commands.believed import look_again, swing_as_foretold
from ftqp.kernel.commands.surroundings import begin_terms
from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.latches.settling import ask_for_brake, forget_settling, latch, restore
from ftqp.kernel.layout.enums import (
    ALL_BRAKES,
    AS_STATED,
    NOT_STOPPED,
    STOPPED_BY_FREE_JOINT,
    STOPPED_BY_OVERLOAD,
)
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.monitor.servos import forget_servos


@jit
def stop(watch: Any, reason: int) -> None:
    """Latch a stop; the reason of one that is latched stays, unless that one ends by itself."""
    if watch.latched == 0 or watch.reason == STOPPED_BY_FREE_JOINT:
        latch(watch, reason)


@jit
def release(watch: Any, feedback: Any, chain: Any) -> None:
    """No stop is latched, and nothing is known of the last one."""
    watch.stopped = watch.rising = watch.fallbacks = 0
    feedback.moving = 0
    feedback.going[: chain.n] = 0.0
    watch.last_position_error = watch.last_rotation_error = inf
    watch.left = 0.0
    watch.latched = 0  # the last thing, so that whoever is interrupted has still stopped
    watch.reason = NOT_STOPPED


@jit
def resume(watch: Any, feedback: Any, chain: Any) -> bool:
    """Release a stop; False while a lost sensor, or the brake of the whole arm, forbids it."""
    for i in range(chain.n):
        if feedback.lost[i] or (feedback.brakes == ALL_BRAKES and feedback.asks[i]):
            return False
    feedback.spent_elsewhere = 0.0
    feedback.far = 0
    feedback.spent[: chain.n] = 0.0
    release(watch, feedback, chain)
    return True


@jit
def hold_up(K: Any, A: Any, i: int) -> bool:
    """Whether joint i is too weak for the arm's weight; its brake is then asked for, and the arm stopped."""
    if K.state.is_reset == 0 or not K.limits.tau_max[i] < inf:
        return False
    for j in range(K.chain.n):
        A.state.q[j], A.state.v[j] = K.state.q_command[j], 0.0
    forward_kinematics(A, A.state)
    motion(A, A.state)
    dynamics(A, A.state)
    if not abs(A.kinematics.h[i]) > K.limits.tau_max[i]:
        return False
    if K.watch.latched == 0 and K.watch.stop_samples > 0:
        latch(K.watch, STOPPED_BY_OVERLOAD)
    ask_for_brake(K.watch, K.feedback, i)
    return True


@jit
def forget_distances(scene: Any) -> None:
    """No row keeps bodies apart, and every pair is looked at anew."""
    scene.nearest = -1
    scene.held = 0
    scene.slot[:] = -1
    look_again(scene)
    scene.gap[:] = -inf


@jit
def start(K: Any, given: Any, q: Any, v: Any) -> None:
    """Begin at (q, v): no stop is latched, and nothing is known of the arm but that."""
    state, gate = K.state, K.gate
    forget_servos(K)
    for i in range(K.chain.n):
        gate.q[i] = state.q_command[i] = state.q[i] = q[i]
        gate.sent[i] = q[i] + K.monitor.stated_lead[i] * v[i]
        gate.v[i] = gate.speed[i] = state.v_command[i] = state.v[i] = v[i]
        state.a_command[i] = 0.0
        K.monitor.counted[i] = K.monitor.found[i]
        K.criteria.posture[i] = given.posture[i] if given.has_posture else q[i]
    if K.chain.mimics:
        for places in (state.q, state.q_command, gate.q, gate.sent):
            mimic_places(K.chain, places)
        for speeds in (state.v, state.v_command, gate.v):
            mimic(K.chain, speeds)
    K.qp.warm = state.ticks = 0
    state.is_reset = 1
    release(K.watch, K.feedback, K.chain)
    K.feedback.fresh = AS_STATED
    swing_as_foretold(K)
    forget_settling(K.settling)
    if K.scene.pairs > 0:
        forget_distances(K.scene)
    restore(K.task, K.terms, K.qp)
    begin_terms(K, given)


@jit
def begin(path: Any) -> None:
    """The progress at 0 and its rate not yet known, free to run at full speed."""
    path.progress = 0.0
    path.rate = -1.0
    path.limit = 1.0
    path.aside = 0.0
    path.speed = 0.0
    path.driven = path.found = 0


WORD = np.dtype(np.int64)


@jit
def write_together(table: Any) -> None:
    """Words from some places to others, (rows, 3) of addresses to and from and how many."""
    for k in range(len(table)):
        to = carray(pointer(table[k, 0]), (table[k, 2],), WORD)
        given = carray(pointer(table[k, 1]), (table[k, 2],), WORD)
        assign(to, given, table[k, 2])
