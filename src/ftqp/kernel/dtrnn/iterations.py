"""The discrete-time recurrent network: the iterations that drive e(u) to zero.

e(u), Gamma, z and P are those of ``ftqp.kernel.dtrnn.projection``. With rho = |e|^2 / |(Gamma' + I) e|^2:

    94lvi:     u <- u - gamma rho (Gamma' + I) e
    e47:       u <- P(u - gamma rho (Gamma' e + Gamma u + z))
    implicit:  u <- u - gamma (I + Gamma)^-1 e,  0 < gamma < 2

Names differ in the literature: go by the formula. All three converge from everywhere when Gamma + Gamma' >= 0
and a solution exists; the first two slow down like |Gamma|/lambda_min(W), the third does not see |Gamma|. It
is run on

    s W, s c, q A, q b,
    s = 1/sqrt(max(lambda_min, 1e-9 lambda_max) lambda_max),  q = 10/max(sigma_min, 1e-3 sigma_max),

with the extreme eigenvalues of W and singular values of A, which leaves the solution x unchanged.
Source: Jin et al. 2017, section 3; He 1994, both papers; the scaling is an addition, derived in
docs/theory/recurrent-network.md.
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.dtrnn.infeasible import proven_infeasible
from ftqp.kernel.dtrnn.newton_jump import jump
from ftqp.kernel.dtrnn.projection import Network, project, rescale, residual
from ftqp.kernel.dtrnn.stopping import Options, is_solved, quality
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import E47, FAILED, IMPLICIT, INFEASIBLE, LVI94, MAX_ITERATIONS, SOLVED
from ftqp.kernel.maths.eigenvalues import extreme_eigenvalues, gram
from ftqp.kernel.maths.lu import lu_factor, lu_solve

STEADY = 1e-2
"""Largest change of e in a step, as a share of e, that counts as a straight stretch at first ..."""
STRICTER = 0.1
"""... and the factor on that share after a stretch that made |e| larger."""
NEARLY = 0.99
"""Share of the way to the next bound that is taken. Short of it, so that rounding takes no component past its
bound."""


@jit
def _to_next_side(w: float, rate: float, low: float, high: float) -> float:
    """How many steps until w, moving by ``rate`` a step, passes an end of [low, high]."""
    least = inf
    if rate != 0.0:
        for bound in (low, high):
            steps = (bound - w) / rate
            if 0.0 < steps < least:
                least = steps
    return least


@jit
def drift(net: Network, gamma: float, steady: float) -> bool:
    """Take all steps of the implicit method up to the next change of an active bound, when they are alike.

    While no w = u - (Gamma u + z) passes a bound, e changes with u by (Gamma d)_i inside and by d_i at a
    bound. Where a step d = -gamma (I + Gamma)^-1 e hardly changes e, the next one is nearly d again, and so
    on, often for thousands of steps: a multiplier has to grow by |d| a step until the next bound gives way.
    Then u <- u + t d, with t d short of the first change of a side and t |change of e| <= |e|: this is the
    method's own path, walked faster.
    Source: docs/theory/recurrent-network.md, "Straight stretches".
    """
    N = len(net.u)
    d = net.direction
    size, change = 0.0, 0.0
    for i in range(N):
        d[i] = -gamma * net.e[i]
        size = max(size, abs(net.e[i]))
    lu_solve(net.factor, N, net.pivots, d)
    steps = inf
    for i in range(N):
        row = net.Gamma[i]
        s = 0.0
        for j in range(N):
            s += row[j] * d[j]
        w = net.u[i] - net.F[i]
        inside = w > net.low[i] and w < net.high[i]
        change = max(change, abs(s) if inside else abs(d[i]))
        steps = min(steps, _to_next_side(w, d[i] - s, net.low[i], net.high[i]))
    steps = min(steps, size / change if change > 0.0 else inf)
    if not (change <= steady * size and 2.0 < steps < inf):
        return False
    for i in range(N):
        net.u[i] += NEARLY * steps * d[i]
    return True


JUMP_EVERY = 5
"""Iterations between two Newton jumps."""
CERTIFICATE_EVERY, PAPER_CERTIFICATE_EVERY = 50, 500
"""Iterations between two looks for a certificate of infeasibility."""
PATIENCE = 50
"""Iterations, outside paper mode, after which jumps are long ones, and a warm start is given up for zero:
huge multipliers of another QP take the network longer to lose than to find its own."""


@jit
def quick_scaling(net: Network) -> tuple[float, float]:
    """Scales that cost nothing: s = 1/min W_ii, floored at 1e-9 of the largest, and q = 1/max |row of A|."""
    smallest, largest, row = inf, 0.0, 0.0
    for i in range(net.variables):
        smallest, largest = min(smallest, net.Gamma[i, i]), max(largest, net.Gamma[i, i])
    first = net.variables + net.slacks
    for k in range(net.rows):
        s = 0.0
        for a in range(net.variables):
            s += net.Gamma[first + k, a] * net.Gamma[first + k, a]
        row = max(row, s)
    smallest = max(smallest, 1e-9 * largest)
    return (1.0 / smallest if largest > 0.0 else 1.0), (1.0 / sqrt(row) if row > 0.0 else 1.0)


@jit
def scaling_rule(net: Network) -> tuple[float, float]:
    """s and q of the module's formula, from the spectra of the unscaled W and A; the memory is ``jump``."""
    n, first = net.variables, net.variables + net.slacks
    S, a, b = net.jump, net.direction, net.trial
    s, q = 1.0, 1.0
    if n > 0:
        for i in range(n):
            for j in range(i + 1):
                S[i, j] = net.Gamma[i, j]
        least, largest = extreme_eigenvalues(S, n, a, b)
        least, largest = least / net.scales[0], largest / net.scales[0]
        if largest > 0.0:
            s = 1.0 / sqrt(max(least, 1e-9 * largest) * largest)
    size = gram(net.Gamma[first:], net.rows, n, S)
    if size > 0:
        least, largest = extreme_eigenvalues(S, size, a, b)
        top = sqrt(max(largest, 0.0)) / net.scales[1]
        if top > 0.0:
            q = 10.0 / max(sqrt(max(least, 0.0)) / net.scales[1], 1e-3 * top)
    return s, q


