"""The recurrent network's form of a QP: a projection equation e(u) = 0 in primal and dual variables.

    min 1/2 x'Wx + c'x,  A x + diag(soft) y = b,  l <= C x <= u,  lb <= x <= ub

becomes, with s = C x in [l, u] as variables of their own and u = (x; s; y),

    Gamma = [[W, 0, -A', -C'], [0, 0, 0, I], [A, 0, diag(soft), 0], [C, -I, 0, 0]],   z = (c; 0; -b; 0),
    Omega = [lb, ub] x [l, u] x R^m,   e(u) = u - P(u - (Gamma u + z)) = 0  <=>  u solves the QP,

P being the projection onto Omega, a clip. Here L = f(x) - y'(Ax - b), so that y is minus that of ``ftqp.QP``.
The dual's bounds of +-1e10 in the paper stand for no bounds. A compliant row A_k x + s_k = b_k with cost
s_k^2/(2 soft_k) has s_k = soft_k y_k.

Fixed variables (lb = ub) are eliminated, rows of C are divided by their norm, those with l = u need no s,
those without a bound are left out. The matrices are scaled by the rule of ``ftqp.kernel.dtrnn.iterations``:
the objective by ``scales[0]``, the rows by ``scales[1]``, so that y of the network is ``scales[0]/scales[1]``
times that of the QP.
Source: Jin et al. 2017, section 3; the slacks and the compliance are additions.
"""

from math import inf, sqrt
from typing import Any, NamedTuple

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FAILED, INFEASIBLE, SOLVED
from ftqp.kernel.maths.elementary import matrix_view
from ftqp.kernel.maths.linear_systems import assign, plus_products


class Network(NamedTuple):
    """Gamma, z, Omega = [low, high] and the state u in memory; N = variables + slacks + rows."""

    variables: int
    """How many free variables there are, how many two-sided rows have a slack, ..."""
    slacks: int
    rows: int
    """... and how many multipliers there are; the last ones belong to the slacks."""
    Gamma: Any
    z: Any
    low: Any
    high: Any
    u: Any
    """The state (x; s; y), (N,)."""
    F: Any
    """Gamma u + z, (N,)."""
    e: Any
    """The residual, (N,)."""
    factor: Any
    """The factors of I + Gamma, (N, N), and those of the last jump."""
    jump: Any
    pivots: Any
    jump_pivots: Any
    order: Any
    """The open components of a jump, (N,), whole numbers."""
    side: Any
    """Which bound each component sits at in a jump, (N,): -1, 0 or 1."""
    direction: Any
    trial: Any
    """The point that a jump tries, (N,)."""
    variable: Any
    """The index in the QP of each free variable, and of each row, those of C after those of A."""
    row: Any
    norm: Any
    """What each row was divided by."""
    scales: Any
    """Of objective and rows, (2,)."""


class Problem(NamedTuple):
    """A QP of n variables, m equality rows and p two-sided rows, whose arrays may be larger.

    ``dense`` says whether H holds the Hessian, or else ``H_diagonal``; ``soft``, (m,), is the compliance of
    the rows of A, 0 for a hard one.
    """

    n: int
    m: int
    p: int
    dense: int
    H: Any
    H_diagonal: Any
    g: Any
    A: Any
    b: Any
    soft: Any
    C: Any
    l: Any
    u: Any
    lb: Any
    ub: Any


@jit
def network(memory: Any, variables: int, slacks: int, rows: int) -> Network:
    """The views of a network of these sizes, one after the other in ``memory``."""
    N = variables + slacks + rows
    M = N * N
    v = matrix_view(memory, 3 * M, 15, N)
    scales = memory[3 * M + 15 * N : 3 * M + 15 * N + 2]
    return Network(
        variables, slacks, rows, matrix_view(memory, 0, N, N), v[0], v[1], v[2], v[3], v[4], v[5],
        matrix_view(memory, M, N, N), matrix_view(memory, 2 * M, N, N),
        v[6], v[7], v[8], v[9], v[10], v[11], v[12], v[13], v[14], scales,
    )  # fmt: skip


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
def _row(Q: Problem, k: int) -> Any:
    """Row k of [A; C]."""
    return Q.A[k] if k < Q.m else Q.C[k - Q.m]


