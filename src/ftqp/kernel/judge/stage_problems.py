"""The QPs of the fallback cascade's stages, in the order of ``ftqp.kernel.judge.fallback_cascade``.

Each takes up the record's QP as the stage before has left it. That of settling is in
``ftqp.kernel.settling``.

Torque limits and box that exclude each other: what the torque limits have to give, and the proof.

The least excess is found by a QP of its own, whose objective is well scaled whatever the planner's scheme
is. Then the rows are widened by it, so that the task's QP has a solution, with rows as hard as ever. To weigh
torque rows against the task in one QP takes multipliers that drown in rounding where a criterion such as
|tau|^2 is nearly singular.
Source: docs/theory/joint-limits.md, "Torque limits and box".
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.judge.solution_check import is_beyond_range, is_too_fast
from ftqp.kernel.layout.enums import ACCELERATION, SLACK, SOLVED, STOPPED, STOPPING
from ftqp.kernel.layout.thresholds import AT_REST, FREE_SHARE, LAST, PROOF_SHARE
from ftqp.kernel.maths.elementary import is_finite
from ftqp.kernel.maths.linear_systems import assign, factor, minus_products, plus_products, solve_factored
from ftqp.kernel.rows.holding_rows import keep_again, leave_to_motors
from ftqp.kernel.rows.joint_intervals import AT_LIMIT, bound, draw, lighten, narrow, widen
from ftqp.kernel.rows.objective import add_manipulability, objective
from ftqp.kernel.rows.task_rows import compliance, softness
from ftqp.kernel.rows.task_terms import keep_shared, share

BRAKING_SHARE = 0.25
"""Where torque limits cannot be kept in a stop, each joint brakes by this share of what it wants at least.
Joints swung at their limits to lessen an excess that nothing removes
(tests/robustness/test_stopped_arm.py); the quarter is a guess."""


@jit
def deceleration(v: float, last: float, a_max: float, time: float, rise: float, dt: float) -> float:
    """The acceleration that brings v to zero within ``time``, at most a_max, and none of it suddenly.

    With a jerk limit j = a_max/rise, a^2/(2 j) + a dt/2 <= |v|, the speed that falling by j dt a tick takes,
    so that it ends at rest with a = 0; and a differs from the last one by j dt at most. An acceleration that
    still speeds the joint up ends at once, and so does what a limit that was lowered since leaves of it.
    """
    a = min(abs(v) / time, a_max)
    if rise > dt:
        jerk = a_max / rise
        half = 0.5 * jerk * dt
        a = min(a, sqrt(half * half + 2.0 * jerk * abs(v)) - half)
        braked = min(max(-last if v > 0.0 else last, 0.0), a_max)
        a = min(max(a, braked - jerk * dt), braked + jerk * dt, abs(v) / dt)
    return -a if v > 0.0 else a


@rare_jit
def draw_to_rest(K: Any, time: float, rise: float, weight: float) -> None:
    """Objective weight |x - x_rest|^2/2; x_rest brings the joints that work to rest by ``deceleration``.

    What a free-swinging joint does counts little: the others are not to brake late to spare it.
    """
    limits, faults, state, qp = K.limits, K.faults, K.state, K.qp
    qp.dense = 0
    for i in range(K.chain.n):
        draw(qp, i, weight, 0.0 if state.level == ACCELERATION else state.v[i])
    for k in range(faults.working, faults.movable):
        lighten(qp, faults.order[k], FREE_SHARE)
    for k in range(faults.working):
        i = faults.order[k]
        a = deceleration(state.v[i], state.a_command[i], limits.a_max[i], time, rise, state.dt)
        draw(qp, i, weight, a if state.level == ACCELERATION else state.v[i] + state.dt * a)


@rare_jit
def only_brake(K: Any, share: float) -> None:
    """Narrow the box to between that share of x_rest and x_rest; a limit that wants more goes before.

    An excess of torque that nothing removes, for example a load that a motor cannot carry, would else have
    the joints swing at their limits for ever to lessen it. With the share 0 no joint speeds up.
    """
    faults, state, qp = K.faults, K.state, K.qp
    for k in range(faults.working):
        i = faults.order[k]
        rest = -qp.g[i] / qp.H_diagonal[i]
        coast = 0.0 if state.level == ACCELERATION else state.v[i]
        least = coast + share * (rest - coast)
        narrow(qp, i, min(rest, least), max(rest, least))


@jit
def put_aside(chain: Any, qp: Any, aside: Any) -> None:
    """Keep sizes, objective and box of the joints."""
    aside.nx, aside.meq, aside.dense = qp.nx, qp.meq, qp.dense
    for i in range(chain.n):
        aside.g[i], aside.H_diagonal[i] = qp.g[i], qp.H_diagonal[i]
        aside.lb[i], aside.ub[i] = qp.lb[i], qp.ub[i]


@jit
def take_up(chain: Any, qp: Any, aside: Any) -> None:
    """Sizes and objective again; the box is up to whoever takes the QP up."""
    for i in range(chain.n):
        qp.g[i], qp.H_diagonal[i] = aside.g[i], aside.H_diagonal[i]
    qp.nx, qp.meq, qp.dense = aside.nx, aside.meq, aside.dense


SOFTNESS = 1e-10
"""Compliance of torque rows beside |x - x_rest|^2: what bias it leaves is below any torque that matters. It
is so small because the row's excess must cost more than any way to rest (docs/theory/joint-limits.md, "Torque
limits and box")."""
ROOM = 1e-8
"""What a widened row is given beyond its least excess, as a share of 1 + |C x|, against rounding. Two digits
above the solver's tolerance of 1e-10."""
RAY = 1e-9
"""Largest share of its terms that C'z may keep along a variable without a bound on that side. A million units
of rounding."""


