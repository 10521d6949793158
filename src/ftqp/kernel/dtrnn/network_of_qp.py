"""A QP as a network, and its state as a solution; ``ftqp.kernel.dtrnn.projection`` has the formulas."""

from math import inf, sqrt
from typing import Any, NamedTuple

from ftqp.kernel.dtrnn.iterations import dtrnn
from ftqp.kernel.dtrnn.projection import Network, is_number, network, options_of, residual
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import FAILED, INFEASIBLE, MAX_ITERATIONS, SOLVED
from ftqp.kernel.layout.flat_arrays import KEPT, SIZES, VALID
from ftqp.kernel.maths.elementary import matrix_view
from ftqp.kernel.maths.linear_systems import factor


@jit
def _row_kind(low: float, high: float) -> float:
    """2 for an equality, 1 for an inequality."""
    return 2.0 if low == high else 1.0


@jit
def _same_structure(qp: Any, kept: Any) -> bool:
    """Whether sizes, fixed variables and equality rows are those of the warm start; from now on they are."""
    same = kept[SIZES] == qp.nx and kept[SIZES + 1] == qp.meq and kept[SIZES + 2] == qp.nc
    kept[SIZES], kept[SIZES + 1], kept[SIZES + 2] = qp.nx, qp.meq, qp.nc
    for i in range(qp.nx):
        kind = _row_kind(qp.lb[i], qp.ub[i])
        same = same and kept[KEPT + i] == kind
        kept[KEPT + i] = kind
    for j in range(qp.nc):
        kind = _row_kind(qp.l[j], qp.u[j])
        same = same and kept[KEPT + qp.nx + j] == kind
        kept[KEPT + qp.nx + j] = kind
    return same


class Problem(NamedTuple):
    """A QP of n variables, m equality rows and p two-sided rows, whose arrays may be larger.

    ``dense`` tells whether H holds the Hessian, or else ``H_diagonal``; ``soft``, (m,), is the compliance of
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


@part_jit
def solve_planner_qp(cascade: Any, qp: Any, memory: Any) -> int:
    """The QP that stands in a planner's record, from the warm start if there is one; the claim."""
    n, m, p = qp.nx, qp.meq, qp.nc
    Q = Problem(
        n, m, p, qp.dense, qp.H, qp.H_diagonal, qp.g, qp.A, qp.b, qp.soft, qp.C, qp.l, qp.u, qp.lb, qp.ub
    )
    at = KEPT + n + p
    x, y, z = memory[at : at + n], memory[at + n : at + n + m], memory[at + n + m : at + n + m + p]
    rest = memory[at + n + m + p :]
    warm = _same_structure(qp, memory) and memory[VALID] != 0.0
    memory[VALID] = 0.0
    cascade.qp_iterations = 0
    code, net = assemble(rest, Q)
    if code != SOLVED:
        return code
    if warm:
        start(net, m, x, y, z)
    code, cascade.qp_iterations = dtrnn(net, options_of(memory), matrix_view(rest, 0, 0, 4))
    publish(net, Q, qp.x, qp.y, qp.z, qp.z_box)
    if code == SOLVED:
        memory[VALID] = 1.0
        for i in range(n):
            x[i] = qp.x[i]
        for k in range(m):
            y[k] = qp.y[k]
        for j in range(p):
            z[j] = qp.z[j]
    return code


CONVEX = 1e-9
"""H + CONVEX max(H_ii) I has a Cholesky factor when H counts as positive semidefinite: rounding makes
eigenvalues of zero some 1e-15 of the largest."""


@jit
def _is_convex(net: Network) -> bool:
    """Whether W is positive semidefinite, up to rounding."""
    n, S = net.variables, net.jump
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(net.Gamma[i, i]))
    for i in range(n):
        for j in range(i + 1):
            S[i, j] = net.Gamma[i, j]
        S[i, i] += CONVEX * largest
    return largest == 0.0 or factor(S, n)


@jit
def solve_network_standalone(
    memory: Any,
    numbers: Any,
    trace: Any,
    n: int,
    m: int,
    p: int,
    warm: int,
    H: Any,
    g: Any,
    A: Any,
    b: Any,
    C: Any,
    l: Any,
    u: Any,
    lb: Any,
    ub: Any,
    x: Any,
    y: Any,
    z: Any,
    z_box: Any,
) -> tuple[int, int, float]:
    """One QP with hard rows: code, iterations and |e|; outputs are written for SOLVED and MAX_ITERATIONS."""
    soft = memory[len(memory) - m :]
    for k in range(m):
        soft[k] = 0.0
    Q = Problem(n, m, p, 1, H, g, g, A, b, soft, C, l, u, lb, ub)
    code, net = assemble(memory, Q)
    iterations, size = 0, 0.0
    if code == SOLVED and not (is_number(net) and _is_convex(net)):
        code = FAILED
    if code == SOLVED:
        if warm:
            start(net, m, x, y, z)
        code, iterations = dtrnn(net, options_of(numbers), trace)
        size = residual(net, net.u)
    if code == SOLVED or code == MAX_ITERATIONS:
        publish(net, Q, x, y, z, z_box)
    return code, iterations, size


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
def assemble(memory: Any, Q: Problem) -> tuple[int, Network]:
    """Write the unscaled network of a QP, its state 0, into memory: a claim and the network.

    The claim is SOLVED, or INFEASIBLE or FAILED when the bounds say so already. ``memory`` holds at least
    ``memory_size(n, m, p)`` numbers.
    """
    n, m, p, H, A, C, l, u, lb, ub = Q.n, Q.m, Q.p, Q.H, Q.A, Q.C, Q.l, Q.u, Q.lb, Q.ub
    b, soft = Q.b, Q.soft
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
            net.low[k], net.high[k], z[k] = lb[i], ub[i], Q.g[i]
            k += 1
    for a in range(variables):
        i = int(net.variable[a])
        if not Q.dense:
            Gamma[a, a] = Q.H_diagonal[i]
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
        value = 0.0
        for a in range(net.variables):
            value += row[a] * net.u[a]
        net.u[net.variables + s] = min(max(value, net.low[net.variables + s]), net.high[net.variables + s])


@jit
def publish(net: Network, Q: Problem, x: Any, y: Any, z: Any, z_box: Any) -> None:
    """The QP's solution: x clipped, y and z by the convention of ``ftqp.QP``, z_box from stationarity.

    z_box_i = -(Hx + g + A'y + C'z)_i where x_i is fixed or x_i + scales[0] z_box_i is outside, else 0.
    """
    n, m, p, H, A, C, lb, ub = Q.n, Q.m, Q.p, Q.H, Q.A, Q.C, Q.lb, Q.ub
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
        if Q.dense:
            r = Q.g[i]
            for j in range(n):
                r += H[i, j] * x[j]
        else:
            r = Q.g[i] + Q.H_diagonal[i] * x[i]
        for k in range(m):
            r += A[k, i] * y[k]
        for j in range(p):
            r += C[j, i] * z[j]
        step = x[i] - net.scales[0] * r
        z_box[i] = -r if lb[i] >= ub[i] or step < lb[i] or step > ub[i] else 0.0