@jit
def _ends(Q: Problem, k: int) -> tuple[float, float]:
    """Between what row k of [A; C] is to be."""
    return (Q.b[k], Q.b[k]) if k < Q.m else (Q.l[k - Q.m], Q.u[k - Q.m])


@jit
def _weigh_row(Q: Problem, k: int) -> tuple[float, float, float]:
    """The norm of row k over the free variables, what the fixed ones add to it, and the size of that."""
    row = _row(Q, k)
    square, fixed, size = 0.0, 0.0, 0.0
    for i in range(Q.n):
        if Q.lb[i] < Q.ub[i]:
            square += row[i] * row[i]
        elif row[i] != 0.0:
            fixed += row[i] * Q.ub[i]
            size += abs(row[i] * Q.ub[i])
    return sqrt(square), fixed, size


LEFT_OUT, EQUALITY, WITH_SLACK = 0, 1, 2
"""What becomes of a row."""


@jit
def _kind(Q: Problem, k: int, norm: float) -> int:
    """What becomes of row k: one that no free variable moves is left out, if it does not yield."""
    if k < Q.m:
        return EQUALITY if Q.soft[k] > 0.0 or norm != 0.0 else LEFT_OUT
    low, high = _ends(Q, k)
    if norm == 0.0 or (low == -inf and high == inf):
        return LEFT_OUT
    return EQUALITY if low == high else WITH_SLACK


@jit
def assemble(memory: Any, Q: Problem) -> tuple[int, Network]:
    """Write the unscaled network of a QP, its state 0, into memory: a claim and the network.

    The claim is SOLVED, or INFEASIBLE or FAILED when the bounds say so already. ``memory`` holds at least
    ``memory_size(n, m, p)`` numbers.
    """
    n, m, H, lb, ub = Q.n, Q.m, Q.H, Q.lb, Q.ub
    verdict = max(_bounds_verdict(lb, ub, n), _bounds_verdict(Q.l, Q.u, Q.p))
    variables = equalities = slacks = 0
    for i in range(n):
        if lb[i] < ub[i]:
            variables += 1
    for k in range(m + Q.p):
        norm, fixed, size = _weigh_row(Q, k)
        kind = _kind(Q, k, norm)
        if kind == EQUALITY:
            equalities += 1
        elif kind == WITH_SLACK:
            slacks += 1
        else:
            low, high = _ends(Q, k)
            most = CONTRADICTION * (1.0 + size + (abs(low) if k < m else 0.0))
            if not max(low - fixed, fixed - high) <= most:
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
        Gamma[i, :N] = 0.0
    k = 0
    for i in range(n):
        if lb[i] < ub[i]:
            net.variable[k] = i
            net.low[k], net.high[k], z[k] = lb[i], ub[i], Q.g[i]
            k += 1
    for a in range(variables):
        i = int(net.variable[a])
        if not Q.dense:
            Gamma[a, a] = Q.H_diagonal[i]
            continue
        for c in range(variables):
            Gamma[a, c] = H[i, int(net.variable[c])]
        fixed = 0.0
        for c in range(n):
            if not lb[c] < ub[c] and H[i, c] != 0.0:
                fixed += H[i, c] * ub[c]
        z[a] += fixed
    at, s = 0, 0
    for k in range(m + Q.p):
        norm, fixed, _ = _weigh_row(Q, k)
        kind = _kind(Q, k, norm)
        if kind == LEFT_OUT:
            continue
        low, high = _ends(Q, k)
        norm = 1.0 if k < m else norm
        if kind == EQUALITY:
            j = at
            at += 1
            z[variables + slacks + j] = (fixed - high) / norm
        else:
            j, c = equalities + s, variables + s
            s += 1
            net.low[c], net.high[c] = (low - fixed) / norm, (high - fixed) / norm
            Gamma[variables + slacks + j, c], Gamma[c, variables + slacks + j] = -1.0, 1.0
        net.row[j], net.norm[j] = k, norm
        r, row = variables + slacks + j, _row(Q, k)
        Gamma[r, r] = Q.soft[k] if k < m else 0.0
        for a in range(variables):
            v = row[int(net.variable[a])] / norm
            Gamma[r, a], Gamma[a, r] = v, -v
    return SOLVED, net


