"""Straight stretches of the implicit method for a batch.

This is ``ftqp.kernel.dtrnn.straight_stretch`` as array code.
"""

from typing import Final

from ftqp.qp.dtrnn.jax.arrays import Array, jnp, times
from ftqp.qp.dtrnn.jax.batch_network import Network

STEADY: Final = 1e-2
"""Largest change of e in a step, as a share of e, that counts as a straight stretch at first."""
STRICTER: Final = 0.1
"""Factor on that share after a stretch that made |e| larger."""
NEARLY: Final = 0.99
"""Share of the way to the next bound that is taken."""


def drifted(net: Network, u: Array, w: Array, e: Array, gamma: Array, steady: Array) -> tuple[Array, Array]:
    """u + t d with d = -gamma (I + Gamma)^-1 e, (B, N), and whether it may be taken, (B, 1).

    t d ends short of the first change of a side of w = u - (Gamma u + z), and t |change of e| <= |e|. It may
    be taken where a step changes e by at most the share ``steady`` of it.
    """
    d = -gamma * times(net.inverse, e)
    rate = times(net.Gamma, d)
    inside = (w > net.low) & (w < net.high)
    size = jnp.abs(e).max(axis=1, keepdims=True)
    change = jnp.abs(jnp.where(inside, rate, d)).max(axis=1, keepdims=True)
    speed = d - rate
    moving = jnp.where(speed == 0.0, 1.0, speed)
    steps = jnp.where(change > 0.0, size / jnp.where(change > 0.0, change, 1.0), jnp.inf)
    for bound in (net.low, net.high):
        ahead = (bound - w) / moving
        ahead = jnp.where((speed != 0.0) & (ahead > 0.0), ahead, jnp.inf)
        steps = jnp.minimum(steps, ahead.min(axis=1, keepdims=True))
    straight = (change <= steady * size) & (steps > 2.0) & jnp.isfinite(steps)
    return u + NEARLY * jnp.where(straight, steps, 0.0) * d, straight
