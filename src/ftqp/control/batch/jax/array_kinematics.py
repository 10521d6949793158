"""Kinematics of many arms: ``ftqp.kernel.arm.kinematics`` as array code."""

from typing import NamedTuple

from ftqp.control.batch.jax.array_facts import Arm
from ftqp.qp.dtrnn.jax.arrays import Array, jnp, lax

_Frame = tuple[Array, Array]
_Three = tuple[Array, Array, Array]
_Four = tuple[Array, Array, Array, Array]
_Five = tuple[Array, Array, Array, Array, Array]


class Posture(NamedTuple):
    """Where the frames of each arm are, along W.

    Attributes:
        R: Rotations of the joints' frames, (B, n, 3, 3).
        o: Their origins, (B, n, 3) [m].
        R_tip: (B, 3, 3).
        o_tip: (B, 3) [m].
        J: Jacobian of the tip, linear then angular, (B, 6, n).
    """

    R: Array
    o: Array
    R_tip: Array
    o_tip: Array
    J: Array

    @property
    def axes(self) -> Array:
        """z of every joint's frame, along or about which it moves, (B, n, 3)."""
        return self.R[..., 2]


def turned(R: Array, t: Array) -> Array:
    """R t, (..., 3)."""
    return (R * t[..., None, :]).sum(axis=-1)


def product(A: Array, B: Array) -> Array:
    """A B of matrices (..., 3, 3)."""
    return (A[..., :, :, None] * B[..., None, :, :]).sum(axis=-2)


def frames(arm: Arm, q: Array) -> Posture:
    """T_i = T_(i-1) (rotation_i, translation_i) Rz(q_i), or Tz(q_i) for a prismatic joint; the tip; J.

    Column i of J: (z_i x (o_tip - o_i); z_i) for a revolute joint, (z_i; 0) for a prismatic one.

    Args:
        arm: The arm.
        q: (B, n) [rad or m].
    """
    sine = jnp.where(arm.prismatic, 0.0, jnp.sin(q))[..., None]
    cosine = jnp.where(arm.prismatic, 1.0, jnp.cos(q))[..., None]
    x, y = arm.rotation[:, :, 0], arm.rotation[:, :, 1]
    z = jnp.broadcast_to(arm.rotation[:, :, 2], (*q.shape, 3))
    own = jnp.stack([cosine * x + sine * y, cosine * y - sine * x, z], axis=-1)
    way = jnp.where(arm.prismatic, q, 0.0)

    def joint(before: _Frame, at: _Three) -> tuple[_Frame, _Frame]:
        (R, o), (turn, translation, way) = before, at
        after = product(R, turn)
        o = o + turned(R, translation) + way[:, None] * after[..., 2]
        return (after, o), (after, o)

    base = jnp.broadcast_to(jnp.eye(3), (len(q), 3, 3)), jnp.zeros((len(q), 3))
    along = jnp.moveaxis(own, 1, 0), arm.translation, way.T
    (R_last, o_last), (R, o) = lax.scan(joint, base, along)
    R, o = jnp.moveaxis(R, 0, 1), jnp.moveaxis(o, 0, 1)
    R_tip = product(R_last, arm.tip_rotation)
    o_tip = o_last + turned(R_last, arm.tip_translation)
    slides, axes = arm.prismatic[:, None], R[..., 2]
    linear = jnp.where(slides, axes, jnp.cross(axes, o_tip[:, None] - o))
    J = jnp.concatenate([linear, jnp.where(slides, 0.0, axes)], axis=-1)
    return Posture(R, o, R_tip, o_tip, jnp.swapaxes(J, 1, 2))


class Motion(NamedTuple):
    """How the frames of each arm move, along W; the base accelerates by -gravity.

    Attributes:
        w: Angular velocities, (B, n, 3) [rad/s].
        alpha: Angular accelerations, (B, n, 3) [rad/s2].
        acc: Accelerations of the origins, (B, n, 3) [m/s2].
        tip: The tip's classical acceleration, linear then angular, without that of the base, (B, 6).
    """

    w: Array
    alpha: Array
    acc: Array
    tip: Array


def motion(arm: Arm, at: Posture, v: Array, a: Array) -> Motion:
    """w, alpha and the acceleration of the origin of every frame; ``tip`` is J a + Jdot v.

    Args:
        arm: The arm.
        at: Its frames.
        v: (B, n).
        a: (B, n); zero for the drift Jdot v.
    """

    def shifted(acc: Array, w: Array, alpha: Array, r: Array) -> Array:
        return acc + jnp.cross(w, jnp.cross(w, r)) + jnp.cross(alpha, r)

    def joint(before: _Four, at: _Five) -> tuple[_Four, _Three]:
        w, alpha, acc, origin = before
        z, o, v, a, slides = at
        v, a = v[:, None], a[:, None]
        acc = shifted(acc, w, alpha, o - origin)
        bend = v * jnp.cross(w, z)
        acc = acc + jnp.where(slides, 2.0 * bend + a * z, 0.0)  # Coriolis: 2 w x z v
        alpha = alpha + jnp.where(slides, 0.0, bend + a * z)
        w = w + jnp.where(slides, 0.0, v * z)
        return (w, alpha, acc, o), (w, alpha, acc)

    zero = jnp.zeros_like(at.o_tip)
    along = jnp.moveaxis(at.axes, 1, 0), jnp.moveaxis(at.o, 1, 0), v.T, a.T, arm.prismatic
    (w, alpha, acc, origin), parts = lax.scan(joint, (zero, zero, zero - arm.gravity, zero), along)
    acc = shifted(acc, w, alpha, at.o_tip - origin)
    tip = jnp.concatenate([acc + arm.gravity, alpha], axis=-1)
    w, alpha, every = (jnp.moveaxis(part, 0, 1) for part in parts)
    return Motion(w, alpha, every, tip)