@jit
def start(net: Network, m: int, x: Any, y: Any, z: Any) -> None:
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
        value = plus_products(0.0, row, net.u, net.variables)
        net.u[net.variables + s] = min(max(value, net.low[net.variables + s]), net.high[net.variables + s])


@jit
def publish(net: Network, Q: Problem, x: Any, y: Any, z: Any, z_box: Any) -> None:
    """The QP's solution: x clipped, y and z by the convention of ``ftqp.QP``, z_box from stationarity.

    z_box_i = -(Hx + g + A'y + C'z)_i where x_i is fixed or x_i + scales[0] z_box_i is outside, else 0.
    """
    n, m, p, H, A, C, lb, ub = Q.n, Q.m, Q.p, Q.H, Q.A, Q.C, Q.lb, Q.ub
    primal = net.variables + net.slacks
    assign(x, ub, n)
    for a in range(net.variables):
        x[int(net.variable[a])] = min(max(net.u[a], net.low[a]), net.high[a])
    y[:m] = 0.0
    z[:p] = 0.0
    scale = net.scales[1] / net.scales[0]
    for k in range(net.rows):
        i = int(net.row[k])
        value = -net.u[primal + k] * scale
        if i < m:
            y[i] = value
        else:
            z[i - m] = value / net.norm[k]
    for i in range(n):
        r = plus_products(Q.g[i], H[i], x, n) if Q.dense else Q.g[i] + Q.H_diagonal[i] * x[i]
        r = plus_products(r, A[:, i], y, m)
        r = plus_products(r, C[:, i], z, p)
        step = x[i] - net.scales[0] * r
        z_box[i] = -r if lb[i] >= ub[i] or step < lb[i] or step > ub[i] else 0.0


@jit
def rescale(net: Network, objective: float, rows: float) -> None:
    """Scale Gamma, z and y to another scale of objective and rows; the solution x stays the same.

    Gamma^ = [[s W, -q A'], [q A, (q^2/s) soft]],  z^ = (s c; -q b),  y^ = y s/q
    """
    s, q = objective / net.scales[0], rows / net.scales[1]
    net.scales[0], net.scales[1] = objective, rows
    primal = net.variables + net.slacks
    N = primal + net.rows
    for i in range(N):
        net.z[i] *= s if i < primal else q
        for j in range(N):
            if i < primal and j < primal:
                net.Gamma[i, j] *= s
            elif i < primal or j < primal:
                net.Gamma[i, j] *= q
            else:
                net.Gamma[i, j] *= q * q / s
        if i >= primal:
            net.u[i] *= s / q


@jit
def residual(net: Network, u: Any) -> float:
    """e = u - P(u - F) with F = Gamma u + z, both kept; returns |e|."""
    N = len(u)
    total = 0.0
    for i in range(N):
        row = net.Gamma[i]
        F = plus_products(net.z[i], row, u, N)
        net.F[i] = F
        e = u[i] - min(max(u[i] - F, net.low[i]), net.high[i])
        net.e[i] = e
        total += e * e
    return sqrt(total)


ROW_TOLERANCE = 1e-8
"""Largest |Ax - b| of a solved QP, beside max(1, |b|). A convention (docs/theory/recurrent-network.md, "When
to stop"): 10 nm of a path in metres."""
ROUNDING = 1e-14
"""Rounding of a sum, relative to its largest terms. 45 units of rounding, for some 60 terms."""
GAP_TOLERANCE = 1e-14
"""Largest duality gap of a solved QP, beside 1 + |x'Wx| + |c'x|. It bounds (x - x*)'W(x - x*)
(docs/theory/recurrent-network.md, "When to stop"), so that x is off by 1e-7 in the norm of W."""