@jit
def _open_forced_return(state: Any, limits: Any, qp: Any, i: int) -> None:
    """Draw a joint beyond its limits back in place of forcing it: its interval ends where others end."""
    v, v_max, a_max, dt = state.v[i], limits.v_max[i], limits.a_max[i], state.dt
    if state.level == ACCELERATION:
        low, high = max(-a_max, min((-v_max - v) / dt, 0.0)), min(a_max, max((v_max - v) / dt, 0.0))
    else:
        low, high = max(v - a_max * dt, min(-v_max, v)), min(v + a_max * dt, max(v_max, v))
    draw(qp, i, 1.0, min(max(-qp.g[i], qp.lb[i]), qp.ub[i]))
    widen(qp, i, low, high)


@rare_jit
def begin_least_excess(K: Any) -> None:
    """min |x - x_rest|^2/2 + sum excess_j^2/(2 SOFTNESS) within the box, the task's QP kept aside.

    A joint beyond its limits is not forced back here: it returns as its torque allows.
    """
    faults, qp = K.faults, K.qp
    n = K.chain.n
    leave_to_motors(K)
    put_aside(K.chain, qp, K.aside)
    draw_to_rest(K, K.state.dt, 0.0, 1.0)
    for k in range(faults.working):
        i = faults.order[k]
        if is_beyond_range(K, i) or is_too_fast(K, i):
            _open_forced_return(K.state, K.limits, qp, i)
    qp.nx, qp.meq, qp.warm = n, 0, 0
    qp.soft_rows = SOFTNESS


@jit
def _without_push_on_free(faults: Any, qp: Any, scratch: Any) -> None:
    """Correct the multipliers of the free-swinging joints' rows until C'z vanishes along those joints."""
    S, r = scratch.square, scratch.impulse
    working, count = faults.working, faults.movable - faults.working
    for a in range(count):
        i = faults.order[working + a]
        r[a] = minus_products(0.0, qp.C[:, i], qp.z, qp.nc)
        for b in range(count):
            S[a, b] = qp.C[i, faults.order[working + b]]
    if count > 0 and factor(S, count):
        solve_factored(S, count, r)
        for a in range(count):
            qp.z[faults.order[working + a]] += r[a]


@jit
def box_excludes_rows(faults: Any, chain: Any, qp: Any, scratch: Any, aside: Any) -> bool:
    """Whether the multipliers of the least excess prove that no x in the box keeps all rows (Farkas).

    For every x that does, (C'z)'x = z'Cx <= sum z+ u - z- l. So there is none where the least (C'z)'x of the
    box, sum t+ lb - t- ub with t = C'z, is larger. The box is the task's own.
    """
    _without_push_on_free(faults, qp, scratch)
    most, size = 0.0, 0.0
    for j in range(qp.nc):
        z = qp.z[j]
        if z != 0.0:
            bound = qp.u[j] if z > 0.0 else qp.l[j]
            if bound == inf or bound == -inf:
                return False
            most += z * bound
            size += abs(z * bound)
    least = 0.0
    for i in range(chain.n):
        t, terms = 0.0, 0.0
        for j in range(qp.nc):
            if qp.z[j] != 0.0:
                term = qp.C[j, i] * qp.z[j]
                t += term
                terms += abs(term)
        bound = aside.lb[i] if t > 0.0 else aside.ub[i]
        if bound == inf or bound == -inf:
            if abs(t) > RAY * terms:
                return False
        else:
            least += t * bound
            size += terms * abs(bound)
    return bool(least - most > PROOF_SHARE * size)


