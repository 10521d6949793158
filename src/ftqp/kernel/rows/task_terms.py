"""Further tasks as terms of the objective, and what a command leaves of them.

Those that share what is left with the scheme are terms weight/2 |J x - b|^2; those before the scheme are the
same, raised above its objective; those beside the tip's task are terms weight/(2 soft) |J x - b|^2, with soft
the compliance of the tip's rows, so that they are as firm as these.
Source: docs/theory/further-tasks.md.
"""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import ACCELERATION, SCALE
from ftqp.kernel.layout.scene_room import AXIS, BEFORE_SCHEME, BESIDE_TIP, JOINT_PLACES
from ftqp.kernel.layout.thresholds import MISSED_FROM, RELAXED_FROM, TASK_FLOOR
from ftqp.kernel.maths.elementary import select
from ftqp.kernel.maths.linear_systems import assign, factor, plus_products, solve_factored
from ftqp.kernel.maths.side_by_side import WIDTH, lane_mask, load_lanes, numbers, sin_cos, store_lanes, sum_of
from ftqp.kernel.rows.further_tasks import error_of, term_rows
from ftqp.kernel.rows.task_rows import component_of

BEND = 0.1
"""Share of the bound of the error's second derivative that D has. With kv = 2 sqrt(kp) a tenth of the second
derivative itself is damped by 1/3 of critical; all of the bound would make hands that have far to go several
times slower."""
STRICT = 1e4
"""By how much what goes before the scheme outweighs it, as shares of tr H, with rows in characteristic
lengths. The scheme then keeps it from 1e-3 of what it wants of it, or less. With the rows of level 1 a
million times above, ten thousand times more would leave the scheme's own directions less than six digits."""
SLOWED = 0.01
"""The share of D beside them: the whole of it keeps the scheme waiting while such a task has far to go, and
without it an arm jolts on its way through places where the task's rows vanish."""
REGULAR = 1e-6
"""What is added to A A', as a share of its largest entry, where the tip's own motion is looked for: at a
singularity it is then bounded."""


@jit
def _couple(qp: Any, n: int) -> None:
    """H as a whole, of an objective that was a diagonal so far."""
    for i in range(n):
        for at in range(0, n, WIDTH):
            store_lanes(qp.H[i], at, 0.0 * numbers(at))
        qp.H[i, i] = qp.H_diagonal[i]
    qp.dense = 1


@jit
def _add_row(qp: Any, n: int, row: Any, b: float, weight: float) -> None:
    """weight/2 (row x - b)^2."""
    for i in range(n):
        c = weight * row[i]
        if c != 0.0:
            qp.g[i] -= c * b
            for at in range(0, n, WIDTH):
                store_lanes(qp.H[i], at, load_lanes(qp.H[i], at) + c * load_lanes(row, at))


@jit
def _follow_joints(K: Any, t: int, factor: float) -> None:
    """A task of joints with a weight; it keeps the objective a diagonal."""
    terms, state, qp = K.terms, K.state, K.qp
    for i in range(K.chain.n):
        e = terms.q_goal[t, i] - state.q[i]
        if K.chain.continuous[i]:  # the short way round
            sine, cosine = sin_cos(0.5 * e)
            e = 2.0 * sine if cosine >= 0.0 else -2.0 * sine
        asked = terms.kp[t] * e
        if state.level == ACCELERATION:
            asked -= terms.kv[t] * state.v[i]
        weight = factor * terms.share[t, i]
        qp.H_diagonal[i] += weight
        if qp.dense:
            qp.H[i, i] += weight
        qp.g[i] -= weight * asked


@jit
def _has(terms: Any, t: int, k: int) -> bool:
    """Whether task t has row k."""
    return bool(terms.rows[t] & (1 << k))


@jit
def _weigh(terms: Any, qp: Any, n: int, t: int, b: Any, weight: float) -> None:
    """weight/2 |J x - b|^2 of one task."""
    if not qp.dense:
        _couple(qp, n)
    for k in range(6):
        if _has(terms, t, k):
            _add_row(qp, n, terms.J[t, k], b[k], weight)


