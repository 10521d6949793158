"""Newton jumps of a batch: ``ftqp.kernel.dtrnn.newton_jump`` as array code."""

from functools import partial
from typing import Final, NamedTuple

from ftqp.qp.dtrnn.jax.arrays import Array, jnp, lax, norm, times
from ftqp.qp.dtrnn.jax.batch_network import Network, projected
from ftqp.qp.dtrnn.jax.batch_stopping import optimal

STEPS: Final = 6
"""Newton steps of a jump."""
LONG_STEPS: Final = 4
"""More steps of a long jump, for each component with bounds."""
TRIES: Final = 3
"""Steps of a long jump without fewer wrong sides, before only one side is changed at a time."""
LONGEST: Final = 1e8
"""Paper mode: largest |u^ - u|/|e(u)| of a jump; a longer one comes from bounds in contradiction."""
PROXIMAL: Final = 1e-14
"""Weight of staying at y in a Newton step, beside the largest entry of Gamma: what dependent rows lack."""


def _solved_for(net: Network, inside: Array, v: Array, bound: Array) -> Array:
    """u with (Gamma u + z)_i = 0 where inside, u_i = bound_i elsewhere; dependent rows stay near v."""
    dual = jnp.arange(v.shape[1]) >= v.shape[1] - net.norm.shape[1]
    d = PROXIMAL * dual * jnp.abs(net.Gamma).max(axis=(1, 2), initial=1.0)[:, None]
    eye = jnp.eye(v.shape[1])
    matrix = jnp.where(inside[:, :, None], net.Gamma + d[:, :, None] * eye, eye)
    right = jnp.where(inside, d * v - net.z, bound)
    found: Array = jnp.linalg.solve(matrix, right[:, :, None])[:, :, 0]
    return found


def jump(net: Network, u: Array, w: Array, size: Array) -> tuple[Array, Array]:
    """Paper mode: one Newton step u^ from u, w = u - (Gamma u + z), and whether it is taken, (B, 1).

    Components with w_i outside Omega become u^_i = bound, the others (Gamma u^ + z)_i = 0. It is taken where
    it halves |e| and is not absurdly long.
    """
    jumped = _solved_for(net, (w > net.low) & (w < net.high), u, projected(net, w))
    e = jumped - projected(net, jumped - times(net.Gamma, jumped) - net.z)
    return jumped, (norm(e) < 0.5 * size) & (norm(jumped - u) <= LONGEST * size)


class Pivots(NamedTuple):
    """Newton steps under way: points v (B, N), sides -1, 0, 1 (B, n + p), and the rest (B, 1)."""

    k: Array
    v: Array
    side: Array
    fewest: Array
    tries: Array
    going: Array
    found: Array


def pivoted(
    net: Network, u: Array, wanted: Array, long: Array, tolerance: Array, primal: int
) -> tuple[Array, Array]:
    """Newton steps in a row from u, and whether they solved the QP, (B, 1); see ``newton_jump``.

    A component of x or s takes the side that v - (Gamma v + z) asks for; except at first it leaves a bound
    for the inside only. A long jump goes on and, where the number of wrong sides does not fall, changes only
    the last wrong one.
    """
    components = jnp.arange(primal)
    steps = STEPS + long * LONG_STEPS * (~net.absent[:, :primal]).sum(axis=1, keepdims=True)

    def step(at: Pivots) -> Pivots:
        w = (at.v - times(net.Gamma, at.v) - net.z)[:, :primal]
        low, high = net.low[:, :primal], net.high[:, :primal]
        asked = jnp.where(w > low, jnp.where(w < high, 0, 1), -1)
        wrong = asked != at.side
        count = wrong.sum(axis=1, keepdims=True)
        last = components == jnp.where(wrong, components, -1).max(axis=1, keepdims=True)
        change = wrong & (last | ~(long & (at.tries == 0)))
        side = jnp.where(change, jnp.where((at.k == 0) | (at.side == 0), asked, 0), at.side)
        fewer = (at.k > 0) & (count < at.fewest)
        inside = jnp.concatenate([side == 0, jnp.ones_like(net.norm, dtype=bool)], axis=1)
        bound = jnp.concatenate([jnp.where(side < 0, low, high), jnp.zeros_like(net.norm)], axis=1)
        v = _solved_for(net, inside, at.v, jnp.where(inside, 0.0, bound))
        e = v - projected(net, v - times(net.Gamma, v) - net.z)
        going = at.going & (count > 0)
        found = going & optimal(net, v, norm(e), tolerance, primal)
        return Pivots(
            at.k + 1,
            jnp.where(going, v, at.v),
            side,
            jnp.where(fewer, count, at.fewest),
            jnp.where(fewer, TRIES, jnp.maximum(at.tries - 1, 0)),
            going & ~found & (at.k + 1 < steps),
            at.found | found,
        )

    full = partial(jnp.full, (u.shape[0], 1))
    start = Pivots(
        jnp.zeros((), int),
        u,
        jnp.full((u.shape[0], primal), 2),
        full(primal + 1),
        full(TRIES),
        wanted,
        full(False),
    )
    at = lax.while_loop(lambda at: at.going.any(), step, start)
    return at.v, at.found