@jit
def make_room(chain: Any, qp: Any, aside: Any) -> None:
    """Take the task's QP up again, its rows widened by the least excess, its box by what did not return."""
    n = chain.n
    for j in range(qp.nc):
        if qp.l[j] < qp.u[j] or j >= qp.rigid:
            s = plus_products(0.0, qp.C[j], qp.x, n)
            room = ROOM * (1.0 + abs(s))
            if s > qp.u[j]:
                qp.u[j] = s + room
            elif s < qp.l[j]:
                qp.l[j] = s - room
    take_up(chain, qp, aside)
    for i in range(n):
        bound(qp, i, min(aside.lb[i], qp.x[i]), max(aside.ub[i], qp.x[i]))
    qp.soft_rows, qp.warm = 0.0, 0


@jit
def keep_free_rows(faults: Any, chain: Any, qp: Any, scratch: Any) -> None:
    """Put into x what the free-swinging joints do when all others move as x says: their rows as equations."""
    n, S, r = chain.n, scratch.square, scratch.impulse
    working, count = faults.working, faults.movable - faults.working
    if count == 0 or qp.nc == 0:
        return
    for a in range(count):
        i = faults.order[working + a]
        s = qp.l[i] if qp.l[i] > -inf else qp.u[i]  # one side is open where an end stop carries the joint
        s = minus_products(s, qp.C[i], qp.x, n)
        for b in range(count):
            k = faults.order[working + b]
            s += qp.C[i, k] * qp.x[k]
            S[a, b] = qp.C[i, k]
        r[a] = s
    if factor(S, count):
        solve_factored(S, count, r)
        for a in range(count):
            i = faults.order[working + a]
            qp.x[i] = r[a] if qp.lb[i] < qp.ub[i] else qp.lb[i]


RELAXED_RATIO = 1e-8
"""Compliance of the task rows, without unit, when the best feasible command is sought, and in the first
stage, ..."""
SECOND_STAGE_RATIO = 1e-9
"""... in the second lexicographic stage ..."""
ELASTIC_TASK_RATIO = 1e-6
"""... and when torque limits have to give way, too. The second is stiffer than the first, because what it
leaves of the first's task is to be kept; the third is softer, because torque rows must be stiffer than it.
The powers of ten are guesses that tests/robustness/test_found_by_campaigns.py has not contradicted."""

REST_ELASTIC = 1e-12
"""Compliance of torque rows beside |x - x_rest|^2 when the arm is brought to rest ..."""
SETTLING_ELASTIC = 1e-6
"""... and in settling, beside that of the task, which is 1 there: so that torque limits go before rest and
task."""

DECAY_TIME = 0.05
"""Time constant [s] of the fallback command."""


@rare_jit
def _share(K: Any, ratio: float) -> None:
    """Let the tasks beside that of the tip be as firm as its rows, whose compliance has that ratio."""
    if K.terms.shared and K.terms.stands >= 0.0:
        share(K, 1.0 / softness(K.task, K.terms, K.chain, K.qp, ratio))


@rare_jit
def _share_anew(K: Any, ratio: float) -> None:
    """The same in an objective that has replaced the one in which they stood."""
    if K.terms.stands > 0.0:
        K.terms.stands = K.terms.added = 0.0
    _share(K, ratio)


@rare_jit
def begin_first_stage(K: Any) -> None:
    """Lexicographic mode: x1 = argmin |Ax - b|^2 + eps |x|^2 over box and torque rows, no objective."""
    chain, qp = K.chain, K.qp
    put_aside(chain, qp, K.aside)
    for i in range(chain.n):
        draw(qp, i, 1.0, 0.0)
    qp.dense = 0
    compliance(K.task, K.terms, chain, qp, K.turned, RELAXED_RATIO)
    _share_anew(K, RELAXED_RATIO)
    qp.warm = 0


@rare_jit
def begin_second_stage(K: Any, claim: int) -> None:
    """Lexicographic mode: minimise the objective over those x with A x = A x1."""
    chain, task, turned, cascade, qp = K.chain, K.task, K.turned, K.cascade, K.qp
    take_up(chain, qp, K.aside)
    if K.terms.shared:  # the first stage has written into H
        objective(K)
        if K.criteria.manipulability != 0.0 and not K.settling.gradient_suppressed:
            add_manipulability(K)
        if claim == SOLVED:
            keep_shared(K.terms, chain, qp)
            K.terms.bends = 0
    if claim == SOLVED:
        for k in range(task.m):
            qp.b[k] = plus_products(0.0, qp.A[k], qp.x, chain.n)
    assign(cascade.z_box_first, qp.z_box, chain.n)
    assign(cascade.z_first, qp.z, qp.nc)
    for k in range(task.m):
        turned.softness[k] = 0.0  # what the damping leaves of the task is now to be kept
    compliance(task, K.terms, chain, qp, turned, SECOND_STAGE_RATIO)
    _share(K, SECOND_STAGE_RATIO)
    qp.warm = 0


