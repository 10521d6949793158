"""A planner begins anew: everything but what is believed is forgotten."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.latches.settling import forget_settling
from ftqp.kernel.layout.enums import AS_TOLD
from ftqp.kernel.told.giving_up import restore
from ftqp.kernel.told.stops import release


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
        gate.v[i] = state.v_command[i] = state.v[i] = v[i]
        state.a_command[i] = 0.0
        K.criteria.posture[i] = given.posture[i] if given.has_posture else q[i]
    K.qp.warm = state.ticks = 0
    state.is_reset = 1
    release(K.watch, K.feedback, K.chain)
    K.feedback.fresh = AS_TOLD
    forget_settling(K.calm)
    restore(K.task, given)
