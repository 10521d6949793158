"""What a failed joint does: its motion while it is braked, and the velocity jump of an instant lock."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import (
    BRAKING,
    INSTANT,
    LOCKED,
    RESET_MOMENTUM,
    RESET_TASK,
    VELOCITY,
)
from ftqp.kernel.maths.cholesky import factor, solve_factored


@jit
def prescribed_motion(K: Any) -> None:
    """x_F of every locked or braking joint, as the degenerate interval lb = ub.

    Braking: x_F = -sign(v_F) min(rate, |v_F|/dt) until v_F is exactly zero, the last step partial; then
    locked, for ever.
    v_F follows that model, or the measured velocity where the joint stops sooner, so that noise cannot keep
    it braking.
    """
    dt = K.dt
    for i in range(K.n):
        fault = K.fault[i]
        if fault == BRAKING:
            vf = K.lock_velocity[i]
            if abs(K.v[i]) < abs(vf):
                vf = K.v[i]
            if vf == 0.0:
                K.fault[i] = LOCKED
                fault = LOCKED
            else:
                step = K.lock_rate[i] * dt
                after = 0.0 if abs(vf) <= step else (vf - step if vf > 0.0 else vf + step)
                x = after if K.level == VELOCITY else (after - vf) / dt
                K.v[i] = vf
                K.lock_velocity[i] = after
                K.lb[i] = K.ub[i] = x
        if fault == LOCKED:
            K.v[i] = 0.0
            K.lock_velocity[i] = 0.0
            K.lb[i] = K.ub[i] = 0.0


@jit
def any_instant_lock(K: Any) -> bool:
    """Whether a joint is to be locked at this very tick."""
    for i in range(K.n):
        if K.fault[i] == INSTANT:
            return True
    return False


@jit
def lock_instantly(K: Any) -> None:
    """v_F := 0 and the velocities of the healthy joints by the reset rule; Delta is the change of v.

    kinematic: unchanged.  momentum: Delta_H = -M_HH^-1 M_HF Delta_F (free impulse).
    task: Delta_H = -J_H^+ J_F Delta_F (the task velocity goes on). Needs J, and M for ``momentum``.
    Source: spec of the different-level scheme, section 5.2. Rare, so it borrows the solver's memory.
    """
    n = K.n
    delta, S = K.scratch, K.L_H
    for i in range(n):
        delta[i] = 0.0
        if K.fault[i] == INSTANT:
            delta[i] = -K.v[i]
    if K.reset_mode == RESET_MOMENTUM:
        for i in range(n):
            healthy = not (K.fault[i] == INSTANT or K.fault[i] == LOCKED or K.fault[i] == BRAKING)
            s = 0.0
            for j in range(n):
                s -= K.M[i, j] * delta[j]
                also = not (K.fault[j] == INSTANT or K.fault[j] == LOCKED or K.fault[j] == BRAKING)
                S[i, j] = K.M[i, j] if healthy and also else (1.0 if i == j else 0.0)
            K.x_free[i] = s if healthy else 0.0
        if factor(S, n):
            solve_factored(S, n, K.x_free)
            for i in range(n):
                K.v[i] += K.x_free[i]
    if K.reset_mode == RESET_TASK:
        m = K.m
        for a in range(m):
            ra = K.rows[a]
            s = 0.0
            for j in range(n):
                s -= K.J[ra, j] * delta[j]
            K.x_free[a] = s
        trace = 0.0
        for a in range(m):
            for b in range(m):
                s = 0.0
                for j in range(n):
                    if not (K.fault[j] == INSTANT or K.fault[j] == LOCKED or K.fault[j] == BRAKING):
                        s += K.J[K.rows[a], j] * K.J[K.rows[b], j]
                S[a, b] = s
            trace += S[a, a]
        for a in range(m):
            S[a, a] += 1e-12 * trace
        if factor(S, m):
            solve_factored(S, m, K.x_free)
            for j in range(n):
                if not (K.fault[j] == INSTANT or K.fault[j] == LOCKED or K.fault[j] == BRAKING):
                    s = 0.0
                    for a in range(m):
                        s += K.J[K.rows[a], j] * K.x_free[a]
                    K.v[j] += s
    for i in range(n):
        if K.fault[i] == INSTANT:
            K.v[i] = 0.0
            K.fault[i] = LOCKED
