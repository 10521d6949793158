"""Proof that no point keeps the bounds and rows of a network's QP."""

from math import inf
from typing import Any

from ftqp.kernel.dtrnn.newton_jump import harden, right_sides, soften
from ftqp.kernel.dtrnn.projection import Network, residual
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.thresholds import PROOF_SHARE
from ftqp.kernel.maths.lu import lu_factor, lu_solve

SHARE = 0.5
"""What the proof must exceed, as a share of |y|^2; at the point nearest to all constraints it is 1. Half of
that is left, so that rounding has no say (docs/theory/recurrent-network.md, "Infeasibility")."""
VIOLATION = 1e-8
"""Smallest violation, as a share of 1 + |b| + |x|, that may count as a proof. The ROW_TOLERANCE of a solved
QP, because what is less counts as kept."""
RAY = 1e-10
"""Largest share of its terms that A'y may keep along a variable without a bound on that side. Five digits
above the rounding of a sum."""


@jit
def _missing(net: Network, x: Any, y: Any) -> tuple[float, float]:
    """y <- b - A x on the hard rows, 0 on the compliant ones; its largest entry and the size of its terms."""
    primal = net.variables + net.slacks
    worst, size = 0.0, 0.0
    for k in range(net.rows):
        r = primal + k
        y[k] = 0.0
        if net.Gamma[r, r] > 0.0:
            continue
        s = -net.z[r]
        size = max(size, abs(s))
        for j in range(primal):
            s -= net.Gamma[r, j] * x[j]
            size = max(size, abs(net.Gamma[r, j] * x[j]))
        y[k] = s
        worst = max(worst, abs(s))
    return worst, size


@jit
def _proves(net: Network, y: Any) -> bool:
    """Whether b'y - sum max((A'y)_i lb_i, (A'y)_i ub_i) > 0 beyond rounding, as in no feasible QP."""
    primal = net.variables + net.slacks
    value, size, length = 0.0, 0.0, 0.0
    for k in range(net.rows):
        value -= net.z[primal + k] * y[k]
        size += abs(net.z[primal + k] * y[k])
        length += y[k] * y[k]
    for j in range(primal):
        t, terms = 0.0, 0.0
        for k in range(net.rows):
            v = net.Gamma[primal + k, j] * y[k]
            t += v
            terms += abs(v)
        bound = net.high[j] if t > 0.0 else net.low[j]
        if bound == inf or bound == -inf:
            if abs(t) > RAY * terms:
                return False
        else:
            value -= t * bound
            size += terms * abs(bound)
    return value > SHARE * length and value > PROOF_SHARE * size


@jit
def _nearest(net: Network, x: Any) -> None:
    """Move inner components of x to the least squares of the hard rows: (A'A + eps I) dx = A'(b - A x)."""
    primal = net.variables + net.slacks
    S, order, right = net.jump, net.order, net.direction
    y = net.e
    _missing(net, x, y)
    count = 0
    largest = 0.0
    for j in range(primal):
        if x[j] > net.low[j] and x[j] < net.high[j]:
            order[count] = j
            count += 1
    for a in range(count):
        i = int(order[a])
        right[a] = 0.0
        for k in range(net.rows):
            right[a] += net.Gamma[primal + k, i] * y[k]
        for c in range(count):
            j = int(order[c])
            s = 0.0
            for k in range(net.rows):
                r = primal + k
                if not net.Gamma[r, r] > 0.0:
                    s += net.Gamma[r, i] * net.Gamma[r, j]
            S[a, c] = s
            largest = max(largest, abs(s))
    for a in range(count):
        S[a, a] += 1e-13 * largest
    lu_factor(S, count, net.jump_pivots)
    lu_solve(S, count, net.jump_pivots, right)
    for a in range(count):
        x[int(order[a])] += right[a]


@jit
def proven_infeasible(net: Network) -> bool:
    """Whether b'y - sum max((A'y)_i lb_i, (A'y)_i ub_i) > |y|^2/2 for y = b - A x at one of three points.

    The sum is over variables and slacks. For a feasible x* the left side is at most b'y - (A'y)'x* = 0, so
    this cannot hold but by rounding, for which there is a margin. The points are the clipped x, the nearest
    one with its active bounds, and the one where rows that yield come to rest. e, F and the memory of a jump
    are overwritten.
    Source: docs/theory/recurrent-network.md, "Infeasibility".
    """
    primal = net.variables + net.slacks
    x, y = net.trial, net.e
    for attempt in range(4):
        if attempt == 2:
            soften(net)
            residual(net, net.u)
            right_sides(net, net.u)
            harden(net)
        for j in range(primal):
            x[j] = min(max(net.u[j] if attempt < 2 else x[j], net.low[j]), net.high[j])
        if attempt == 1 or attempt == 3:
            _nearest(net, x)
            _nearest(net, x)
        worst, size = _missing(net, x, y)
        if not worst > VIOLATION * (net.scales[1] + size):
            if attempt == 2:
                return False
        elif _proves(net, y):
            return True
    return False
