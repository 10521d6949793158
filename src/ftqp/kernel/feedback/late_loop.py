"""Ticks that a late loop has missed: what is expected of the arm then, and what was asked of it.

They are made up for before the tick that comes late, so that the command is where it would be had the loop
been on time, and keeps every limit over the gap. Nothing was measured at them: as where samples are refused,
feedback is off, but no sensor is to blame.
Source: docs/theory/feedback.md, "Late loops".
"""

from typing import Any

from ftqp.kernel.arm.pose_error import exponential
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import (
    HEALTHY,
    NOTHING_HEARD,
    TARGET_ACCELERATION,
    TARGET_HAS_ROTATION,
    TARGET_SIZE,
    TARGET_TWIST,
)


@jit
def expected_sample(K: Any, q: Any) -> None:
    """Where the sensors will see the joints at the next tick if nothing befalls them, (n,) [rad or m]."""
    feedback, past, gate = K.feedback, K.past, K.gate
    for i in range(K.chain.n):
        if K.faults.code[i] != HEALTHY:
            q[i] = feedback.seen[i] + K.state.dt * feedback.v_hat[i]
        elif feedback.fresh:
            q[i] = gate.q[i]
        elif feedback.latency == 0:
            q[i] = gate.q[i] + feedback.offset[i]
        else:
            q[i] = past.q[slot(feedback, feedback.latency - 1), i] + feedback.offset[i]


@jit
def target_before(target: Any, t: float, turn: Any, out: Any) -> None:
    """A target as it was a time t ago, its twist V and acceleration A given.

    p - t v + t^2/2 a,  exp(-t w + t^2/2 alpha) R,  V - t A

    Args:
        target: packed, (29,).
        t: the time [s].
        turn: memory, (9,).
        out: the packed target of then.
    """
    for k in range(TARGET_SIZE):
        out[k] = target[k]
    half = 0.5 * t * t
    for r in range(3):
        out[4 * r + 3] += half * target[TARGET_ACCELERATION + r] - t * target[TARGET_TWIST + r]
    if target[TARGET_HAS_ROTATION] > 0.0:
        exponential(
            half * target[TARGET_ACCELERATION + 3] - t * target[TARGET_TWIST + 3],
            half * target[TARGET_ACCELERATION + 4] - t * target[TARGET_TWIST + 4],
            half * target[TARGET_ACCELERATION + 5] - t * target[TARGET_TWIST + 5],
            turn,
        )
        for r in range(3):
            for c in range(3):
                out[4 * r + c] = (
                    turn[3 * r] * target[c]
                    + turn[3 * r + 1] * target[4 + c]
                    + turn[3 * r + 2] * target[8 + c]
                )
    for k in range(6):
        out[TARGET_TWIST + k] -= t * target[TARGET_ACCELERATION + k]


@jit
def miss(K: Any, target: Any, left: int, q: Any, out: Any) -> None:
    """Let the next tick be one that was missed, ``left`` periods before the one that comes late.

    After it samples may differ from what was expected by what an arm that held its last command is behind,
    for as many ticks as were missed.

    Args:
        K: the rooms of the record.
        target: that of the tick that comes late, packed, (29,).
        left: how many periods before.
        q: what is expected to be seen, (n,).
        out: the target of the missed tick, packed, (29,).
    """
    expected_sample(K, q)
    target_before(target, left * K.state.dt, K.history.turn, out)
    K.state.unusable = NOTHING_HEARD
    K.feedback.wide = max(K.feedback.wide, (2.0 * left + 1.5) * K.state.dt)
