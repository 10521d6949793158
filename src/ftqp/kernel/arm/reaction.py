"""A body that floats, moved by the reaction of the arm that it carries: momentum stays what it is.

The generalised momenta of the floating joints are those of the whole along, or about, their axes,

    M_b1 v_b + M_b2 v_m = z_i' P of a joint that slides, z_i' (L - o_i x P) of one that turns,

with P the linear and L the angular momentum about the world's origin, which nothing changes. The arm moves in
a tick as its command says, and the body's motion is the integral of v_b along it.
Source: Umetani and Yoshida 1989, equations 7 to 10; docs/theory/further-tasks.md, "Bodies that float".
"""

from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import ACCELERATION, LOCKED
from ftqp.kernel.maths.linear_systems import factor, lu_factor, lu_solve, solve_factored
from ftqp.kernel.maths.vectors import ZERO, cross, inner, minus, three, three_from, write

FLOATS = 6
"""Joints of a body that floats."""


@jit
def _momentum(K: Any) -> None:
    """P and L, (6,), into ``scratch.rows``, from M and the axes of the state that the tick began in."""
    state, kinematics, scratch = K.state, K.kinematics, K.scratch
    S, x = scratch.square, scratch.rows
    for i in range(FLOATS):
        s = 0.0
        for j in range(K.chain.n):
            s += kinematics.M[i, j] * state.v[j]
        x[i] = s
        z, slides = three(kinematics.axis_w[i]), K.chain.prismatic[i] != 0
        write(S[i], 0, z if slides else cross(three(kinematics.o[i]), z))
        write(S[i], 3, ZERO if slides else z)
    lu_factor(S, FLOATS, scratch.impulse)
    lu_solve(S, FLOATS, scratch.impulse, x)


@jit
def _body_rate(K: Any) -> None:
    """v_b into ``scratch.joints`` at the posture and the arm's velocity in ``supposed``."""
    chain, kinematics, supposed, scratch = K.chain, K.kinematics, K.supposed, K.scratch
    P, S, x = scratch.rows, scratch.square, scratch.joints
    for i in range(FLOATS):
        supposed.v[i] = 0.0
    forward_kinematics(K, supposed)
    motion(K, supposed)
    dynamics(K, supposed)
    for i in range(FLOATS):
        p = three(P)
        if not chain.prismatic[i]:
            p = minus(three_from(P, 3), cross(three(kinematics.o[i]), p))
        s = inner(three(kinematics.axis_w[i]), p)
        for j in range(FLOATS, chain.n):
            s -= kinematics.M[i, j] * supposed.v[j]
        x[i] = s
        for j in range(i + 1):
            S[i, j] = kinematics.M[i, j]
    if factor(S, FLOATS):
        solve_factored(S, FLOATS, x)


@jit
def _suppose(K: Any, share: float, step: float) -> None:
    """The arm at a share of the tick, and the body a step along the last v_b away from where it began."""
    chain, faults, state, supposed = K.chain, K.faults, K.state, K.supposed
    for i in range(FLOATS):
        supposed.q[i] = state.q[i] + step * K.scratch.joints[i]
    for i in range(FLOATS, chain.n):
        last = state.v_command[i]
        first = state.v[i] if state.level == ACCELERATION and faults.code[i] != LOCKED else last
        change = last - first
        back = (1.0 - share) * state.dt
        supposed.q[i] = state.q_command[i] - back * (last - 0.5 * (1.0 - share) * change)
        supposed.v[i] = first + share * change


@rare_jit
def react(K: Any) -> None:
    """Where the body is after the tick, and at the acceleration level how fast, by Runge's rule.

    It takes M and the axes of the tick's own posture and leaves another M: it comes last. At the velocity
    level the body's velocity stays the QP's, M_b v = 0 where the tick began.
    """
    state, scratch = K.state, K.scratch
    dt, x, total = state.dt, K.scratch.joints, K.scratch.impulse
    accelerated = state.level == ACCELERATION
    for i in range(FLOATS):
        scratch.rows[i] = 0.0
    if accelerated:
        _momentum(K)
    for i in range(FLOATS):
        x[i] = state.v[i] if accelerated else state.v_command[i]
        total[i] = x[i]
    for k in range(3):
        _suppose(K, 0.5 if k < 2 else 1.0, 0.5 * dt if k < 2 else dt)
        _body_rate(K)
        for i in range(FLOATS):
            total[i] += (2.0 if k < 2 else 1.0) * x[i]
    for i in range(FLOATS):
        state.q_command[i] = state.q[i] + dt / 6.0 * total[i]
    if accelerated:
        for i in range(FLOATS):
            x[i] = total[i] / 6.0
        _suppose(K, 1.0, dt)
        _body_rate(K)
        for i in range(FLOATS):
            state.v_command[i] = x[i]
    forward_kinematics(K, state)
