"""A QP as a network, and its state as a solution; ``ftqp.kernel.dtrnn.projection`` has the formulas."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.dtrnn.projection import Network, network
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FAILED, INFEASIBLE, SOLVED

CONTRADICTION = 1e-8
"""A row without free variables that is violated by more than this share of its terms has no solution. The
ROW_TOLERANCE of a solved QP, because what is less counts as kept."""


@jit
def _bounds_verdict(low: Any, high: Any, count: int) -> int:
    """SOLVED for ordered bounds, INFEASIBLE for crossed ones, FAILED for NaN."""
    verdict = SOLVED
    for i in range(count):
        if low[i] != low[i] or high[i] != high[i]:
            return FAILED
        if not low[i] <= high[i] or low[i] == inf or high[i] == -inf:
            verdict = INFEASIBLE
    return verdict


@jit
def _free_norm(row: Any, lb: Any, ub: Any, n: int) -> float:
    """Norm of a row over the variables that are not fixed."""
    s = 0.0
    for i in range(n):
        if lb[i] < ub[i]:
            s += row[i] * row[i]
    return sqrt(s)


@jit
def _fixed_part(row: Any, lb: Any, ub: Any, n: int) -> tuple[float, float]:
    """What the fixed variables contribute to a row, and the size of it."""
    s, size = 0.0, 0.0
    for i in range(n):
        if not lb[i] < ub[i] and row[i] != 0.0:
            s += row[i] * ub[i]
            size += abs(row[i] * ub[i])
    return s, size


@jit
def assemble(
    memory: Any,
    n: int,
    m: int,
    p: int,
    dense: int,
    H: Any,
    H_diagonal: Any,
    g: Any,
    A: Any,
    b: Any,
    soft: Any,
    C: Any,
    l: Any,
    u: Any,
    lb: Any,
    ub: Any,
) -> tuple[int, Network]:
    """Write the unscaled network of a QP, its state 0, into memory: a claim and the network.

    The claim is SOLVED, or INFEASIBLE or FAILED when the bounds say so already. The sizes of the QP are n
    variables, m equality rows and p two-sided rows; the arrays may be larger. ``dense`` tells whether H holds
    the Hessian, or else ``H_diagonal``; ``soft``, (m,), is the compliance of the rows of A, 0 for a hard one.
    ``memory`` holds at least ``memory_size(n, m, p)`` numbers.
    """
    verdict = max(_bounds_verdict(lb, ub, n), _bounds_verdict(l, u, p))
    variables = 0
    for i in range(n):
        if lb[i] < ub[i]:
            variables += 1
    equalities, slacks = 0, 0
    for k in range(m):
        if soft[k] > 0.0 or _free_norm(A[k], lb, ub, n) != 0.0:
            equalities += 1
        else:
            fixed, size = _fixed_part(A[k], lb, ub, n)
            if not abs(fixed - b[k]) <= CONTRADICTION * (1.0 + size + abs(b[k])):
                verdict = max(verdict, INFEASIBLE)
    for j in range(p):
        if l[j] == -inf and u[j] == inf:
            continue
        if _free_norm(C[j], lb, ub, n) != 0.0:
            if l[j] == u[j]:
                equalities += 1
            else:
                slacks += 1
        else:
            fixed, size = _fixed_part(C[j], lb, ub, n)
            if not max(l[j] - fixed, fixed - u[j]) <= CONTRADICTION * (1.0 + size):
                verdict = max(verdict, INFEASIBLE)
    rows = equalities + slacks
    net = network(memory, variables, slacks, rows)
    if verdict != SOLVED:
        return verdict, net
    N = variables + slacks + rows
    Gamma, z = net.Gamma, net.z
    net.scales[0] = net.scales[1] = 1.0
    for i in range(N):
        z[i], net.u[i], net.low[i], net.high[i] = 0.0, 0.0, -inf, inf
        for j in range(N):
            Gamma[i, j] = 0.0
    k = 0
    for i in range(n):
        if lb[i] < ub[i]:
            net.variable[k] = i
            net.low[k], net.high[k], z[k] = lb[i], ub[i], g[i]
            k += 1
    for a in range(variables):
        i = int(net.variable[a])
        if not dense:
            Gamma[a, a] = H_diagonal[i]
            continue
        for c in range(variables):
            Gamma[a, c] = H[i, int(net.variable[c])]
        fixed, _ = _fixed_part(H[i], lb, ub, n)
        z[a] += fixed
    at, s = 0, 0
    for k in range(m):
        if soft[k] > 0.0 or _free_norm(A[k], lb, ub, n) != 0.0:
            fixed, _ = _fixed_part(A[k], lb, ub, n)
            r = variables + slacks + at
            net.row[at], net.norm[at] = k, 1.0
            z[r], Gamma[r, r] = fixed - b[k], soft[k]
            for a in range(variables):
                v = A[k, int(net.variable[a])]
                Gamma[r, a], Gamma[a, r] = v, -v
            at += 1
    for j in range(p):
        norm = _free_norm(C[j], lb, ub, n)
        if (l[j] == -inf and u[j] == inf) or norm == 0.0:
            continue
        fixed, _ = _fixed_part(C[j], lb, ub, n)
        if l[j] == u[j]:
            k = at
            at += 1
            z[variables + slacks + k] = (fixed - u[j]) / norm
        else:
            k = equalities + s
            c = variables + s
            s += 1
            net.low[c], net.high[c] = (l[j] - fixed) / norm, (u[j] - fixed) / norm
            Gamma[variables + slacks + k, c], Gamma[c, variables + slacks + k] = -1.0, 1.0
        net.row[k], net.norm[k] = m + j, norm
        r = variables + slacks + k
        for a in range(variables):
            v = C[j, int(net.variable[a])] / norm
            Gamma[r, a], Gamma[a, r] = v, -v
    return SOLVED, net


@jit
def start(net: Network, n: int, m: int, x: Any, y: Any, z: Any) -> None:
    """Start an unscaled network at a former solution (x, y, z) in the convention of ``ftqp.QP``."""
    primal = net.variables + net.slacks
    equalities = net.rows - net.slacks
    for a in range(net.variables):
        net.u[a] = x[int(net.variable[a])]
    for k in range(net.rows):
        i = int(net.row[k])
        net.u[primal + k] = -y[i] if i < m else -z[i - m] * net.norm[k]
    for s in range(net.slacks):
        row = net.Gamma[primal + equalities + s]
        value = 0.0
        for a in range(net.variables):
            value += row[a] * net.u[a]
        net.u[net.variables + s] = min(max(value, net.low[net.variables + s]), net.high[net.variables + s])


@jit
def publish(
    net: Network,
    n: int,
    m: int,
    p: int,
    dense: int,
    H: Any,
    H_diagonal: Any,
    g: Any,
    A: Any,
    C: Any,
    lb: Any,
    ub: Any,
    x: Any,
    y: Any,
    z: Any,
    z_box: Any,
) -> None:
    """The QP's solution: x clipped, y and z by the convention of ``ftqp.QP``, z_box from stationarity.

    z_box_i = -(Hx + g + A'y + C'z)_i where x_i is fixed or x_i + scales[0] z_box_i is outside, else 0.
    """
    primal = net.variables + net.slacks
    for i in range(n):
        x[i] = ub[i]
    for a in range(net.variables):
        x[int(net.variable[a])] = min(max(net.u[a], net.low[a]), net.high[a])
    for k in range(m):
        y[k] = 0.0
    for j in range(p):
        z[j] = 0.0
    scale = net.scales[1] / net.scales[0]
    for k in range(net.rows):
        i = int(net.row[k])
        value = -net.u[primal + k] * scale
        if i < m:
            y[i] = value
        else:
            z[i - m] = value / net.norm[k]
    for i in range(n):
        if dense:
            r = g[i]
            for j in range(n):
                r += H[i, j] * x[j]
        else:
            r = g[i] + H_diagonal[i] * x[i]
        for k in range(m):
            r += A[k, i] * y[k]
        for j in range(p):
            r += C[j, i] * z[j]
        step = x[i] - net.scales[0] * r
        z_box[i] = -r if lb[i] >= ub[i] or step < lb[i] or step > ub[i] else 0.0
