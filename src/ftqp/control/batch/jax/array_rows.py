"""The task of many arms: ``arm.pose_error``, ``rows.task_rows`` and ``rows.objective`` of the kernel."""

from typing import Final, NamedTuple

from ftqp.control.batch.jax.array_facts import Arm, Kind, State
from ftqp.control.batch.jax.array_kinematics import Posture, motion, product, turned
from ftqp.kernel.layout.enums import TARGET_ACCELERATION, TARGET_TWIST
from ftqp.qp.dtrnn.jax.arrays import Array, jnp, times

NEAR: Final = 0.19140625
"""Up to this tan^2 of half the angle, (7/16)^2, the rotation part is looked at here."""


class Error(NamedTuple):
    """The error of each arm's tip.

    Attributes:
        along: From the tip to the target, along W, (B, 6).
        position: Its norm over the task's rows, (B,) [m].
        rotation: (B,) [rad].
        near: Whether the tip is turned little from its target, (B,).
    """

    along: Array
    position: Array
    rotation: Array
    near: Array


class Rows(NamedTuple):
    """A x + s = b with the compliance of s, and H and g of the objective.

    Attributes:
        A: (B, m, n).
        b: (B, m).
        soft: (B, m).
        H: The diagonal, (n,).
        g: (B, n).
    """

    A: Array
    b: Array
    soft: Array
    H: Array
    g: Array


def _components(kind: Kind, arm: Arm, at: Posture, six: Array) -> Array:
    """Columns (B, 6, k) along W; with tool rows the angular part along the tool's axes."""
    if not kind.points:
        return six
    axes = product(at.R_tip, arm.axis)
    angular = (axes[..., None] * six[:, 3:, None]).sum(axis=1)
    return jnp.concatenate([six[:, :3], angular], axis=1)


def pose_error(kind: Kind, arm: Arm, at: Posture, target: Array) -> Error:
    """e = (p_d - p; rotation vector of R_d R') along W; in axis mode the shortest turn of the tool axis.

    Args:
        kind: Of the task.
        arm: The arm.
        at: Its frames.
        target: Packed, (29,), the same for every arm.
    """
    pose = target[:16].reshape(4, 4)
    linear = pose[:3, 3] - at.o_tip
    near = linear[:, 0] == linear[:, 0]
    angular = jnp.zeros_like(linear)
    if kind.turns:
        if kind.points:
            a, d = turned(at.R_tip, arm.axis[:, 2]), pose[:3, :3] @ arm.axis[:, 2]
            xyz, w, sides = jnp.cross(a, d), (a * d).sum(axis=-1), 1.0
        else:
            M = (pose[:3, None, :3] * at.R_tip[:, None, :, :]).sum(axis=-1)
            xyz = jnp.stack([M[:, 2, 1] - M[:, 1, 2], M[:, 0, 2] - M[:, 2, 0], M[:, 1, 0] - M[:, 0, 1]], -1)
            w, sides = 1.0 + M[:, 0, 0] + M[:, 1, 1] + M[:, 2, 2], 2.0
        forward = w > 0.5
        w = jnp.where(forward, w, 1.0)
        tangent = jnp.sqrt((xyz * xyz).sum(axis=-1)) / w
        f = jnp.where(tangent > 0.0, jnp.arctan(tangent) / jnp.where(tangent > 0.0, tangent, 1.0), 1.0)
        angular = (sides * f / w)[:, None] * xyz
        near = near & forward & (tangent * tangent <= NEAR)
    along = jnp.concatenate([linear, angular], axis=-1)
    own = _components(kind, arm, at, along[..., None])[..., 0]
    square = own * own * jnp.array([c in kind.rows for c in range(6)])
    position, rotation = jnp.sqrt(square[:, :3].sum(axis=1)), jnp.sqrt(square[:, 3:].sum(axis=1))
    return Error(along, position, rotation, near)


def rows(kind: Kind, arm: Arm, at: Posture, state: State, error: Error, target: Array) -> Rows:
    """Acceleration level: A = J, b = r'' - Jdot v + kv (r' - J v) + kp e.  Velocity level: b = r' + kp e.

    Angular rows are multiplied by the characteristic length. soft_k = yielding_k ratio |A|_F^2 / (m tr H).
    The objective is 1/2 norm |x|^2_D + x'D (norm_v v + norm_q (q - posture)).

    Args:
        kind: Of the task.
        arm: The arm.
        at: Its frames.
        state: Its positions and velocities.
        error: Of its tip.
        target: Packed, (29,), the same for every arm.
    """
    chosen = jnp.array(kind.rows)
    scale = arm.row_scale[chosen]

    def own(six: Array) -> Array:
        return scale * _components(kind, arm, at, six[..., None])[:, chosen, 0]

    def given(first: int) -> Array:
        return own(jnp.broadcast_to(target[first : first + 6], error.along.shape))

    A = scale[:, None] * _components(kind, arm, at, at.J)[:, chosen]
    b = given(TARGET_TWIST)
    if kind.accelerates:
        drift = motion(arm, at, state.v, jnp.zeros_like(state.v)).tip
        b = given(TARGET_ACCELERATION) + arm.kv * (b - times(A, state.v)) - own(drift)
    b = b + arm.kp * own(error.along)
    H = arm.norm * arm.weight
    soft = jnp.zeros_like(b)
    if not kind.hard:
        whole = arm.slack_ratio * (A * A).sum(axis=(1, 2)) / (len(kind.rows) * H.sum()) + 1e-300
        soft = whole[:, None] * arm.yielding[chosen]
    g = arm.norm_v * state.v
    if kind.postures:
        d = state.q - arm.posture
        round_way = 2.0 * jnp.sin(0.5 * d) * jnp.where(jnp.cos(0.5 * d) >= 0.0, 1.0, -1.0)
        g = g + arm.norm_q * jnp.where(arm.continuous, round_way, d)
    return Rows(A, b, soft, H, arm.weight * g)
