"""Gamma, z and Omega for a batch of QPs of one shape: ``ftqp.kernel.dtrnn.projection`` as array code.

With u = (x; s; y) and Ex - s = b for the rows of A (without slack) and of C (over their norm),

    Gamma = [[s W, -q E'], [q E, 0]],  z = (s c; -q b),  e(u) = u - P(u - (Gamma u + z)),

P the clip to Omega. What the scalar network leaves out (fixed variables, slacks of rows with l = u, rows
without bound or without free variable) keeps its place here, but has no entry in Gamma except 1 on the
diagonal, and the value 0. The others see the reduced QP.
"""

from typing import Final, NamedTuple

from ftqp.qp.dtrnn.jax.arrays import Array, jit, jnp, times

CONVEX: Final = 1e-9
"""W + CONVEX max(W_ii) I has a Cholesky factor when W counts as positive semidefinite."""


class Network(NamedTuple):
    """Gamma, z and Omega of every problem; N = n + p + m + p.

    Attributes:
        Gamma: (B, N, N).
        z: (B, N).
        low: Lower ends of Omega, (B, N).
        high: Upper ends, (B, N).
        absent: What keeps its place only, (B, N).
        norm: What each row was divided by, (B, m + p).
        s: Scale of the objective, (B, 1).
        q: Scale of the rows, (B, 1); y = (q/s) times the dual part of u.
        inverse: (I + Gamma)^-1, (B, N, N), where the iteration needs it, else (B, 0, 0).
    """

    Gamma: Array
    z: Array
    low: Array
    high: Array
    absent: Array
    norm: Array
    s: Array
    q: Array
    inverse: Array


def projected(net: Network, w: Array) -> Array:
    """P(w), the clip to Omega."""
    return jnp.clip(w, net.low, net.high)


@jit
def network(
    H: Array,
    g: Array,
    A: Array,
    b: Array,
    C: Array,
    l: Array,
    u: Array,
    lb: Array,
    ub: Array,
) -> Network:
    """Gamma, z and Omega of every problem, scales 1, no inverse."""
    (B, n), m, p = g.shape, b.shape[1], l.shape[1]
    fixed = lb == ub
    prescribed = jnp.where(fixed, lb, 0.0)
    free = ~fixed
    W = jnp.where(free[:, :, None] & free[:, None, :], H, 0.0)
    c = jnp.where(fixed, 0.0, g + times(H, prescribed))
    rows = jnp.where(free[:, None, :], jnp.concatenate([A, C], axis=1), 0.0)
    size = jnp.sqrt((rows**2).sum(axis=2))
    unbounded = jnp.concatenate([jnp.zeros((B, m), bool), (l == -jnp.inf) & (u == jnp.inf)], axis=1)
    left_out = (size == 0.0) | unbounded
    norm = jnp.concatenate([jnp.ones((B, m)), jnp.where(left_out, 1.0, size)[:, m:]], axis=1)
    rows = jnp.where(left_out[:, :, None], 0.0, rows / norm[:, :, None])
    moved = times(C, prescribed)
    low, high = (l - moved) / norm[:, m:], (u - moved) / norm[:, m:]
    equal = l == u
    right = jnp.concatenate([b - times(A, prescribed), jnp.where(equal, low, 0.0)], axis=1)
    no_slack = equal | left_out[:, m:]
    slacks = jnp.zeros((B, m + p, p)).at[:, m:].set(-jnp.eye(p) * ~no_slack[:, :, None])
    E = jnp.concatenate([rows, slacks], axis=2)
    absent = jnp.concatenate([fixed, no_slack, left_out], axis=1)
    Gamma = jnp.zeros((B, absent.shape[1], absent.shape[1]))
    Gamma = Gamma.at[:, :n, :n].set(W).at[:, n + p :, : n + p].set(E)
    Gamma = (
        Gamma.at[:, : n + p, n + p :].set(-E.transpose(0, 2, 1)) + jnp.eye(absent.shape[1]) * absent[:, None]
    )
    unlimited = jnp.full((B, m + p), jnp.inf)
    return Network(
        Gamma,
        jnp.concatenate([c, jnp.zeros((B, p)), jnp.where(left_out, 0.0, -right)], axis=1),
        jnp.concatenate([jnp.where(fixed, 0.0, lb), jnp.where(no_slack, 0.0, low), -unlimited], axis=1),
        jnp.concatenate([jnp.where(fixed, 0.0, ub), jnp.where(no_slack, 0.0, high), unlimited], axis=1),
        absent,
        norm,
        jnp.ones((B, 1)),
        jnp.ones((B, 1)),
        jnp.zeros((B, 0, 0)),
    )