class Options(NamedTuple):
    """How to solve."""

    method: int
    """LVI94, E47 or IMPLICIT of ``ftqp.kernel.dtrnn.iterations``."""
    scaling: int
    newton: int
    """Whether to scale, and whether to jump."""
    paper: int
    """Whether |e| <= tolerance alone is the end; else it is relative to 1 + |x|."""
    cap: int
    """Most iterations."""
    gamma: float
    tolerance: float
    """Step size, and tolerance of |e|."""


@jit
def options_of(numbers: Any) -> Options:
    """Options from seven numbers in the order of the fields."""
    o = numbers
    return Options(int(o[0]), int(o[1]), int(o[2]), int(o[3]), int(o[4]), o[5], o[6])


@jit
def quality(net: Network, u: Any) -> tuple[float, float, float, float]:
    """What u is worth as a solution after clipping, in the QP's units: (r_eq, its scale, gap, its scale).

    With x clipped and g = Wx + c - A'y,

        r_eq = max |Ax - b|,  gap = sum max(g_i (x_i - lb_i), g_i (x_i - ub_i)) >= 0,

    and for r_eq = 0 both f(x) - f* <= gap and (x - x*)'W(x - x*) <= gap. Slacks count as variables.
    Source: docs/theory/recurrent-network.md, "When to stop".
    """
    N, primal = len(u), net.variables + net.slacks
    v = net.direction
    for i in range(N):
        v[i] = min(max(u[i], net.low[i]), net.high[i])
    gap, energy, r_eq, right = 0.0, 0.0, 0.0, 0.0
    for i in range(N):
        row = net.Gamma[i]
        force = plus_products(net.z[i], row, v, primal)
        s = force
        for j in range(primal, N):
            s += row[j] * v[j]
        if i < primal:
            if s != 0.0:
                gap += s * (v[i] - (net.low[i] if s > 0.0 else net.high[i]))
            energy += (abs(force) + abs(net.z[i])) * abs(v[i])
        else:
            unit = net.norm[i - primal] / net.scales[1]
            r_eq = max(r_eq, abs(s) * unit)
            right = max(right, abs(net.z[i]) * unit)
    return r_eq, max(1.0, right), gap / net.scales[0], 1.0 + energy / net.scales[0]


@jit
def _rounding(net: Network, u: Any) -> float:
    """What rounding leaves of |e| at best: ROUNDING max_i sum_j |Gamma_ij u_j|."""
    N = len(u)
    largest = 0.0
    for i in range(N):
        row = net.Gamma[i]
        s = 0.0
        for j in range(N):
            s += abs(row[j] * u[j])
        largest = max(largest, s)
    return ROUNDING * largest


@jit
def is_solved(net: Network, o: Options, u: Any, size: float) -> bool:
    """Whether u, with e its residual and |e| = size, may be called solved.

    Paper: |e| <= tolerance. Else r_eq <= 1e-8 max(1, |b|) and (|e| <= tolerance (1 + |x|), or |e| is no more
    than rounding, or gap <= 1e-14 (1 + energy)).
    """
    if o.paper:
        return size <= o.tolerance
    primal = net.variables + net.slacks
    most = 1.0
    for i in range(primal):
        most = max(most, abs(u[i]))
    small = size <= o.tolerance * (1.0 + most)
    if not small:
        if size > 1e-3 * (1.0 + most):
            return False
        for k in range(net.rows):
            if abs(net.e[primal + k]) > 1e-6 * net.scales[1] * (1.0 + most):
                return False
        small = size <= _rounding(net, u)
    r_eq, right, gap, energy = quality(net, u)
    if not r_eq <= ROW_TOLERANCE * right:
        return False
    return small or gap <= GAP_TOLERANCE * energy
