"""Rows that keep a joint that has lost torque where that suffices to hold the arm."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.dynamics import gravity_torque
from ftqp.kernel.arm.kinematics import fold_row
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.latches.settling import ask_for_brake
from ftqp.kernel.layout.enums import ACCELERATION, HEALTHY, VELOCITY
from ftqp.kernel.layout.rows import CLEARANCES
from ftqp.kernel.rows.joint_intervals import RETURN_GAIN, braking_velocity

RESERVE = 0.03
"""Share of the torque with which motions are planned that is left for accelerations where the arm is held:
with none, joints that a weak one couples with had to swing to move it. A guess."""
LEAST_SLOPE = 1e-9
"""Where gravity's torque changes with posture by less than this share of the limit a radian, it is constant.
Rounding."""


@jit
def holding_rate(d: float, reserve: float, brake: float, cost: float, dt: float) -> float:
    """How fast gravity's torque may come nearer to what holds it, from the distance d [N m/s].

    ``brake`` B is its deceleration when every joint brakes [N m/s2], which takes ``cost`` c of the joint's
    own torque [N m]. At a distance s the torque left is s and the ``reserve`` r, so that the share (s + r)/c
    of B is there, at most all of it, and from v dv = -B min(1, (s + r)/c) ds

        v^2 = 2 B d (r + d/2)/c           where d + r < c,
        v^2 = 2 B (d - (c - r)^2/(2 c))   beyond; 2 B d where r > c.

    Without a reserve it is v = d sqrt(B/c), from which an inverted pendulum can be caught.
    Source: docs/theory/joint-limits.md, "What a weak joint can hold".
    """
    if d + reserve < cost:
        return braking_velocity(d, brake * (reserve + 0.5 * d) / cost, dt)
    lacking = max(cost - reserve, 0.0)
    if lacking > 0.0:
        d -= 0.5 * lacking * lacking / cost
    return braking_velocity(d, brake, dt)


@jit
def _torque_at_rest(K: Any, i: int, slope: Any, one: Any) -> float:
    """g_i and its gradient, with joints that mimic others folded."""
    kinematics, chain = K.kinematics, K.chain
    g = gravity_torque(kinematics, chain, i, slope)
    if chain.mimics == 0:
        return g
    for m in range(chain.n):
        if m != i and chain.lead[m] == i:
            g += chain.ratio[m] * gravity_torque(kinematics, chain, m, one)
            for j in range(chain.n):
                slope[j] += chain.ratio[m] * one[j]
    fold_row(chain, slope)
    return g


@jit
def _most(
    state: Any, d: float, reserve: float, rate: float, brake: float, cost: float, hardest: float, back: float
) -> float:
    """The largest x along the gradient, from d [N m] and how fast that shrinks; below 0 ``back`` times d."""
    dt = state.dt
    ahead = d - 0.5 * dt * rate if state.level == ACCELERATION else d
    most = back * ahead if ahead < 0.0 else holding_rate(ahead, reserve, brake, cost, dt)
    change = max((most - rate) / dt, -hardest)
    return change if state.level == ACCELERATION else rate + dt * change


@rare_jit
def fill(K: Any, at: int) -> int:
    """l <= grad g_i x/|grad g_i| <= u, one row a joint from row ``at`` of C on; the next free row.

    None where no joint has lost torque, and for another solver, whose QP keeps its size. In a stop a joint
    asks for its brake where its motor cannot hold the arm, before it has fallen.
    """
    limits, faults, state, chain, qp = K.limits, K.faults, K.state, K.chain, K.qp
    if limits.weakened == 0 or K.cascade.external:
        return at
    n, M = chain.n, K.kinematics.M
    back = 0.0 if K.watch.latched else RETURN_GAIN  # a stop leads nobody back
    for i in range(n):
        row = qp.C[at + i]
        row[: n + 1] = 0.0
        qp.l[at + i], qp.u[at + i] = -inf, inf
        hold, reserve = limits.tau_hold[i], RESERVE * limits.tau_hold[i]
        if not hold < inf or K.feedback.asks[i]:
            continue
        g = _torque_at_rest(K, i, row, K.scratch.joints)
        if K.watch.latched and abs(g) > limits.tau_max[i]:
            ask_for_brake(K.watch, K.feedback, i)
        rate = square = brake = cost = hardest = 0.0
        for j in range(n):
            rate += row[j] * state.v[j]
            if faults.code[j] != HEALTHY:
                continue
            square += row[j] * row[j]
            brake += abs(row[j]) * limits.a_brake[j]
            hardest += abs(row[j]) * limits.a_max[j]
            cost += max(0.0, -M[i, j] if row[j] > 0.0 else M[i, j]) * limits.a_brake[j]
        scale = sqrt(square)
        if scale <= LEAST_SLOPE * hold:
            row[:n] = 0.0
            continue
        for j in range(n):
            row[j] /= scale
        most = _most(state, hold - reserve - g, reserve, rate, brake, cost, hardest, back)
        least = -_most(state, hold - reserve + g, reserve, -rate, brake, cost, hardest, back)
        if least > most:  # beyond one end, and too fast to stop before the other: it brakes
            least, most = (most, most) if rate > 0.0 else (least, least)
        qp.l[at + i], qp.u[at + i] = least / scale, most / scale
    return at + n


@jit
def _first(K: Any) -> int:
    """The place of the first of these rows in C, behind those of every tick."""
    return int(K.qp.yields_from) + (CLEARANCES if K.scene.pairs > 0 else 0)


@rare_jit
def leave_to_motors(K: Any) -> None:
    """Leave these rows out, and let joints that have lost torque use all that they have left.

    This goes before a motor's own limit has to give way: what a plan keeps back is no reason to ask more of
    a motor than it has.
    """
    limits, qp, n = K.limits, K.qp, K.chain.n
    if limits.weakened == 0 or qp.nc < n:
        return
    qp.nc = min(qp.nc, _first(K))
    scale = K.state.dt if K.state.level == VELOCITY else 1.0
    for i in range(n):
        if limits.tau_hold[i] < inf and qp.u[i] < inf:
            middle, most = 0.5 * (qp.l[i] + qp.u[i]), scale * limits.tau_max[i]
            qp.l[i], qp.u[i] = min(qp.l[i], middle - most), max(qp.u[i], middle + most)


@rare_jit
def keep_again(K: Any) -> None:
    """These rows again, after they were left out."""
    if K.limits.weakened > 0 and K.qp.nc > 0:
        K.qp.nc = fill(K, _first(K))