def scaled(net: Network, u: Array, s: Array, q: Array) -> tuple[Network, Array]:
    """The network, and its state, with the scales s and q; x stays the same."""
    ds, dq = s / net.s, q / net.q
    dual = jnp.arange(u.shape[1]) >= u.shape[1] - net.norm.shape[1]
    factor = jnp.where(dual[:, None] ^ dual, dq[:, :, None], jnp.where(dual, 1.0, ds[:, :, None]))
    z = net.z * jnp.where(dual, dq, ds)
    return net._replace(Gamma=net.Gamma * factor, z=z, s=s, q=q), u * jnp.where(dual, ds / dq, 1.0)


def spectral_scales(net: Network, n: int) -> tuple[Array, Array]:
    """s = 1/sqrt(max(l_1, 1e-9 l_n) l_n) and q = 10/max(s_min, 1e-3 s_max), (B, 1) each.

    The network has scales 1. l are the eigenvalues of W, s_min and s_max the extreme singular values of the
    rows. In the place of what is absent stands a value between the smallest and the largest eigenvalue of
    what is not.
    """

    def eigenvalues(S: Array, absent: Array) -> tuple[Array, Array]:
        S = jnp.where(absent[:, None, :] | absent[:, :, None], 0.0, S)
        mean = jnp.trace(S, axis1=1, axis2=2) / jnp.maximum((~absent).sum(axis=1), 1)
        found = jnp.linalg.eigvalsh(S + jnp.eye(S.shape[1]) * (absent * mean[:, None])[:, None])
        return found[:, :1], found[:, -1:]

    count = net.norm.shape[1]
    fixed, left_out = net.absent[:, :n], net.absent[:, -count:] if count else net.absent[:, :0]
    least, most = eigenvalues(net.Gamma[:, :n, :n], fixed)
    s = jnp.where(most > 0.0, 1.0 / jnp.sqrt(jnp.maximum(least, 1e-9 * most) * most), 1.0)
    if count == 0:
        return s, jnp.ones_like(s)
    rows = net.Gamma[:, -count:, :n]
    # The larger Gram matrix has zeros in the place of what the smaller one has.
    by_rows, most = eigenvalues(jnp.einsum("bik,bjk->bij", rows, rows), left_out)
    by_columns, _ = eigenvalues(jnp.einsum("bki,bkj->bij", rows, rows), fixed)
    least = jnp.sqrt(jnp.maximum(jnp.maximum(by_rows, by_columns), 0.0))
    return s, jnp.where(most > 0.0, 10.0 / jnp.maximum(least, 1e-3 * jnp.sqrt(most)), 1.0)


def quick_scales(net: Network, n: int) -> tuple[Array, Array]:
    """s = 1/min W_ii, floored at 1e-9 of the largest, and q = 1/max |row|, (B, 1) each."""
    diagonal = jnp.diagonal(net.Gamma[:, :n, :n], axis1=1, axis2=2)
    fixed = net.absent[:, :n]
    most = jnp.where(fixed, 0.0, diagonal).max(axis=1, keepdims=True)
    least = jnp.maximum(jnp.where(fixed, jnp.inf, diagonal).min(axis=1, keepdims=True), 1e-9 * most)
    row = (net.Gamma[:, net.z.shape[1] - net.norm.shape[1] :, :n] ** 2).sum(axis=2)
    row = jnp.sqrt(row.max(axis=1, keepdims=True, initial=0.0))
    return jnp.where(most > 0.0, 1.0 / least, 1.0), jnp.where(row > 0.0, 1.0 / row, 1.0)


def convex(net: Network, n: int) -> Array:
    """Whether W is positive semidefinite, up to rounding, (B,)."""
    W, fixed = net.Gamma[:, :n, :n], net.absent[:, :n]
    diagonal = jnp.where(fixed, 0.0, jnp.diagonal(W, axis1=1, axis2=2))
    most = jnp.abs(diagonal).max(axis=1)[:, None, None]
    factor = jnp.linalg.cholesky(W + CONVEX * most * jnp.eye(n))
    nothing = (jnp.where(fixed[:, None, :], 0.0, W) == 0.0).all(axis=(1, 2))
    return nothing | jnp.isfinite(factor).all(axis=(1, 2))
