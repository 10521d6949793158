"""When a batch stops: optimality, and proof of infeasibility.

This is ``ftqp.kernel.dtrnn.stopping`` as array code.
"""

from typing import Final

from ftqp.qp.dtrnn.jax.arrays import Array, dot, jnp, largest, times, transposed_times
from ftqp.qp.dtrnn.jax.batch_network import Network, projected

ROW_TOLERANCE: Final = 1e-8
"""Largest |Ex - b| of a solved QP, beside max(1, |b|)."""
GAP_TOLERANCE: Final = 1e-14
"""Largest duality gap of a solved QP, beside 1 + |x'Wx| + |c'x|."""
VIOLATION: Final = 1e-8
"""Least violation of a row, beside max(1, |x|, |b|), that may count as a proof of infeasibility."""
MARGIN: Final = 1e-9
"""What that proof must exceed, as a share of the sum of its terms."""
RAY: Final = 1e-10
"""Largest force against a side without a bound that counts as rounding, beside its terms."""


def optimal(net: Network, u: Array, size: Array, tolerance: Array, primal: int) -> Array:
    """Whether the clipped iterate solves the QP in its own units, (B, 1).

    |Ex - b| <= ROW_TOLERANCE max(1, |b|) and (|e| <= tolerance (1 + |x|) or Delta <= GAP_TOLERANCE (1 +
    |x'Wx| + |c'x|)), g = Wx + c - E'y, Delta = sum max(g_i (x_i - low_i), g_i (x_i - high_i)) >= (x - x*)'W(x
    - x*).
    """
    small = size <= tolerance * (1.0 + largest(u[:, :primal]))
    u = projected(net, u)
    product = times(net.Gamma, u)
    x, c, F = u[:, :primal], net.z[:, :primal] / net.s, product + net.z
    g = F[:, :primal] / net.s
    limit = jnp.where(g > 0.0, net.low[:, :primal], net.high[:, :primal])
    gap = jnp.where(g == 0.0, 0.0, g * (x - limit)).sum(axis=1, keepdims=True)
    energy = 1.0 + jnp.abs(dot(u, product) / net.s) + jnp.abs(dot(c, x))  # the rest of Gamma is skew
    unit = net.norm / net.q
    missing = jnp.abs(F[:, primal:] * unit).max(axis=1, keepdims=True, initial=0.0)
    reached = missing <= ROW_TOLERANCE * largest(net.z[:, primal:] * unit)
    return reached & (small | (gap <= GAP_TOLERANCE * energy))


def contradictory(net: Network, u: Array, n: int, m: int) -> Array:
    """Whether y = b - Ex proves that no point of Omega has Ex = b, (B, 1).

    Every such point has b'y = (E'y)'x <= sum max((E'y)_i low_i, (E'y)_i high_i): infeasible where that fails
    by more than |y|^2/2, and by more than rounding. Tried at the clipped iterate with the nearest slacks, and
    with the variables inside their bounds moved to the least |y|.
    """
    primal = u.shape[1] - net.norm.shape[1]
    low, high = net.low[:, :primal], net.high[:, :primal]
    x, E = projected(net, u)[:, :n], net.Gamma[:, primal:, :primal] / net.q[:, :, None]
    slacks = jnp.clip(times(E[:, m:, :n], x), low[:, n:], high[:, n:])
    x = jnp.concatenate([x, slacks], axis=1)
    b = -net.z[:, primal:] / net.q
    scale = jnp.maximum(largest(x), largest(b))

    def proves(y: Array) -> Array:
        force, terms = transposed_times(E, y), transposed_times(jnp.abs(E), jnp.abs(y))
        limit = jnp.where(force > 0.0, high, low)
        finite = jnp.isfinite(limit)
        limit = jnp.where(finite, limit, 0.0)
        bounded = (finite | (jnp.abs(force) <= RAY * terms)).all(axis=1, keepdims=True)
        value = dot(b, y) - dot(force, limit)
        size = dot(jnp.abs(b), jnp.abs(y)) + dot(terms, jnp.abs(limit))
        large = jnp.abs(y).max(axis=1, keepdims=True, initial=0.0) > VIOLATION * scale
        return bounded & large & (value > jnp.maximum(0.5 * dot(y, y), MARGIN * size))

    y = b - times(E, x)
    inner = jnp.where(((x > low) & (x < high))[:, None, :], E, 0.0)
    gram = jnp.einsum("bki,bkj->bij", inner, inner)
    tiny = 1e-13 * jnp.abs(gram).max(axis=(1, 2), initial=0.0)[:, None, None] + 1e-300
    nearest = y
    for _ in range(2):  # the second time against rounding
        force = transposed_times(inner, nearest)
        step = jnp.linalg.solve(gram + tiny * jnp.eye(primal), force[:, :, None])[:, :, 0]
        nearest = nearest - times(inner, step)
    return proves(y) | proves(nearest) | proves(b - times(E, u[:, :primal]))
