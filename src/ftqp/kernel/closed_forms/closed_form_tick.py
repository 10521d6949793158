"""A tick with a closed form in the place of the QP.

Everything before is that of every tick. A closed form x_cf inside the box and the torque rows is the command;
else the command is the allowed one that is nearest, min |x - x_cf|^2 over box and torque rows, and the status
is RELAXED. When that QP cannot be solved, the cascade goes on (``ftqp.kernel.judge.fallback_cascade``).

Which kappa keeps the rates y(kappa) = V diag(sigma/(sigma^2 + kappa)) c inside a limit.

All of them take the thin SVD of the reduced Jacobian, J_f: with the SVD of the full one ``bound`` is not
safe, and the square V is not unique. c is short for U' right, ||V|| for the largest absolute row sum of V.
Source: Bedrossian 1993, equations 15 and 16 (there for the healthy arm); docs/theory/singularities.md,
"Damping", derives the rules.

The approximate pseudoinverse J-dagger: position first, orientation with the wrist that is left.

At the wrist centre the Jacobian of an arm with a spherical wrist is [[B, 0], [D, E]], and

    J-dagger = [[B+, 0], [-E+ D B+, E+]],   v_arm = B+ v_w,  v_wrist = E+ (omega - D v_arm),

B+ and E+ being truncated: singular values up to ``threshold`` are dropped (in metres for B).
Source: Holt and Desrochers 1994, equation 8. They turn both halves into frame 6; along W the blocks are
rotated from the left, which leaves singular values and J-dagger's product with the twist as they are. Its
defect is derived in docs/theory/singularities.md.
"""

from math import sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import point_column
from ftqp.kernel.jit import jit
from ftqp.kernel.judge.fallback_cascade import run_cascade
from ftqp.kernel.layout.enums import (
    ANSWERED,
    APPROXIMATE,
    BOUND,
    BOUND_2,
    DAMPED,
    EXACT_2,
    FREE,
    MAIN_STAGE,
    OK,
    QP_READY,
    RELAXED,
    ROW,
    SOLVE,
    SOLVED,
    TIGHT,
)
from ftqp.kernel.maths.linear_systems import assign, factor, minus_products, plus_products, solve_factored
from ftqp.kernel.maths.svd import svd
from ftqp.kernel.maths.vectors import ZERO, cross, minus, plus, three, three_from, times, write
from ftqp.kernel.rows.constraint_rows import add_constraints, keeps_torque
from ftqp.kernel.rows.joint_intervals import draw

ITERATIONS = 200
"""Newton steps at most."""
CLOSE = 1e-13
"""Relative distance to the limit at which a root counts as found. Some 500 units of rounding, because sums of
products that cancel leave that much of a norm."""


@jit
def _spread(P: Any) -> float:
    """||V|| max |c|, an upper bound of sigma-weighted rates."""
    norm = largest = 0.0
    for i in range(P.f):
        s = 0.0
        for k in range(P.rank):
            s += abs(P.V[k, i])
        norm = max(norm, s)
    for k in range(P.rank):
        largest = max(largest, abs(P.c[k]))
    return norm * largest


@jit
def bound(P: Any) -> float:
    """(||V|| max |c| / (2 limit))^2, since sigma/(sigma^2 + kappa) <= 1/(2 sqrt kappa)."""
    half = 0.5 * _spread(P) / P.limit
    return half * half


@jit
def bound_2(P: Any) -> float:
    """(|right| / (2 limit))^2: the same in the 2-norm, where ||V|| = 1; it needs no SVD."""
    s = plus_products(0.0, P.right, P.right, P.m)
    return 0.25 * s / (P.limit * P.limit)


@jit
def tight(P: Any) -> float:
    """max_k max(0, sigma_k/rho - sigma_k^2), rho = limit/(||V|| max |c|): equation 15 solved exactly."""
    spread = _spread(P)
    kappa = 0.0
    for k in range(P.rank):
        kappa = max(kappa, P.sigma[k] * (spread / P.limit - P.sigma[k]))
    return kappa


@jit
def _row_step(P: Any) -> float:
    """Towards the root of max_i sum_k |V_ik c_k| sigma_k/(sigma_k^2 + kappa) = limit.

    Each row's sum P falls and 1/P is concave in kappa, so that Newton's method on 1/P - 1/limit climbs to the
    root from the left, for all rows at once.
    """
    step = 0.0
    for i in range(P.f):
        s = slope = 0.0
        for k in range(P.rank):
            term = abs(P.V[k, i] * P.c[k]) * P.sigma[k] * P.w[k]
            s += term
            slope += term * P.w[k]
        if s > P.limit * (1.0 + CLOSE):
            step = max(step, s * (s - P.limit) / (P.limit * slope))
    return step


