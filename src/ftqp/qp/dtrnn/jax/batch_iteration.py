"""The iterations of a batch, every problem until its own end.

This is ``ftqp.kernel.dtrnn.iterations`` as array code.
"""

from functools import partial
from typing import Any, Final, NamedTuple

from ftqp.kernel.layout.enums import FAILED, INFEASIBLE, MAX_ITERATIONS, SOLVED
from ftqp.qp.dtrnn.jax.arrays import Array, dot, jit, jnp, lax, norm, times, transposed_times
from ftqp.qp.dtrnn.jax.batch_jump import jump, pivoted
from ftqp.qp.dtrnn.jax.batch_network import Network, convex, projected, quick_scales, scaled, spectral_scales
from ftqp.qp.dtrnn.jax.batch_stopping import contradictory, optimal
from ftqp.qp.dtrnn.jax.batch_stretch import STRICTER, drifted

RUNNING: Final = -1
JUMP_EVERY: Final = 5
"""Iterations between two Newton jumps."""
PROOF_EVERY: Final = 50
"""Iterations between two looks for a proof of infeasibility."""
PATIENCE: Final = 50
"""Iterations after which jumps are long ones."""


class State(NamedTuple):
    """Where the batch stands.

    Attributes:
        u: Iterates, (B, N).
        code: RUNNING or how it ended, (B,).
        iterations: (B,).
        residual: |e|, (B,).
        steady: What counts as a straight stretch (``ftqp.kernel.dtrnn.straight_stretch``), (B,).
        drifted: Whether the last step was one, (B,).
    """

    u: Any
    code: Any
    iterations: Any
    residual: Any
    steady: Any
    drifted: Any


class Rule(NamedTuple):
    """What is compiled in: sizes, method and mode."""

    n: int
    m: int
    p: int
    method: str
    scaling: bool
    newton: bool
    paper: bool


def _implicit(net: Network, u: Array, F: Array, e: Array, gamma: Array) -> Array:
    """M4: u - gamma (I + Gamma)^-1 e."""
    return u - gamma * times(net.inverse, e)


def _94lvi(net: Network, u: Array, F: Array, e: Array, gamma: Array) -> Array:
    """94LVI: u - gamma rho (Gamma' + I) e, rho = |e|^2 / |(Gamma' + I) e|^2."""
    d = transposed_times(net.Gamma, e) + e
    return u - gamma * (dot(e, e) / dot(d, d)) * d


def _e47(net: Network, u: Array, F: Array, e: Array, gamma: Array) -> Array:
    """E47: P(u - gamma rho (Gamma' e + Gamma u + z)), the same rho."""
    d = transposed_times(net.Gamma, e)
    return projected(net, u - gamma * (dot(e, e) / dot(d + e, d + e)) * (d + F))


ITERATIONS: Final = {"implicit": _implicit, "94lvi": _94lvi, "e47": _e47}


def _judged(net: Network, state: State, size: Array, solved: Array, n: int) -> Array:
    """The codes of the problems that run, once |e| and whether it is enough are known, (B,)."""
    sound = jnp.isfinite(size[:, 0]) & convex(net, n)
    code = jnp.where(sound, jnp.where(solved[:, 0], SOLVED, RUNNING), FAILED)
    return jnp.where(state.code == RUNNING, code, state.code)


@partial(jit, static_argnames="rule")
def looked_ahead(net: Network, state: State, tolerance: Array, rule: Rule) -> State:
    """A jump from the start on quick scales; u with scales 1 before and after."""
    one, primal = jnp.ones_like(net.s), rule.n + rule.p
    net, u = scaled(net, state.u, *quick_scales(net, rule.n))
    size = norm(u - projected(net, u - times(net.Gamma, u) - net.z))
    code = _judged(net, state, size, optimal(net, u, size, tolerance, primal), rule.n)
    wanted = (code == RUNNING)[:, None]
    jumped, found = pivoted(net, u, wanted, jnp.zeros_like(wanted), tolerance, primal)
    u = jnp.where(found, jumped, u)
    size = norm(u - projected(net, u - times(net.Gamma, u) - net.z))
    return state._replace(
        u=scaled(net, u, one, one)[1],
        code=jnp.where(found[:, 0], SOLVED, code),
        iterations=state.iterations + found[:, 0],
        residual=size[:, 0],
    )


