"""The QPs of the fallback cascade's stages, in the order of ``ftqp.kernel.judge.cascade_table``.

Each takes up the record's QP as the stage before has left it. Those of torque limits and box that exclude
each other are in ``ftqp.kernel.judge.least_excess``, that of calm in ``ftqp.kernel.calm``.
"""

from math import inf
from typing import Any

from ftqp.kernel.jit import rare_jit
from ftqp.kernel.judge.coming_to_rest import BRAKING_SHARE, draw_to_rest, only_brake
from ftqp.kernel.judge.least_excess import keep_free_rows, make_room
from ftqp.kernel.judge.qp_aside import put_aside, take_up
from ftqp.kernel.layout.enums import SLACK, SOLVED, STOPPED, STOPPING
from ftqp.kernel.layout.thresholds import AT_REST, LAST
from ftqp.kernel.maths.finite import is_finite
from ftqp.kernel.rows.joint_intervals import AT_LIMIT
from ftqp.kernel.rows.manipulability import add_manipulability
from ftqp.kernel.rows.objective import objective
from ftqp.kernel.rows.one_variable import draw, widen
from ftqp.kernel.rows.task_rows import compliance, softness
from ftqp.kernel.rows.task_terms import keep_shared, share

RELAXED_RATIO = 1e-8
"""Compliance of the task rows, without unit, when the best feasible command is sought, and in the first
stage, ..."""
SECOND_STAGE_RATIO = 1e-9
"""... in the second lexicographic stage ..."""
ELASTIC_TASK_RATIO = 1e-6
"""... and when torque limits have to give way, too. The second is stiffer than the first, because what it
leaves of the first's task is to be kept; the third is softer, because torque rows must be stiffer than it.
The powers of ten are guesses that tests/robustness/test_torque_against_box.py has not contradicted."""

REST_ELASTIC = 1e-12
"""Compliance of torque rows beside |x - x_rest|^2 when the arm is brought to rest ..."""
CALM_ELASTIC = 1e-6
"""... and in calm, beside that of the task, which is 1 there: so that torque limits go before rest and
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
        if K.criteria.manipulability != 0.0 and not K.calm.hushed:
            add_manipulability(K)
        if claim == SOLVED:
            keep_shared(K.terms, chain, qp)
            K.terms.bends = 0
    if claim == SOLVED:
        for k in range(task.m):
            s = 0.0
            for i in range(chain.n):
                s += qp.A[k, i] * qp.x[i]
            qp.b[k] = s
    for i in range(chain.n):
        cascade.z_box_first[i] = qp.z_box[i]
    for j in range(qp.nc):
        cascade.z_first[j] = qp.z[j]
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
    for k in range(task.m):
        task.slack[k] = 0.0
    task.scale = 0.0


@rare_jit
def begin_stop(K: Any) -> int:
    """Brake every healthy joint within its limits: STOPPING, then STOPPED for good once all are at rest.

    Beside a joint that swings freely the others may have to move, however long ago they stopped.
    """
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
    """The same QP with the task as compliant as the best feasible command takes.

    An external solver's QP of mode ``slack`` is so already: it is the very QP that could not be solved.
    """
    if K.task.mode != SLACK:
        compliance(K.task, K.terms, K.chain, K.qp, K.turned, RELAXED_RATIO)
        _share(K, RELAXED_RATIO)


@rare_jit
def begin_relaxed_after_calm(K: Any) -> None:
    """The task's QP in the place of that of calm, as compliant; a path waits."""
    task, qp = K.task, K.qp
    qp.soft_rows = 0.0
    objective(K)
    for k in range(task.m):
        qp.b[k] = task.asked[k]
    qp.meq, qp.nx = task.m, K.chain.n
    compliance(task, K.terms, K.chain, qp, K.turned, RELAXED_RATIO)
    _share(K, RELAXED_RATIO)


@rare_jit
def begin_elastic(K: Any) -> None:
    """The task's QP, compliant, with torque limits widened by what the last stage found them to lack."""
    make_room(K.chain, K.qp, K.aside)
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