@jit
def _exact_2_step(P: Any) -> float:
    """Towards the root of |y(kappa)|_2 = limit, by Newton's method on 1/|y| - 1/limit from the left.

    y is then the least-squares solution among all with |y|_2 <= limit. Source: Moré and Sorensen 1983.
    """
    s = slope = 0.0
    for k in range(P.rank):
        y = P.c[k] * P.sigma[k] * P.w[k]
        s += y * y
        slope += y * y * P.w[k]
    norm = sqrt(s)
    return s * (norm - P.limit) / (P.limit * slope) if norm > P.limit * (1.0 + CLOSE) else 0.0


@jit
def _exact_inf_step(P: Any) -> float:
    """Towards the smallest kappa with max |y(kappa)| <= limit, which need not fall; no root is passed.

    |y_i| of a joint outside its limit is p - q with sums p and q of terms of one sign, both falling and
    convex in kappa, and p > limit + q. When kappa grows, the joint stays outside at least for the steps

        p (p - q - limit) / ((limit + q) |p'|)     (q at its value, 1/p below its tangent), and
        2 e / (-y' + sqrt(y'^2 + 2 q'' e)),        e = |y_i| - limit (y above y + y' d - q'' d^2/2);

    the second makes the convergence quadratic. The largest such step of any joint is safe.
    Source: docs/theory/singularities.md, "Finding the smallest kappa".
    """
    step, limit = 0.0, P.limit
    for i in range(P.f):
        p = p1 = q = q1 = q2 = 0.0
        for k in range(P.rank):
            term = P.V[k, i] * P.c[k] * P.sigma[k] * P.w[k]
            w = P.w[k]
            if term > 0.0:
                p += term
                p1 += term * w
            else:
                q -= term
                q1 -= term * w
                q2 -= 2.0 * term * w * w
        if q > p:  # the joint runs backwards
            p, q = q, p
            p1, q1 = q1, p1
            q2 = 0.0
            for k in range(P.rank):
                term = P.V[k, i] * P.c[k] * P.sigma[k] * P.w[k]
                if term > 0.0:
                    q2 += 2.0 * term * P.w[k] * P.w[k]
        excess = p - q - limit
        if excess > limit * CLOSE:
            falling = p1 - q1  # -y'
            step = max(step, p * excess / ((limit + q) * p1))
            root = sqrt(falling * falling + 2.0 * q2 * excess)
            if falling + root > 0.0:
                step = max(step, 2.0 * excess / (falling + root))
    return step


@jit
def _root(P: Any) -> float:
    """kappa from 0 on by the steps of the rule."""
    kappa = 0.0
    for _ in range(ITERATIONS):
        for k in range(P.rank):
            P.w[k] = 1.0 / (P.sigma[k] * P.sigma[k] + kappa)
        if P.rule == ROW:
            step = _row_step(P)
        elif P.rule == EXACT_2:
            step = _exact_2_step(P)
        else:
            step = _exact_inf_step(P)
        if step <= 1e-16 * kappa:
            break
        kappa += step
    return kappa


@jit
def outside(P: Any) -> bool:
    """Whether y breaks the limit, in the 2-norm by EXACT_2, else in the largest rate."""
    largest = total = 0.0
    for j in range(P.f):
        y = abs(P.y[j])
        largest = max(largest, y)
        total += y * y
    if P.rule == EXACT_2:
        return not total <= P.limit * P.limit
    return not largest <= P.limit


@jit
def damping_factor(P: Any) -> float:
    """kappa by the rule of the problem, whose SVD is there."""
    if P.rule == BOUND:
        return bound(P)
    if P.rule == BOUND_2:
        return bound_2(P)
    if P.rule == TIGHT:
        return tight(P)
    return _root(P)


WRIST = 3
"""Joints of a spherical wrist."""


@jit
def _block(P: Any, first_row: int, first: int, end: int) -> None:
    """J <- three rows of A over the working joints first..end-1."""
    f = 0
    for i in range(first, end):
        if not P.failed[i]:
            P.joint[f] = i
            for k in range(3):
                P.J[k, f] = P.A[first_row + k, i]
            f += 1
    P.f = f