@part_jit
def add_terms(K: Any) -> None:
    """The terms of all soft tasks, added to H and g; needs ``forward_kinematics`` and ``motion``."""
    terms, n = K.terms, K.chain.n
    terms.stands = terms.added = 0.0
    terms.bends = 1
    before = 0.0
    for t in range(terms.count):
        if terms.hard[t]:
            continue
        of_joints = terms.kind[t] == JOINT_PLACES
        if not of_joints:
            term_rows(K, t)
        if terms.shares[t] == BESIDE_TIP:
            assign(terms.b[t], terms.asked[t], 6)
        elif terms.shares[t] == BEFORE_SCHEME:
            before += terms.weight[t]
        elif of_joints:
            _follow_joints(K, t, terms.weight[t])
        elif terms.weight[t] != 0.0:
            _weigh(terms, K.qp, n, t, terms.asked[t], terms.weight[t])
    if before > 0.0:
        _put_before_scheme(K, before)


@jit
def _put_before_scheme(K: Any, total: float) -> None:
    """The tasks of level 2 as terms that outweigh all that H has so far.

        more weight/2 (|J x - b|^2 + SLOWED (x + kv v)'D (x + kv v)),   more = STRICT tr H/(L^2 sum weight)

    As the weights grow the answer goes to that of a QP of its own, of which the scheme has what is left. L is
    the length that a radian counts, and not |J|, so that rows that vanish count for nothing. D is as in
    ``share``.
    """
    terms, state, qp, n, x = K.terms, K.state, K.qp, K.chain.n, K.scratch.joints
    trace = 0.0
    for i in range(n):
        trace += qp.H[i, i] if qp.dense else qp.H_diagonal[i]
    more = STRICT * trace / (terms.length * terms.length)
    for t in range(terms.count):
        weight = more * (terms.weight[t] / total)
        if terms.shares[t] != BEFORE_SCHEME or weight == 0.0:
            continue
        if terms.kind[t] == JOINT_PLACES:
            _follow_joints(K, t, weight)
            continue
        _weigh(terms, qp, n, t, terms.asked[t], weight)
        for i in range(n):
            x[i] = -terms.kv[t] * state.v[i] if state.level == ACCELERATION else 0.0
        _bend(terms, qp, n, t, SLOWED * weight, x)


@jit
def _carried_along(state: Any, task: Any, kinematics: Any, chain: Any, qp: Any, scratch: Any) -> None:
    """The least x that moves the tip as its target moves, and brakes what else does, into ``scratch.joints``.

    x_0 = A^+ (b - kp e + kv A v) - kv v, A^+ = A' (A A' + eps)^-1: where all targets stand still it is the
    braking alone, so that it moves no place where tasks balance each other.
    """
    n, m, S, y, x = chain.n, task.m, scratch.square, scratch.rows, scratch.joints
    kv = task.kv if state.level == ACCELERATION else 0.0
    largest = 0.0
    for k in range(m):
        s = qp.b[k] - (qp.A[k, n] if task.mode == SCALE else 0.0)
        c = task.rows[k]
        s -= task.kp * task.row_scale[c] * component_of(task, kinematics, c, 0, task.error)
        for i in range(n):
            s += kv * qp.A[k, i] * state.v[i]
        y[k] = s
        for j in range(k + 1):
            S[k, j] = plus_products(0.0, qp.A[k], qp.A[j], n)
        largest = max(largest, S[k, k])
    for k in range(m):
        S[k, k] += REGULAR * largest + 1e-300
    if factor(S, m):
        solve_factored(S, m, y)
    for i in range(n):
        x[i] = plus_products(-kv * state.v[i], qp.A[:, i], y, m)


