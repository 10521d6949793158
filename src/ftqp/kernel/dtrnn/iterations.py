"""The discrete-time recurrent network: the iterations that drive e(u) to zero.

e(u), Gamma, z and P are those of ``ftqp.kernel.dtrnn.network``. With rho = |e|^2 / |(Gamma' + I) e|^2:

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

from ftqp.kernel.dtrnn.network import (
    Network,
    Options,
    Problem,
    assemble,
    is_solved,
    options_of,
    publish,
    quality,
    rescale,
    residual,
    start,
)
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import E47, FAILED, IMPLICIT, INFEASIBLE, LVI94, MAX_ITERATIONS, SOLVED
from ftqp.kernel.layout.flat_arrays import KEPT, SIZES, VALID
from ftqp.kernel.layout.thresholds import PROOF_SHARE
from ftqp.kernel.maths.elementary import is_finite, matrix_view
from ftqp.kernel.maths.linear_systems import (
    assign,
    factor,
    lu_factor,
    lu_solve,
    minus_products,
    plus_products,
)
from ftqp.kernel.maths.symmetric_eigen import extreme_eigenvalues, gram

JUMP_EVERY = 5
"""Iterations between two Newton jumps."""
CERTIFICATE_EVERY, PAPER_CERTIFICATE_EVERY = 50, 500
"""Iterations between two looks for a certificate of infeasibility."""
PATIENCE = 50
"""Iterations, outside paper mode, after which a warm start is given up for zero: huge multipliers of another
QP take the network longer to lose than to find its own."""


@jit
def quick_scaling(net: Network) -> tuple[float, float]:
    """Scales that cost nothing: s = 1/min W_ii, floored at 1e-9 of the largest, and q = 1/max |row of A|."""
    smallest, largest, row = inf, 0.0, 0.0
    for i in range(net.variables):
        smallest, largest = min(smallest, net.Gamma[i, i]), max(largest, net.Gamma[i, i])
    first = net.variables + net.slacks
    for k in range(net.rows):
        s = plus_products(0.0, net.Gamma[first + k], net.Gamma[first + k], net.variables)
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
            assign(S[i], net.Gamma[i], i + 1)
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
        assign(net.factor[i], net.Gamma[i], N)
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
        assign(d, net.e, N)
        lu_solve(net.factor, N, net.pivots, d)
        for i in range(N):
            net.u[i] -= gamma * d[i]
        return
    d[:N] = 0.0
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
        for i in range(N):
            net.u[i] = min(max(net.u[i], net.low[i]), net.high[i])


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
    iteration; one that is refused is tried once more after ``approach``, and where that finds nothing, it
    comes again after twice as many iterations. Each time counts as an iteration.
    """
    early = o.newton and not o.paper
    if early:
        s, q = quick_scaling(net)
        rescale(net, s, q)
    else:
        _prepare(net, o)
    warm, again = False, o.cap + 1 if o.paper else 0
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
            net.u[:] = 0.0
            size = residual(net, net.u)
        if o.newton and k % JUMP_EVERY == 0:
            if jump(net, o, size):
                if k < len(trace):
                    trace[k, 3] = 1.0
                size = residual(net, net.u)
                continue
            if early:
                early = False
                _prepare(net, o)
            elif k >= again:
                if approach(net):
                    jump(net, o, residual(net, net.u))
                    size = residual(net, net.u)
                    continue
                again = 2 * k
            size = residual(net, net.u)
        iterate(net, o.method, o.gamma, size)
        size = residual(net, net.u)
    return MAX_ITERATIONS, o.cap


ACCEPTED = 0.5
"""Paper mode: a jump counts when it shrinks |e| at least by this factor. A convention
(docs/theory/recurrent-network.md, "Newton jumps"): a halved residual is progress that steps of the network
take long for."""
STEPS = 6
"""Newton steps of one jump outside paper mode."""
LONG_STEPS = 20
"""Most steps to the sides of a QP whose rows yield, in bounds of the network. With 4, 525 of the 1800 QPs of
``solvers/dtrnn_cap.py`` ended at the cap of iterations."""
TRIES = 3
"""Steps there without fewer wrong sides, before only one side is changed at a time."""
YIELDING = 1e-8
"""Compliance of hard rows there, relative to the QP's own magnitude."""