@jit
def _truncated(P: Any) -> None:
    """x of the block's joints = its truncated inverse times right."""
    svd(P)
    for j in range(P.f):
        P.x[P.joint[j]] = 0.0
    for k in range(P.r):
        if P.sigma[k] > P.threshold:
            t = P.c[k] / P.sigma[k]
            for j in range(P.f):
                P.x[P.joint[j]] += P.V[k, j] * t


@jit
def approximate_inverse(P: Any) -> None:
    """x = J-dagger b, A being the Jacobian at the wrist centre, (6, n), linear rows first, in m."""
    n, rows = P.n, P.m
    arm = n - WRIST
    P.m = 3
    assign(P.x, P.rate, n)
    for k in range(3):
        s = P.b[k]
        for i in range(n):
            if P.failed[i]:
                s -= P.A[k, i] * P.rate[i]
        P.right[k] = s
    _block(P, 0, 0, arm)
    _truncated(P)
    for k in range(3):
        s = P.b[3 + k]
        for i in range(n):
            if i < arm or P.failed[i]:
                s -= P.A[3 + k, i] * P.x[i]
        P.right[k] = s
    _block(P, 3, arm, n)
    _truncated(P)
    P.m = rows


@jit
def wrist_jacobian(task: Any, kinematics: Any, chain: Any, qp: Any, P: Any) -> None:
    """A and b at the wrist centre from the tick's kinematics and the task's twist.

    p_w = o + wrist z of the last joint but one; the twist moves there by v_w = v - omega x (p_tip - p_w).
    """
    n = chain.n
    middle = n - 2
    p = plus(three(kinematics.o[middle]), times(P.wrist, three(kinematics.axis_w[middle])))
    for i in range(n):
        P.A[0, i], P.A[1, i], P.A[2, i] = point_column(kinematics, chain, i, p)
        turn = ZERO if chain.prismatic[i] else three(kinematics.axis_w[i])
        P.A[3, i], P.A[4, i], P.A[5, i] = turn
    for k in range(3):
        P.b[3 + k] = qp.b[3 + k] / task.row_scale[3 + k]
    moved = cross(three_from(P.b, 3), minus(three(kinematics.o_tip), p))
    write(P.b, 0, minus(three(qp.b), moved))


@jit
def gather(P: Any, A: Any, b: Any, scale: float) -> None:
    """J, right and f from rows scale A and right sides scale b, the failed joints and their rates."""
    f = 0
    for i in range(P.n):
        if not P.failed[i]:
            P.joint[f] = i
            f += 1
    P.f = f
    for k in range(P.m):
        row, J = A[k], P.J[k]
        for j in range(f):
            i = P.joint[j]
            J[j] = scale * P.column[i] * row[i]
        right = b[k]
        if f < P.n:
            for i in range(P.n):
                if P.failed[i]:
                    right -= row[i] * P.rate[i]
        P.right[k] = scale * right


@jit
def scatter(P: Any) -> None:
    """x of all joints from y of the working ones and the rates of the failed ones."""
    assign(P.x, P.rate, P.n)
    for j in range(P.f):
        i = P.joint[j]
        P.x[i] = P.column[i] * P.y[j]


CONDITIONED = 1e-8
"""Least pivot of J J', relative to its diagonal, down to which it is factored. One refinement is then enough,
because rounding, 1e-16, grows by the pivot's inverse: to 1e-8 at first, and to 1e-16 once refined."""
REFINED = 1e-3
"""Least such pivot down to which the solution needs no refinement. Rounding leaves 1e-13 of it, for the same
reason."""


@jit
def _by_cholesky(P: Any) -> bool:
    """y = J'(J J')^-1 right, refined where that helps; False when J J' is too near singular, or J is tall."""
    m, f = P.m, P.f
    if f < m:
        return False
    J, L = P.J, P.L
    for i in range(m):
        for j in range(i + 1):
            L[i, j] = plus_products(0.0, J[i], J[j], f)
        P.pivot[i] = L[i, i]
    if not factor(L, m):
        return False
    worst = 0.0
    for i in range(m):
        worst = max(worst, L[i, i] * L[i, i] * P.pivot[i])
    if not worst * CONDITIONED <= 1.0:
        return False
    P.y[:f] = 0.0
    assign(P.w, P.right, m)
    for refinement in range(1 if worst * REFINED <= 1.0 else 2):
        if refinement:
            for i in range(m):
                P.w[i] = minus_products(P.right[i], J[i], P.y, f)
        solve_factored(L, m, P.w)
        for i in range(m):
            row, t = J[i], P.w[i]
            for k in range(f):
                P.y[k] += row[k] * t
    return True