@jit
def _bend(terms: Any, qp: Any, n: int, t: int, weight: float, x: Any) -> float:
    """weight/2 (x - x_0)'D(x - x_0), D of the size of what the error of a task bends by; how tr H grows.

    The second derivative of a place along two joints is no longer than the column of the outer one, so that
    with c_j the lengths of the columns |e| sum_j c_max(i, j) is more than a row of it; d_i is a part of that.
    """
    position, rotation = error_of(terms, t)
    e = position + rotation * (1.0 if terms.kind[t] == AXIS else terms.length)
    if e == 0.0:
        return 0.0
    outer = grown = 0.0
    inner = 0
    for i in range(n):  # how many joints move it
        inner += 1 if _column(terms, t, i) > 0.0 else 0
    for i in range(n - 1, -1, -1):
        c = _column(terms, t, i)
        if c == 0.0:
            continue
        d = BEND * weight * e * (outer + inner * c)
        outer, inner = outer + c, inner - 1
        qp.H[i, i] += d
        qp.H_diagonal[i] += d
        qp.g[i] -= d * x[i]
        grown += d
    return grown


@jit
def _column(terms: Any, t: int, i: int) -> float:
    """The length of a column of a task's rows."""
    squares = 0.0
    for k in range(6):
        if _has(terms, t, k):
            squares += terms.J[t, k, i] * terms.J[t, k, i]
    return sqrt(squares)


@part_jit
def share(K: Any, firmness: float) -> None:
    """The tasks beside the tip's at a firmness, in place of how they stood.

        weight firmness/2 (|J x - b|^2 + (x - x_0)'D(x - x_0))

    D has the size of what the error bends by: without it a hand that is stretched towards a target beyond its
    reach would swing for ever. x_0 goes along with the tip's target, so that D does not hold that back. Where
    what a first QP has found is kept, ``bends`` is 0, there is no D.
    """
    terms, qp, n = K.terms, K.qp, K.chain.n
    more, grown = firmness - terms.stands, 0.0
    if terms.bends:
        _carried_along(K.state, K.task, K.kinematics, K.chain, qp, K.scratch)
    for t in range(terms.count):
        weight = terms.weight[t]
        if terms.shares[t] != BESIDE_TIP or weight == 0.0:
            continue
        _weigh(terms, qp, n, t, terms.b[t], weight * more)
        for i in range(n):
            c = _column(terms, t, i)
            grown += weight * more * c * c
        if terms.bends:
            grown += _bend(terms, qp, n, t, weight * more, K.scratch.joints)
    terms.stands, terms.added = firmness, terms.added + grown


@part_jit
def keep_shared(terms: Any, chain: Any, qp: Any) -> None:
    """b <- J x of the tasks beside that of the tip: a further QP is to keep what x reaches of them."""
    for t in range(terms.count):
        for k in range(6):
            if terms.shares[t] == BESIDE_TIP and _has(terms, t, k):
                terms.b[t, k] = plus_products(0.0, terms.J[t, k], qp.x, chain.n)


@part_jit
def judge_terms(K: Any, attempted: bool) -> None:
    """What the command leaves of every further task, and how many of those that count are missed."""
    terms, feedback, qp, n = K.terms, K.feedback, K.qp, K.chain.n
    terms.missed, terms.worst = 0, 0.0
    for t in range(terms.count):
        size = most = 0.0
        posed = terms.weight[t] != 0.0 and (terms.hard[t] != 0 or terms.stands >= 0.0)
        for k in range(6):
            terms.slack[t, k] = 0.0
            if attempted and posed and _has(terms, t, k):
                products = 0.0
                for at in range(0, n, WIDTH):
                    x = select(lane_mask(n, at), load_lanes(qp.x, at), 0.0)
                    products = products + load_lanes(terms.J[t, k], at) * x
                terms.slack[t, k] = sum_of(products) - terms.asked[t, k]
                size, most = max(size, abs(terms.asked[t, k])), max(most, abs(terms.slack[t, k]))
        if not terms.required[t] or not posed:
            continue
        if most > (MISSED_FROM if terms.shares[t] else RELAXED_FROM) * size + TASK_FLOOR:
            terms.missed += 1
        position, rotation = error_of(terms, t)
        terms.worst = max(terms.worst, position / feedback.tolerance, rotation / feedback.rotation_tolerance)
