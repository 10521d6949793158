"""A planner begins anew: everything but what is believed is forgotten."""

from math import inf
from typing import Any

from ftqp.kernel.arm.mimicry import mimic, mimic_places
from ftqp.kernel.jit import jit
from ftqp.kernel.latches.giving_up import restore
from ftqp.kernel.latches.settling import forget_settling
from ftqp.kernel.layout.enums import AS_TOLD
from ftqp.kernel.told.believed import look_again, swing_as_foretold
from ftqp.kernel.told.stops import release


@jit
def forget_distances(scene: Any) -> None:
    """No row keeps bodies apart, and every pair is looked at anew."""
    scene.nearest = -1
    scene.held = 0
    for k in range(len(scene.slot)):
        scene.slot[k] = -1
    look_again(scene)
    for k in range(len(scene.gap)):
        scene.gap[k] = -inf


@jit
def start(K: Any, given: Any, q: Any, v: Any) -> None:
    """Begin at (q, v): no stop is latched, and nothing is known of the arm but that.

    Args:
        K: the rooms of the record.
        given: what the planner was made with.
        q: joint positions, (n,) [rad or m].
        v: joint velocities, (n,) [rad/s or m/s].
    """
    state, gate = K.state, K.gate
    for i in range(K.chain.n):
        gate.q[i] = state.q_command[i] = state.q[i] = q[i]
        gate.sent[i] = q[i] + gate.lead * v[i]
        gate.v[i] = gate.speed[i] = state.v_command[i] = state.v[i] = v[i]
        state.a_command[i] = 0.0
        K.criteria.posture[i] = given.posture[i] if given.has_posture else q[i]
    if K.chain.mimics:
        for places in (state.q, state.q_command, gate.q, gate.sent):
            mimic_places(K.chain, places)
        for speeds in (state.v, state.v_command, gate.v):
            mimic(K.chain, speeds)
    K.qp.warm = state.ticks = 0
    state.is_reset = 1
    release(K.watch, K.feedback, K.chain)
    K.feedback.fresh = AS_TOLD
    swing_as_foretold(K)
    forget_settling(K.calm)
    if K.scene.pairs > 0:
        forget_distances(K.scene)
    restore(K.task, K.terms, K.qp)