@jit
def damped(P: Any, kappa: float) -> None:
    """y = V diag(sigma/(sigma^2 + kappa)) c over the singular values above the cut-off; kappa = 0: J^+ right.

    Source: Bedrossian 1993, equation 8, in the form that holds for every kappa >= 0.
    """
    P.y[: P.f] = 0.0
    for k in range(P.rank):
        row = P.V[k]
        t = P.c[k] * P.sigma[k] / (P.sigma[k] * P.sigma[k] + kappa)
        for j in range(P.f):
            P.y[j] += row[j] * t


@jit
def closed_form(P: Any) -> None:
    """x of all joints: the pseudoinverse, or damped by ``rule`` when that breaks ``limit``; kappa.

    J and right have been filled in. With weights, column = 1/sqrt(weight) turns the least |y| into the least
    x'diag(weight) x; with a limit for each joint, column = limit_i / limit. Where the last tick was damped,
    the SVD comes first: it will be needed again.
    Source: docs/theory/singularities.md.
    """
    factored = not P.kappa > 0.0 and _by_cholesky(P)
    P.kappa = 0.0
    if not factored:
        svd(P)
        damped(P, 0.0)
    if P.method == DAMPED and outside(P):
        if factored:
            svd(P)
        P.kappa = damping_factor(P)
        damped(P, P.kappa)
    scatter(P)


INSIDE = 1e-9
"""A bound exceeded by less than this share of 1 + its size is met: rounding of a rate exactly at a limit. A
pseudoinverse with pivots of 1e-8 may lose as many as half of its sixteen digits."""


@jit
def _failed_joints(state: Any, faults: Any, chain: Any, qp: Any, P: Any) -> None:
    """Which joints the closed form cannot use, and their rates: prescribed, or measured of a free one."""
    P.n = chain.n
    P.swings = 0
    for k in range(faults.working):
        i = faults.order[k]
        P.failed[i], P.rate[i] = 0, 0.0
    for k in range(faults.working, faults.movable):
        i = faults.order[k]
        P.failed[i], P.rate[i] = 1, state.v[i]
        P.swings += 1
    for k in range(faults.movable, chain.n):
        i = faults.order[k]
        P.failed[i], P.rate[i] = 1, qp.lb[i]


@jit
def _eliminate_free_joints(faults: Any, chain: Any, qp: Any, P: Any) -> None:
    """Put the motion of every free-swinging joint, its torque row C_i x = l_i, into the rows A x = b.

    Gauss on the free joints: E holds (C_i | l_i) triangular in them, with unit pivots. C over the free joints
    is a part of M with friction, so no pivot vanishes.
    """
    n = chain.n
    free = 0
    for i in range(n):
        if faults.code[i] == FREE:
            E = P.E[free]
            E[n] = qp.l[i]
            for j in range(n):
                E[j] = qp.C[i, j]
                if P.failed[j] and faults.code[j] != FREE:
                    E[n] -= E[j] * P.rate[j]
                    E[j] = 0.0
            P.swinging[free] = i
            free += 1
    for c in range(free):
        i = P.swinging[c]
        E = P.E[c]
        inverse = 1.0 / E[i]
        for j in range(n + 1):
            E[j] *= inverse
        for d in range(c + 1, free):
            t = P.E[d, i]
            for j in range(n + 1):
                P.E[d, j] -= t * E[j]
        for k in range(P.m):
            t = P.A[k, i]
            for j in range(n):
                P.A[k, j] -= t * E[j]
            P.b[k] -= t * E[n]
            P.A[k, i] = 0.0


@jit
def _free_rates(chain: Any, P: Any) -> None:
    """The rates of the free-swinging joints that follow from those of the others."""
    for c in range(P.swings - 1, -1, -1):
        E = P.E[c]
        i = P.swinging[c]
        s = E[chain.n]
        for j in range(chain.n):
            if j != i:
                s -= E[j] * P.x[j]
        P.x[i] = s


