"""The arm in a rollout: healthy joints accelerate as commanded, one swings freely between two stops."""

from math import inf
from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.linear_systems import assign, plus_products
from ftqp.kernel.rows.joint_intervals import viability

ROLLOUT_STEP = 0.01
"""Step of a rollout [s]. Long enough for 200 steps in a tenth of a millisecond, short beside the second that
a joint falls for."""


@jit
def viscous_friction(faults: Any, chain: Any, i: int) -> float:
    """d of a free joint: what is believed of its fault, and the joint's own [N m s/rad or N s/m]."""
    return faults.friction[i] + chain.viscous[i]


@jit
def free_velocity(inertia: float, drive: float, v: float, damping: float, coulomb: float, dt: float) -> float:
    """The free joint's velocity after dt when ``drive``, its friction at v counted, is what moves it.

    (M_ii + dt d) (v' - v) = dt (drive - mu sgn v'): viscous friction at the velocity after the step, and
    v' = 0 where Coulomb friction can hold the joint.
    """
    left = inertia + dt * damping
    after = v + dt * drive / left
    slowed = dt * coulomb / left
    if after > slowed:
        return after - slowed
    if after < -slowed:
        return after + slowed
    return 0.0


@jit
def within_limits(state: Any, limits: Any, i: int, a: float, dt: float) -> float:
    """The acceleration nearest to ``a`` after which joint i still keeps its limits for ever."""
    v, top, brake = state.v[i], limits.a_max[i], limits.a_brake[i]
    hi, _ = viability(v, limits.q_max[i] - state.q[i], limits.v_max[i], top, brake, dt)
    lo, _ = viability(-v, state.q[i] - limits.q_min[i], limits.v_max[i], top, brake, dt)
    if -lo > hi:
        return min(max(-v / dt, -top), top)
    return min(max(a, -lo), hi)


@jit
def braked(state: Any, limits: Any, i: int, dt: float) -> float:
    """The acceleration of a joint that comes to rest as fast as it can."""
    top = limits.a_max[i]
    return min(max(-state.v[i] / dt, -top), top)


@jit
def sync_model(K: Any) -> None:
    """Frames, tip, M and h at the rollout's state."""
    forward_kinematics(K, K.supposed)
    motion(K, K.supposed)
    dynamics(K, K.supposed)


@jit
def swing_on(
    supposed: Any, faults: Any, limits: Any, kinematics: Any, chain: Any, F: Any, dt: float
) -> tuple[float, float]:
    """Move the arm on by dt with the accelerations ``F.a`` of its healthy joints; needs ``sync_model``.

    Semi-implicit: v' = v + dt a, q' = q + dt v'. A joint that is held slows down at its brake's rate. The
    free joint stops where it meets its stop, and stays there as long as it is pressed against it.
    """
    n, i = chain.n, F.joint
    for k in range(faults.movable, n):
        j = faults.order[k]
        most = faults.lock_rate[j]
        F.a[j] = min(max(-supposed.v[j] / dt, -most), most)
    drive = -kinematics.h[i]
    for j in range(n):
        if j != i:
            drive -= kinematics.M[i, j] * F.a[j]
    v = supposed.v[i]
    drive -= faults.friction[i] * v  # the joint's own friction is a part of h
    after = free_velocity(
        kinematics.M[i, i], drive, v, viscous_friction(faults, chain, i), faults.coulomb[i], dt
    )
    impact = 0.0
    q = supposed.q[i] + dt * after
    low, high = limits.q_min[i], limits.q_max[i]
    if q < low and after < 0.0:
        q, impact, after = min(low, supposed.q[i]), -after, 0.0
    elif q > high and after > 0.0:
        q, impact, after = max(high, supposed.q[i]), after, 0.0
    if impact > 0.0 and v == 0.0:
        impact = 0.0  # it rests there
    a = (after - v) / dt if impact == 0.0 else 0.0
    F.a[i] = a
    share = 0.0
    for k in range(faults.working):
        j = faults.order[k]
        if limits.tau_max[j] < inf:
            tau = plus_products(kinematics.h[j], kinematics.M[j], F.a, n)
            share = max(share, abs(tau) / limits.tau_max[j])
    for j in range(n):
        if j != i:
            supposed.v[j] += dt * F.a[j]
            supposed.q[j] += dt * supposed.v[j]
    supposed.v[i], supposed.q[i] = after, q
    return impact, share


WORTH = 10.0
"""Links may go farther than they would if the others held still where that takes so much from an impact
[J]."""
HARMLESS = 5.0
"""An impact below this is not worth moving for [J]: the others hold still."""

ROUGH = 0.02
"""Rollouts of 10 ms are wrong by so much [m]."""


@jit
def mark_places(kinematics: Any, n: int, F: Any) -> None:
    """Remember where the origins of the joints and the tip are: ``places``."""
    for r in range(3):
        assign(F.places[:, r], kinematics.o[:, r], n)
        F.places[n, r] = kinematics.o_tip[r]


@jit
def farthest(kinematics: Any, n: int, F: Any) -> float:
    """The largest squared distance of an origin, or of the tip, from its place [m2]."""
    most = 0.0
    for j in range(n + 1):
        away = 0.0
        for r in range(3):
            d = (kinematics.o[j, r] if j < n else kinematics.o_tip[r]) - F.places[j, r]
            away += d * d
        most = max(most, away)
    return most


@jit
def is_worth(F: Any, reach: float, energy: float, spared: float) -> bool:
    """Whether links may go as far as ``reach`` [m] for an impact of ``energy`` [J]; ``spared`` is free."""
    return reach <= F.held_reach + ROUGH + spared or energy <= F.held_energy - WORTH