@jit
def _side(net: Network, v: Any, i: int) -> float:
    """-1 or 1 when w_i = v_i - F_i is at or beyond the lower or upper end of Omega, 0 inside."""
    w = v[i] - net.F[i]
    if not w > net.low[i]:
        return -1.0
    return 0.0 if w < net.high[i] else 1.0


@jit
def _change_sides(net: Network, v: Any, first: bool, single: bool) -> int:
    """Give components of x and s the side that v asks for, all or the last wrong one; how many were wrong."""
    wrong = 0
    for i in range(net.variables + net.slacks - 1, -1, -1):
        side = _side(net, v, i)
        if side != net.side[i]:
            if not single or wrong == 0:
                net.side[i] = side if first or net.side[i] == 0.0 else 0.0
            wrong += 1
    return wrong


@jit
def _unknowns(net: Network) -> int:
    """Put what the sides leave open into ``order`` and the rest into ``trial``; how many are open."""
    first = net.variables + net.slacks
    equalities = net.rows - net.slacks
    count = 0
    for i in range(first):
        net.trial[i] = 0.0
        if net.side[i] != 0.0:
            net.trial[i] = net.low[i] if net.side[i] < 0.0 else net.high[i]
        elif i < net.variables:
            net.order[count] = i
            count += 1
    for k in range(net.rows):
        net.trial[first + k] = 0.0
        if k < equalities or net.side[net.variables + k - equalities] != 0.0:
            net.order[count] = first + k
            count += 1
    return count


@jit
def _solve_unknowns(net: Network, count: int) -> None:
    """(Gamma trial + z)_i = 0 for the open components i; s = C x for the slacks inside."""
    N, first = len(net.z), net.variables + net.slacks
    S, right, trial = net.jump, net.direction, net.trial
    for a in range(count):
        i = int(net.order[a])
        row = net.Gamma[i]
        right[a] = minus_products(-net.z[i], row, trial, N)
        for c in range(count):
            S[a, c] = row[int(net.order[c])]
    lu_factor(S, count, net.jump_pivots)
    lu_solve(S, count, net.jump_pivots, right)
    for a in range(count):
        trial[int(net.order[a])] = right[a]
    for k in range(net.slacks):
        if net.side[net.variables + k] == 0.0:
            row = net.Gamma[first + net.rows - net.slacks + k]
            s = plus_products(0.0, row, trial, net.variables)
            trial[net.variables + k] = s / net.scales[1]


@jit
def right_sides(net: Network, v: Any) -> bool:
    """The Newton point whose sides are its own, into ``trial``, for rows that are all compliant.

    Newton steps from v; while the number of wrong sides does not fall, only the last of them is changed.

    Source: Júdice and Pires 1994, block principal pivoting.
    """
    bounds = net.variables + net.slacks
    net.side[:bounds] = 2.0
    fewest, tries = bounds + 1, TRIES
    for k in range(STEPS + LONG_STEPS * bounds):
        wrong = _change_sides(net, v if k == 0 else net.trial, k == 0, tries == 0)
        if wrong == 0:
            return k > 0
        if k > 0 and wrong < fewest:
            fewest, tries = wrong, TRIES
        elif tries > 0:
            tries -= 1
        _solve_unknowns(net, _unknowns(net))
        residual(net, net.trial)
    return False