@rare_jit
def begin_rest(K: Any, time: float, rise: float) -> None:
    """Without a task: x as near to v -> 0 within ``time`` as box, torque rows and failed joints allow.

    The deceleration comes up within ``rise``, 0 at once. A joint outside its position limits is not pushed
    back during a stop: its interval is opened just enough to come to rest.
    """
    limits, faults, state, task, qp = K.limits, K.faults, K.state, K.task, K.qp
    qp.nx, qp.meq, qp.warm, qp.soft_last = K.chain.n, 0, 0, LAST
    draw_to_rest(K, time, rise, 1.0)
    for k in range(faults.working):
        i = faults.order[k]
        wanted = -qp.g[i]
        if state.q[i] < limits.q_min[i] - AT_LIMIT or state.q[i] > limits.q_max[i] + AT_LIMIT:
            widen(qp, i, wanted, wanted)
    task.slack[: task.m] = 0.0
    task.scale = 0.0


@rare_jit
def begin_stop(K: Any) -> int:
    """Brake every healthy joint within its limits: STOPPING, then STOPPED for good once all are at rest."""
    limits, faults, state, watch = K.limits, K.faults, K.state, K.watch
    outcome = STOPPED
    for k in range(faults.working):
        i = faults.order[k]
        top = limits.v_max[i] if limits.v_max[i] < inf else 1.0
        if (watch.stopped == 0 or faults.movable > faults.working) and abs(state.v[i]) > AT_REST * top:
            outcome = STOPPING
    if watch.latched and outcome == STOPPED:
        watch.stopped = 1
    begin_rest(K, state.dt, watch.rise)
    if faults.movable == faults.working:
        only_brake(K, 0.0)
    return outcome


@rare_jit
def begin_relaxed(K: Any) -> None:
    """The same QP with the task as compliant as the best feasible command takes, if it is not so already."""
    if K.task.mode != SLACK:
        compliance(K.task, K.terms, K.chain, K.qp, K.turned, RELAXED_RATIO)
        _share(K, RELAXED_RATIO)


@rare_jit
def begin_relaxed_after_settling(K: Any) -> None:
    """The task's QP in the place of that of settling, as compliant; a path waits."""
    task, qp = K.task, K.qp
    qp.soft_rows = 0.0
    objective(K)
    assign(qp.b, task.asked, task.m)
    qp.meq, qp.nx = task.m, K.chain.n
    keep_again(K)
    compliance(task, K.terms, K.chain, qp, K.turned, RELAXED_RATIO)
    _share(K, RELAXED_RATIO)


@rare_jit
def begin_elastic(K: Any) -> None:
    """The task's QP, compliant, with torque limits widened by what the last stage found them to lack."""
    make_room(K.chain, K.qp, K.aside)
    keep_again(K)
    compliance(K.task, K.terms, K.chain, K.qp, K.turned, ELASTIC_TASK_RATIO)
    _share(K, ELASTIC_TASK_RATIO)


@rare_jit
def begin_plain(K: Any) -> None:
    """The same QP with |x - x_rest|^2 in the place of the scheme's criterion, of the same mean size."""
    n, qp = K.chain.n, K.qp
    mean = -K.terms.added
    for i in range(n):
        mean += qp.H[i, i] if qp.dense else qp.H_diagonal[i]
    draw_to_rest(K, K.state.dt, 0.0, mean / n)
    _share_anew(K, ELASTIC_TASK_RATIO)
    qp.warm = 0


@rare_jit
def begin_decay(K: Any) -> None:
    """Without a task: the arm decays to rest, its torque rows hard again."""
    K.qp.soft_rows = 0.0
    begin_rest(K, max(DECAY_TIME, K.state.dt), 0.0)


@rare_jit
def begin_elastic_rest(K: Any) -> None:
    """The same with compliant torque rows; where a stop is latched no joint leaves what brakes it."""
    leave_to_motors(K)
    K.qp.soft_rows = REST_ELASTIC
    if K.watch.latched:
        only_brake(K, BRAKING_SHARE)


@rare_jit
def clip_rest(K: Any) -> None:
    """The last resort: x_rest within the box, and what free-swinging joints then do."""
    qp = K.qp
    for i in range(K.chain.n):
        x = min(max(-qp.g[i], qp.lb[i]), qp.ub[i])
        qp.x[i] = x if is_finite(x) else 0.0
    keep_free_rows(K.faults, K.chain, qp, K.scratch)
