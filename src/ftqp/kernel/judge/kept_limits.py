"""Which limits are not kept: joints beyond their own, and motors that are asked for more than they have."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FREE, HEALTHY
from ftqp.kernel.layout.thresholds import NEARER, OUTSIDE_FROM
from ftqp.kernel.maths.elementary import any_of
from ftqp.kernel.maths.side_by_side import WIDTH, is_set, several


@jit
def is_beyond_range(K: Any, i: int) -> bool:
    """Whether joint i is beyond its range as believed, a failed one beyond its healthy range."""
    limits, q = K.limits, K.state.q[i]
    return bool(q < limits.q_min[i] - OUTSIDE_FROM or q > limits.q_max[i] + OUTSIDE_FROM)


@jit
def is_too_fast(K: Any, i: int) -> bool:
    """Whether joint i moves faster than its limit as believed."""
    return bool(abs(K.state.v[i]) > K.limits.v_max[i] * (1.0 + OUTSIDE_FROM))


@jit
def joints_outside(K: Any) -> int:
    """How many joints are beyond their range, or work and are faster than their limit."""
    limits, faults, state = K.limits, K.faults, K.state
    count = 0
    for at in range(0, K.chain.n, WIDTH):
        q, v = several(state.q, at), several(state.v, at)
        beyond = (q < several(limits.q_min, at) - OUTSIDE_FROM) | (
            q > several(limits.q_max, at) + OUTSIDE_FROM
        )
        fast = abs(v) > several(limits.v_max, at) * (1.0 + OUTSIDE_FROM)
        if any_of(beyond | (fast & ~is_set(faults.code, at))):
            for i in range(at, min(at + WIDTH, K.chain.n)):
                if is_beyond_range(K, i) or (faults.code[i] == HEALTHY and is_too_fast(K, i)):
                    count += 1
    return count


@jit
def too_near(K: Any) -> int:
    """Whether bodies are nearer than they are to be kept, or more pairs are near than have rows."""
    scene = K.scene
    return 1 if scene.pairs > 0 and (scene.crowded or scene.distance < scene.keep - NEARER) else 0


@jit
def torque_excess(K: Any) -> float:
    """By how much the command breaks what is believed of the motors [N m or N], over all joints.

    max(|tau_i| - tau_max_i, 0) of a motor that works; |tau_i + friction_i v_i| of a joint that swings freely,
    all friction with v after the step as in its row: whatever it is, no motor gives it.
    Coulomb friction may carry some of it, an end stop everything.
    """
    chain, faults, limits, state, kinematics = K.chain, K.faults, K.limits, K.state, K.kinematics
    worst = 0.0
    for i in range(chain.n):
        if faults.code[i] == HEALTHY:
            worst = max(worst, abs(state.tau[i]) - limits.tau_max[i])
        elif faults.code[i] == FREE and not K.free.contact[i]:
            v = state.v_command[i]
            tau = kinematics.h[i] + faults.friction[i] * v + chain.viscous[i] * (v - state.v[i])
            for j in range(chain.n):
                tau += kinematics.M[i, j] * state.a_command[j]
            worst = max(worst, abs(tau) - faults.coulomb[i])
    return worst
