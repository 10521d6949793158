"""Torques of many arms: ``ftqp.kernel.arm.newton_euler`` as array code."""

from ftqp.control.batch.jax.array_facts import Arm
from ftqp.control.batch.jax.array_kinematics import Posture, motion, product, turned
from ftqp.qp.dtrnn.jax.arrays import Array, jnp, lax


def torques(arm: Arm, at: Posture, v: Array, a: Array) -> Array:
    """tau = M a + h by the recursive Newton-Euler algorithm, (B, n) [N m or N]; M itself is not made.

    Force and moment about the world's origin of each body are summed from the tip to the joint. Rotor inertia
    and viscous friction are counted, Coulomb friction is not, as in the kernel.
    Source: Featherstone 2008, chapter 5; here in world coordinates.

    Args:
        arm: The arm.
        at: Its frames.
        v: (B, n).
        a: (B, n).
    """
    moving = motion(arm, at, v, a)
    w, alpha = moving.w, moving.alpha
    arms = turned(at.R, arm.com)
    inertia = product(product(at.R, arm.inertia), jnp.swapaxes(at.R, -1, -2))
    acc = moving.acc + jnp.cross(alpha, arms) + jnp.cross(w, jnp.cross(w, arms))
    force = arm.mass[:, None] * acc
    moment = turned(inertia, alpha) + jnp.cross(w, turned(inertia, w)) + jnp.cross(at.o + arms, force)
    force, moment = (lax.cumsum(part, axis=1, reverse=True) for part in (force, moment))
    about = jnp.where(arm.prismatic[:, None], force, moment - jnp.cross(at.o, force))
    tau: Array = (at.axes * about).sum(axis=-1) + arm.armature * a + arm.viscous * v
    return tau
