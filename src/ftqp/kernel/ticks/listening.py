"""A tick of the monitor beside somebody else's planner: what was measured, and what is then sent."""

from typing import Any

from ftqp.kernel.feedback.held import watch_arm
from ftqp.kernel.feedback.learned_inertia import is_known, learn
from ftqp.kernel.feedback.monitor import monitor
from ftqp.kernel.feedback.observer import dynamics_at_estimate, observe
from ftqp.kernel.feedback.reference import leave_margin
from ftqp.kernel.feedback.samples import believe, slot
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import AS_STATED, TORQUE_DRIVE
from ftqp.kernel.layout.thresholds import SUSPECTS
from ftqp.kernel.monitor.servos import forget_servos
from ftqp.kernel.monitor.watching import watch_servos
from ftqp.kernel.rows.failed_joints import sort_joints

QUIET, WATCHING, FOUND = 0, 1, 2
"""What a tick answers: nothing to see, a suspicion, something that was found or withdrawn."""


@jit
def _begin(K: Any, q: Any) -> None:
    """Nothing is known of the arm but that it stands at q."""
    forget_servos(K)
    for i in range(K.chain.n):
        K.state.q_command[i] = K.gate.q[i] = K.gate.sent[i] = q[i]
        K.state.v_command[i] = K.state.a_command[i] = K.gate.v[i] = K.gate.speed[i] = 0.0
    K.state.ticks, K.state.is_reset = 0, 1
    K.feedback.fresh = AS_STATED


@jit
def _send(K: Any, reference: Any, tau: Any) -> None:
    """What goes to the arm until the next tick."""
    state, past, now = K.state, K.past, K.feedback.now
    for i in range(K.chain.n):
        state.q_command[i] = K.gate.q[i] = K.gate.sent[i] = reference[0, i]
        state.v_command[i] = K.gate.v[i] = K.gate.speed[i] = reference[1, i]
        state.a_command[i] = past.a[now, i] = reference[2, i]
        K.feedback.tau_sent[i] = past.tau[now, i] = tau[i]


@jit
def listen(K: Any, q: Any, reference: Any, tau: Any) -> int:
    """A tick: samples, (n,), and then the reference at its end, (3, n), and the torques that are sent, (n,).

    A suspicion is 1, news of a joint 2, and all else 0.
    """
    state, feedback = K.state, K.feedback
    if state.is_reset == 0:
        _begin(K, reference[0])
    state.ticks += 1
    sort_joints(K.faults, K.chain)
    for i in range(K.chain.n):
        state.q[i], state.v[i] = q[i], 0.0
    feedback.active = 1
    first, as_stated = feedback.fresh != 0, feedback.fresh == AS_STATED
    believe(K)
    watch_arm(K, first)
    observe(K, first)
    watch_servos(K, first, slot(feedback, feedback.latency), is_known(K.state, K.learned))
    if feedback.kind == TORQUE_DRIVE:
        if not K.held.on:
            learn(K, as_stated, first)
        dynamics_at_estimate(K)
    if not K.held.on:
        monitor(K)
    leave_margin(K.faults, feedback, K.chain, K.past)
    K.watch.latched = 0
    _send(K, reference, tau)
    if K.monitor.news:
        K.monitor.news = 0
        return FOUND
    return WATCHING if K.monitor.worst > SUSPECTS else QUIET
