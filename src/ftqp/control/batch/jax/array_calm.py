"""Where the error is too small for its curvature to matter: ``ftqp.kernel.lanes.regular`` as array code."""

from typing import Final

from ftqp.control.batch.jax.array_facts import Arm, Kind, Limits, State
from ftqp.control.batch.jax.array_kinematics import Posture
from ftqp.control.batch.jax.array_rows import Error, Rows
from ftqp.qp.dtrnn.jax.arrays import Array, jnp, lax

AWAY: Final = 0.06
"""A joint nearer to its position limit may be pressed on it [rad; times the characteristic length m]."""
BEND: Final = 1.0 / 11.0
"""1 - x cot x <= 4 BEND x^2 up to the half angles that are looked at here."""


def needs_no_calm(
    kind: Kind, arm: Arm, limits: Limits, at: Posture, state: State, error: Error, rows: Rows
) -> Array:
    """Where sigma_min^2 of the rows exceeds the norm of the error's curvature, or that is small, (B,).

    sigma_min is that of the weighted rows over the joints that work, away from their limits: G - s 1 has a
    Cholesky factor. Nothing is kept from tick to tick, as the lanes do.

    Args:
        kind: Of the task.
        arm: The arm.
        limits: What it believes.
        at: Its frames.
        state: Its positions.
        error: Of its tip.
        rows: Of its task.
    """
    if not kind.calms:
        return error.position >= 0.0
    unit = jnp.where(arm.prismatic, arm.length, 1.0)
    room = jnp.minimum(limits.q_max - state.q, state.q - limits.q_min) / unit
    stays = (room > AWAY) & (limits.works > 0.0)
    yielding = arm.yielding[jnp.array(kind.rows)]
    A = rows.A * stays[:, None, :] / jnp.sqrt(yielding)[:, None]
    G = (A[:, :, None, :] * A[:, None, :, :]).sum(axis=-1)
    s = curvature_bound(kind, arm, limits, at, error)
    F = lax.linalg.cholesky(G - s[:, None, None] * jnp.eye(len(kind.rows)), symmetrize_input=False)
    regular = jnp.isfinite(F).all(axis=(1, 2))
    softness = jnp.zeros_like(s) if kind.hard else rows.soft[:, 0] / yielding[0]
    return regular | (s <= softness)


def curvature_bound(kind: Kind, arm: Arm, limits: Limits, at: Posture, error: Error) -> Array:
    """No less than the norm of ``ftqp.kernel.calm.curvature.curvature``, and hardly more, (B,).

    Args:
        kind: Of the task.
        arm: The arm.
        limits: Which joints work.
        at: Its frames.
        error: Of its tip.
    """
    twice = arm.row_scale * arm.row_scale / arm.yielding
    linear = jnp.array([c in kind.rows for c in range(3)])
    angular = jnp.array([kind.points or c in kind.rows for c in range(3, 6)])
    weight = jnp.where(kind.points, twice[3], twice[3:])
    v = jnp.concatenate([jnp.where(linear, twice[:3], 0.0), jnp.where(angular, weight, 0.0)]) * error.along
    J = jnp.swapaxes(at.J, 1, 2)
    c = jnp.cross(J[..., :3], v[:, None, :3]) + 0.5 * jnp.cross(J[..., 3:], v[:, None, 3:])
    s = (J[:, :, None, 3:] * c[:, None, :, :]).sum(axis=-1)  # (i, j): i before j; j x j bends nothing
    n = s.shape[-1]
    share = 2.0 * jnp.triu(jnp.ones((n, n))) - jnp.eye(n)
    square = (share * limits.works[:, :, None] * limits.works[:, None, :] * s * s).sum(axis=(1, 2))
    e = error.rotation
    bend = e * (1.0 + e) if kind.points else BEND * e * e
    own: Array = limits.works.sum(axis=-1) * (arm.length * arm.length / arm.yielding[3]) * bend
    return jnp.sqrt(square) + own
