"""Limits and locking joints of many arms: ``lanes.membership`` and ``rows.failed_joints`` of the kernel."""

from typing import Final

from ftqp.control.batch.jax.array_facts import Arm, Kind, Limits, State
from ftqp.kernel.layout.thresholds import OUTSIDE_FROM
from ftqp.qp.dtrnn.jax.arrays import Array, jnp

REDUCED: Final = 1e5
"""Largest angle that is looked at here [rad]."""


def braked_velocity(arm: Arm, limits: Limits, state: State) -> Array:
    """Velocity after the tick of the joints that are being locked, (B, n); 0 for all others.

    The deceleration is max(asked, min(v^2/(2 room - |v| dt), a_max)), the last step partial.
    Source: docs/theory/joint-failures.md, "Locked".

    Args:
        arm: The arm.
        limits: What it believes.
        state: Its positions and the velocities of those joints.
    """
    v, dt = state.lock_velocity, arm.dt
    room = jnp.where(v > 0.0, limits.q_max - state.q, state.q - limits.q_min)
    way = 2.0 * room - jnp.abs(v) * dt
    needed = jnp.where(way > 0.0, v * v / jnp.where(way > 0.0, way, 1.0), jnp.inf)
    step = dt * jnp.maximum(limits.lock_rate, jnp.minimum(needed, limits.a_max))
    after = jnp.where(jnp.abs(v) <= step, 0.0, v - jnp.sign(v) * step)
    return jnp.where(limits.works > 0.0, 0.0, after)


def _may_have_velocity(x: Array, v: Array, d: Array, limits: Limits, dt: Array) -> Array:
    """Whether x <= min(v_max, v + a_max dt, braking_velocity(d)), the last one by what surely suffices."""
    stops = (x <= 0.0) | (x * x <= 2.0 * limits.a_brake * (d - 1.5 * x * dt))
    return (x <= limits.v_max) & (x <= v + limits.a_max * dt) & (d >= 0.0) & stops


def _may_have_acceleration(x: Array, v: Array, d: Array, limits: Limits, dt: Array) -> Array:
    """Whether x is at most the upper end of ``viability``."""
    after = v + dt * x
    stops = after * after <= 2.0 * limits.a_brake * (d - 0.5 * dt * (v + after))
    turns = (after < 0.0) & ((v <= 0.0) | (v * v <= -2.0 * d * x))
    kept = ((after >= 0.0) & stops) | turns
    return (x <= limits.a_max) & (after <= limits.v_max) & (d >= 0.0) & kept


def is_inside(kind: Kind, arm: Arm, limits: Limits, state: State, x: Array) -> Array:
    """Where no bound stops x, and every joint is within its limits, (B,).

    Args:
        kind: Says what x is.
        arm: The arm.
        limits: What it believes.
        state: Its positions and velocities.
        x: The command, (B, n).
    """
    may_have = _may_have_acceleration if kind.accelerates else _may_have_velocity
    q, v = state.q, state.v
    above, below = limits.q_max - q, q - limits.q_min
    fits = may_have(x, v, above, limits, arm.dt) & may_have(-x, -v, below, limits, arm.dt)
    fits = fits & (jnp.abs(v) <= limits.v_max * (1.0 + OUTSIDE_FROM))
    in_range = (above >= -OUTSIDE_FROM) & (below >= -OUTSIDE_FROM) & (jnp.abs(q) <= REDUCED)
    return (in_range & (fits | (limits.works <= 0.0))).all(axis=1)