def _prepared(net: Network, u: Array, rule: Rule) -> tuple[Network, Array]:
    """Scaled, and I + Gamma inverted, as the method needs it.

    The inverse and not factors: a product costs a twentieth of two triangular solves, and the answer does not
    suffer, because e(u) = 0 does not contain it.
    """
    if rule.scaling:
        net, u = scaled(net, u, *spectral_scales(net, rule.n))
    if rule.method == "implicit":
        net = net._replace(inverse=jnp.linalg.inv(jnp.eye(u.shape[1]) + net.Gamma))
    return net, u


@partial(jit, static_argnames="rule")
def advanced(
    net: Network, state: State, few: Array, gamma: Array, tolerance: Array, cap: Array, rule: Rule
) -> State:
    """Iterate until at most ``few`` problems run; u with scales 1 before and after.

    What happens to a problem depends on its own count of iterations only, never on the others.
    """
    one, primal = jnp.ones_like(net.s), rule.n + rule.p
    net, u = _prepared(net, state.u, rule)
    state = state._replace(u=u, code=_judged(net, state, one, one < 0.0, rule.n))
    nobody = jnp.zeros_like(one, dtype=bool)

    def jumped(u: Array, w: Array, e: Array, state: State, wanted: Array) -> tuple[Array, Array, State]:
        """Where a jump or a drift replaces the iteration, and to what."""
        size = norm(e)
        if rule.paper:
            found, better = lax.cond(wanted.any(), lambda: jump(net, u, w, size), lambda: (u, nobody))
            return found, wanted & better, state
        first = (state.iterations == 0)[:, None]  # that jump was on quick scales
        long = (state.iterations >= PATIENCE)[:, None]
        found, better = pivoted(net, u, wanted & ~first, long, tolerance, primal)
        if rule.method != "implicit":
            return found, better, state
        steady = jnp.where(state.drifted & (size[:, 0] > state.residual), STRICTER, 1.0) * state.steady
        further, straight = drifted(net, u, w, e, gamma, steady[:, None])
        straight &= wanted & ~better
        state = state._replace(steady=steady, drifted=straight[:, 0])
        return jnp.where(better, found, further), better | straight, state

    def iterate(state: State) -> State:
        u, before = state.u, state.code == RUNNING
        F = times(net.Gamma, u) + net.z
        w = u - F
        e = u - projected(net, w)
        size = norm(e)
        enough = size <= tolerance if rule.paper else optimal(net, u, size, tolerance, primal)
        code = jnp.where(enough[:, 0], SOLVED, jnp.where(jnp.isfinite(size[:, 0]), RUNNING, FAILED))
        last = before & (code == RUNNING) & (state.iterations >= cap)
        look = before & (code == RUNNING) & (state.iterations % PROOF_EVERY == PROOF_EVERY - 1) | last
        no_point = lax.cond(look.any(), lambda: contradictory(net, u, rule.n, rule.m), lambda: nobody)[:, 0]
        code = jnp.where(look & no_point, INFEASIBLE, jnp.where(last & ~no_point, MAX_ITERATIONS, code))
        code = jnp.where(before, code, state.code)
        running = code == RUNNING
        following = ITERATIONS[rule.method](net, u, F, e, gamma)
        if rule.newton:
            wanted = (running & (state.iterations % JUMP_EVERY == 0))[:, None]
            instead, taken, state = jumped(u, w, e, state, wanted)
            following = jnp.where(taken, instead, following)
        return state._replace(
            u=jnp.where(running[:, None], following, u),
            code=code,
            iterations=state.iterations + running,
            residual=jnp.where(before, size[:, 0], state.residual),
        )

    def unfinished(state: State) -> Array:
        # Everybody stops at a multiple of JUMP_EVERY: whoever iterates together later jumps together.
        running = state.code == RUNNING
        more: Array = (running.sum() > few) | (running & (state.iterations % JUMP_EVERY != 0)).any()
        return more

    state = lax.while_loop(unfinished, iterate, state)
    return state._replace(u=scaled(net, state.u, one, one)[1])