@jit
def _limits(limits: Any, chain: Any, P: Any) -> None:
    """Limits a joint, as believed now: column_i = v_max_i / limit, limit the largest of them."""
    limit = 0.0
    for i in range(chain.n):
        if P.failed[i] == 0:
            limit = max(limit, limits.v_max[i])
    P.limit = limit
    for i in range(chain.n):
        P.column[i] = limits.v_max[i] / limit if P.failed[i] == 0 else 1.0


@jit
def resolve_task(K: Any, P: Any) -> None:
    """x of the closed form for the task's rows of this tick, into P."""
    chain, task, qp = K.chain, K.task, K.qp
    _failed_joints(K.state, K.faults, chain, qp, P)
    if P.method == APPROXIMATE:
        P.m = 6
        wrist_jacobian(task, K.kinematics, chain, qp, P)
        approximate_inverse(P)
        return
    if P.own_limits:
        _limits(K.limits, chain, P)
    P.m = task.m
    inverse = 1.0 / task.length
    if P.swings and qp.nc > 0:
        for k in range(task.m):
            P.b[k] = qp.b[k]
            assign(P.A[k], qp.A[k], chain.n)
        _eliminate_free_joints(K.faults, chain, qp, P)
        gather(P, P.A, P.b, inverse)
        closed_form(P)
        _free_rates(chain, P)
    else:
        gather(P, qp.A, qp.b, inverse)
        closed_form(P)


@jit
def _task_slack(task: Any, chain: Any, qp: Any) -> None:
    """slack = A x - asked."""
    for k in range(task.m):
        task.slack[k] = plus_products(-task.asked[k], qp.A[k], qp.x, chain.n)


@jit
def _is_allowed(K: Any) -> bool:
    """Whether x lies in the interval, and in the torque rows where they are needed."""
    chain, limits, qp = K.chain, K.limits, K.qp
    n = chain.n
    for i in range(n):
        x, lo, hi = qp.x[i], qp.lb[i], qp.ub[i]
        if not (x >= lo - INSIDE * (1.0 + abs(lo)) and x <= hi + INSIDE * (1.0 + abs(hi))):
            return False
    if limits.on_demand and not K.kinematics.has_dynamics and not keeps_torque(K):
        add_constraints(K)
    for j in range(qp.nc):
        s = plus_products(0.0, qp.C[j], qp.x, n)
        lo, hi = qp.l[j], qp.u[j]
        if not (s >= lo - INSIDE * (1.0 + abs(lo)) and s <= hi + INSIDE * (1.0 + abs(hi))):
            return False
    return True


@jit
def _has_moved(chain: Any, qp: Any, P: Any) -> bool:
    """Whether the command is another than the closed form's."""
    for i in range(chain.n):
        if not abs(qp.x[i] - P.x[i]) <= INSIDE * (1.0 + abs(P.x[i])):
            return True
    return False


@jit
def resolve(K: Any, P: Any, prepared: int) -> int:
    """A prepared tick with the closed form: the status."""
    chain, task, cascade, qp = K.chain, K.task, K.cascade, K.qp
    cascade.kappa = 0.0
    code = prepared
    if code != QP_READY:  # a stop or an input that is not finite
        return run_cascade(K, code, SOLVED)
    resolve_task(K, P)
    cascade.kappa = P.kappa
    n = chain.n
    qp.nx, qp.meq, qp.dense = n, 0, 0
    for i in range(n):
        x = P.x[i]
        qp.x[i] = x
        draw(qp, i, 1.0, x)
        qp.z_box[i] = 0.0
    qp.z[: qp.nc] = 0.0
    qp.y[: task.m] = 0.0
    _task_slack(task, chain, qp)
    code = run_cascade(K, ANSWERED if _is_allowed(K) else SOLVE, SOLVED)
    if cascade.stage == MAIN_STAGE:
        if cascade.qp_iterations == 0:
            cascade.claim = -1
        elif _has_moved(chain, qp, P) and (code == OK or code == RELAXED):
            _task_slack(task, chain, qp)
            cascade.missed = 1
            cascade.status = code = RELAXED
    return code


@jit
def resolve_reduced(P: Any) -> None:
    """x of a reduced problem alone, by its method."""
    if P.method == APPROXIMATE:
        approximate_inverse(P)
    else:
        gather(P, P.A, P.b, 1.0)
        closed_form(P)


@jit
def damp_reduced(P: Any) -> None:
    """kappa of a reduced problem by its rule, whether or not the undamped rates break the limit."""
    gather(P, P.A, P.b, 1.0)
    svd(P)
    P.kappa = damping_factor(P)