@jit
def factor_implicit(net: Network) -> None:
    """The factors of I + Gamma."""
    N = len(net.u)
    for i in range(N):
        for j in range(N):
            net.factor[i, j] = net.Gamma[i, j]
        net.factor[i, i] += 1.0
    lu_factor(net.factor, N, net.pivots)


@jit
def _prepare(net: Network, o: Options) -> None:
    """Scales, and the factors that the implicit method needs."""
    if o.scaling:
        s, q = scaling_rule(net)
        rescale(net, s, q)
    else:
        rescale(net, 1.0, 1.0)
    if o.method == IMPLICIT:
        factor_implicit(net)


@jit
def iterate(net: Network, method: int, gamma: float, size: float) -> None:
    """One step of the method; F, e and size = |e| are those of u."""
    N = len(net.u)
    d = net.direction
    if method == IMPLICIT:
        for i in range(N):
            d[i] = net.e[i]
        lu_solve(net.factor, N, net.pivots, d)
        for i in range(N):
            net.u[i] -= gamma * d[i]
        return
    for j in range(N):
        d[j] = 0.0
    for i in range(N):
        e = net.e[i]
        row = net.Gamma[i]
        for j in range(N):
            d[j] += row[j] * e
    total = 0.0
    for i in range(N):
        total += (d[i] + net.e[i]) ** 2
    if not total > 0.0:
        return
    rho = size * size / total
    for i in range(N):
        net.u[i] -= gamma * rho * (d[i] + (net.e[i] if method == LVI94 else net.F[i]))
    if method == E47:
        project(net, net.u)


@jit
def _note(net: Network, trace: Any, k: int, size: float) -> None:
    """Row k of the trace: |e|, r_eq, gap; the fourth column is set by a jump that succeeds."""
    if k < len(trace):
        r_eq, _, gap, _ = quality(net, net.u)
        trace[k, 0], trace[k, 1], trace[k, 2], trace[k, 3] = size, r_eq, gap, 0.0


@jit
def dtrnn(net: Network, o: Options, trace: Any) -> tuple[int, int]:
    """Run the network from its state u: SOLVED, MAX_ITERATIONS, INFEASIBLE or FAILED, and the iterations.

    Outside paper mode a jump comes first: while the active bounds are those of the start, or few Newton steps
    away, it is enough, and neither the scaling nor I + Gamma is needed. Later ones come every fifth
    iteration, as do looks for a straight stretch (``drift``). An accepted jump or a stretch counts as an
    iteration.

    Args:
        net: assembled, not scaled, with its start in u.
        o: options.
        trace: (iterations, 4) |e|, r_eq, gap and whether a jump succeeded, as far as it reaches.
    """
    early = o.newton and not o.paper
    if early:
        s, q = quick_scaling(net)
        rescale(net, s, q)
    else:
        _prepare(net, o)
    warm, steady = False, STEADY
    often = PAPER_CERTIFICATE_EVERY if o.paper else CERTIFICATE_EVERY
    for i in range(len(net.u)):
        warm = warm or net.u[i] != 0.0
    size = residual(net, net.u)
    for k in range(o.cap + 1):
        if not size < inf:
            return FAILED, k
        _note(net, trace, k, size)
        if is_solved(net, o, net.u, size):
            return SOLVED, k
        if k % often == often - 1 or k == o.cap:
            if proven_infeasible(net):
                return INFEASIBLE, k
            if k == o.cap:
                break
            size = residual(net, net.u)
        if k == PATIENCE and warm and not o.paper:
            for i in range(len(net.u)):
                net.u[i] = 0.0
            size = residual(net, net.u)
        if o.newton and k % JUMP_EVERY == 0:
            if jump(net, o, size, k >= PATIENCE and not o.paper):
                if k < len(trace):
                    trace[k, 3] = 1.0
                size = residual(net, net.u)
                continue
            if early:
                early = False
                _prepare(net, o)
            size = residual(net, net.u)
            if o.method == IMPLICIT and not o.paper and drift(net, o.gamma, steady):
                before, size = size, residual(net, net.u)
                if size > before:
                    steady *= STRICTER
                continue
        iterate(net, o.method, o.gamma, size)
        size = residual(net, net.u)
    return MAX_ITERATIONS, o.cap