@jit
def jump(net: Network, o: Options, size: float) -> bool:
    """Replace u by a Newton point u^, or leave it alone: whether it was replaced.

    With w = u - (Gamma u + z):  u^_i = the bound beyond which w_i lies,  (Gamma u^ + z)_i = 0 for the others.

    Paper mode: one step, taken when |e(u^)| < |e(u)|/2. Else up to ``STEPS`` in a row, each from the last u^,
    taken when u^ solves the QP: a point with a smaller |e| but huge multipliers can cost the base method
    thousands of iterations. Either way the base method converges as without jumps. F and e are those of the
    last u^, taken or not.

    Source: docs/theory/recurrent-network.md, "Newton jumps".
    """
    net.side[: net.variables + net.slacks] = 2.0
    for k in range(1 if o.paper else STEPS):
        if _change_sides(net, net.u if k == 0 else net.trial, k == 0, False) == 0:
            return False
        _solve_unknowns(net, _unknowns(net))
        found = residual(net, net.trial)
        if found < ACCEPTED * size if o.paper else is_solved(net, o, net.trial, found):
            assign(net.u, net.trial, len(net.u))
            return True
    return False


@jit
def yielding_solution(net: Network, pull: float) -> bool:
    """Into ``trial`` the solution of the QP whose hard rows yield a little; whether it was found.

    A x + c (y - pull y_u) = b, c = YIELDING |A|_F^2/(rows tr W), with y_u the multipliers of u.
    """
    primal, N = net.variables + net.slacks, len(net.u)
    trace, norm = 0.0, 0.0
    for i in range(net.variables):
        trace += net.Gamma[i, i]
        for k in range(net.rows):
            norm += net.Gamma[primal + k, i] * net.Gamma[primal + k, i]
    soft = YIELDING * norm / (max(net.rows, 1) * (trace if trace > 0.0 else 1.0)) + 1e-300
    for k in range(primal, N):
        net.side[k] = 0.0 if net.Gamma[k, k] > 0.0 else 1.0  # nobody else's: rows have no sides
        if net.side[k] != 0.0:
            net.Gamma[k, k] = soft
            net.z[k] -= soft * pull * net.u[k]
    residual(net, net.u)
    found = right_sides(net, net.u)
    for k in range(primal, N):
        if net.side[k] != 0.0:
            net.Gamma[k, k] = 0.0
            net.z[k] += soft * pull * net.u[k]
    return found


@jit
def approach(net: Network) -> bool:
    """Replace u by a step of the method of multipliers from it, or leave it alone: whether it was replaced.

    The step's multipliers are no farther from any solution's than those of u.
    Source: Rockafellar 1976; docs/theory/recurrent-network.md, "The method of multipliers".
    """
    if not (yielding_solution(net, 1.0) and residual(net, net.trial) < inf):
        return False
    assign(net.u, net.trial, len(net.u))
    return True


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
            yielding_solution(net, 0.0)
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
        assign(x, qp.x, n)
        assign(y, qp.y, m)
        assign(z, qp.z, p)
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
        assign(S[i], net.Gamma[i], i + 1)
        S[i, i] += CONVEX * largest
    return largest == 0.0 or factor(S, n)


@jit
def _is_number(net: Network) -> bool:
    """Whether Gamma and z are finite."""
    N = len(net.z)
    for i in range(N):
        if not is_finite(net.z[i]):
            return False
        for j in range(N):
            if not is_finite(net.Gamma[i, j]):
                return False
    return True


@jit
def solve_network(
    memory: Any, numbers: Any, trace: Any, warm: int, Q: Problem, x: Any, y: Any, z: Any, z_box: Any
) -> tuple[int, int, float]:
    """A QP with hard rows: code, iterations, |e|; outputs are written for SOLVED and MAX_ITERATIONS."""
    code, net = assemble(memory, Q)
    iterations, size = 0, 0.0
    if code == SOLVED and not (_is_number(net) and _is_convex(net)):
        code = FAILED
    if code == SOLVED:
        if warm:
            start(net, Q.m, x, y, z)
        code, iterations = dtrnn(net, options_of(numbers), trace)
        size = residual(net, net.u)
    if code == SOLVED or code == MAX_ITERATIONS:
        publish(net, Q, x, y, z, z_box)
    return code, iterations, size
