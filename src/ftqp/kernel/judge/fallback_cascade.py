"""The fallback cascade: which QP comes next when an answer is bad.

    calm, where the error bends more than the rows can hold -> best feasible: task relaxed
    first stage (lexicographic mode) -> the QP -> best feasible: task relaxed
        -> what torque limits lack at least -> the task with torque limits that give so much
        -> the same without the scheme's criterion
        -> decay towards rest -> the same with elastic torque limits -> plain clip

The box and the failed joints are never relaxed. A stop enters at "towards rest". There is one loop and one
call of the solver, whatever happens; an external solver takes the place of the first one for the QP itself.
No foreign solver's claim that a QP has no solution is believed: RELAXED is said where the least excess proves
it, or what is left of a hard task, and FALLBACK otherwise.
"""

from math import inf
from typing import Any

from ftqp.kernel.active_set.active_set import active_set
from ftqp.kernel.feedback.gate import pass_gate
from ftqp.kernel.feedback.sent import send
from ftqp.kernel.feedback.status_report import report_status
from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.judge.coming_to_rest import BRAKING_SHARE, draw_to_rest, only_brake
from ftqp.kernel.judge.kept_limits import joints_outside
from ftqp.kernel.judge.least_excess import (
    begin_least_excess,
    begin_plain,
    box_excludes_rows,
    keep_free_rows,
    make_room,
)
from ftqp.kernel.judge.solution_check import check_solution, command
from ftqp.kernel.judge.straight import straight
from ftqp.kernel.layout.enums import (
    CALM_STAGE,
    ELASTIC_STAGE,
    FALLBACK,
    FIRST_STAGE,
    HARD,
    INFEASIBLE,
    LEAST_EXCESS_STAGE,
    LEXICOGRAPHIC,
    MAIN_STAGE,
    OK,
    PLAIN_STAGE,
    QP_READY,
    RELAX_STAGE,
    RELAXED,
    REST_ELASTIC_STAGE,
    REST_STAGE,
    SCALE,
    SCALED,
    SLACK,
    SOLVE,
    SOLVED,
    STOPPED,
    STOPPED_BY_FALLBACKS,
    STOPPING,
)
from ftqp.kernel.layout.thresholds import AT_REST, SCALED_FROM
from ftqp.kernel.maths.finite import is_finite
from ftqp.kernel.rows.constraint_rows import add_constraints, keeps_torque
from ftqp.kernel.rows.joint_intervals import AT_LIMIT
from ftqp.kernel.rows.objective import objective
from ftqp.kernel.rows.task_rows import compliance

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
"""... and in calm, beside that of the task, which is 1 there: so that torque limits go before rest and task.
A guess that the campaigns have not contradicted."""

RELAXED_FROM = 1e-3
"""A task residual above this share of the task's right side, plus ..."""
TASK_FLOOR = 1e-4
"""... this in the task's own unit [m/s2 or m/s, rad alike], counts as relaxed. Both are far above what a
solver may leave, so that backends agree. A guess that the campaigns have not contradicted."""
DECAY_TIME = 0.05
"""Time constant [s] of the fallback command. A guess that the campaigns have not contradicted."""


@rare_jit
def begin_first_stage(K: Any) -> None:
    """Lexicographic mode: x1 = argmin |Ax - b|^2 + eps |x|^2 over box and torque rows, no objective."""
    chain, cascade, qp = K.chain, K.cascade, K.qp
    for i in range(chain.n):
        cascade.g_task[i], cascade.d_task[i] = qp.g[i], qp.H_diagonal[i]
        qp.g[i], qp.H_diagonal[i] = 0.0, 1.0
    cascade.dense_task = qp.dense
    qp.dense = 0
    compliance(K.task, chain, qp, K.turned, RELAXED_RATIO)
    qp.warm = 0
    cascade.stage = FIRST_STAGE


@rare_jit
def _begin_second_stage(K: Any, claim: int) -> None:
    """Lexicographic mode: minimise the objective over those x with A x = A x1."""
    chain, task, turned, cascade, qp = K.chain, K.task, K.turned, K.cascade, K.qp
    for i in range(chain.n):
        qp.g[i], qp.H_diagonal[i] = cascade.g_task[i], cascade.d_task[i]
    qp.dense = cascade.dense_task
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
    compliance(task, chain, qp, turned, SECOND_STAGE_RATIO)
    qp.warm = 0
    cascade.stage = MAIN_STAGE


@rare_jit
def begin_rest(K: Any, time: float, rise: float) -> None:
    """Without a task: x as near to v -> 0 within ``time`` as box, torque rows and failed joints allow.

    The deceleration comes up within ``rise``, 0 at once. A joint outside its position limits is not pushed
    back during a stop: its interval is opened just enough to come to rest.
    """
    limits, faults, state, task, qp = K.limits, K.faults, K.state, K.task, K.qp
    qp.nx, qp.meq, qp.warm = K.chain.n, 0, 0
    draw_to_rest(K, time, rise, 1.0)
    for k in range(faults.working):
        i = faults.order[k]
        wanted = -qp.g[i]
        if state.q[i] < limits.q_min[i] - AT_LIMIT or state.q[i] > limits.q_max[i] + AT_LIMIT:
            qp.lb[i], qp.ub[i] = min(qp.lb[i], wanted), max(qp.ub[i], wanted)
    for k in range(task.m):
        task.slack[k] = 0.0
    task.scale = 0.0
    K.cascade.stage = REST_STAGE


@rare_jit
def begin_stop(K: Any) -> None:
    """Brake every healthy joint within its limits: STOPPING, then STOPPED for good once all are at rest.

    Beside a joint that swings freely the others may have to move, however long ago they stopped.
    """
    limits, faults, state, watch, cascade = K.limits, K.faults, K.state, K.watch, K.cascade
    cascade.outcome = STOPPED
    for k in range(faults.working):
        i = faults.order[k]
        top = limits.v_max[i] if limits.v_max[i] < inf else 1.0
        if (watch.stopped == 0 or faults.movable > faults.working) and abs(state.v[i]) > AT_REST * top:
            cascade.outcome = STOPPING
    if watch.latched and cascade.outcome == STOPPED:
        watch.stopped = 1
    begin_rest(K, state.dt, watch.rise)
    if faults.movable == faults.working:
        only_brake(K, 0.0)


@jit
def _misses_task(task: Any) -> bool:
    """Whether the solved QP leaves more of the task than counts as none."""
    size, residual = task.beyond, 0.0
    for k in range(task.m):
        size = max(size, abs(task.asked[k]))
        residual = max(residual, abs(task.slack[k]))
    return bool(residual > RELAXED_FROM * size + TASK_FLOOR)


@jit
def _outcome_of_solved(task: Any, cascade: Any) -> int:
    """OK, SCALED or RELAXED, by what is left of the task, rows given up included, and by limits not kept."""
    if cascade.missed or cascade.outside > 0 or cascade.jump < 1.0 or task.given_up > 0:
        return RELAXED
    return SCALED if task.scale < SCALED_FROM else OK


@rare_jit
def _sets_out(K: Any) -> bool:
    """Whether joints that were at rest are sent to move: beside one that swings freely, or off a limit."""
    limits, faults, state = K.limits, K.faults, K.state
    for k in range(faults.working):
        i = faults.order[k]
        top = limits.v_max[i] if limits.v_max[i] < inf else 1.0
        if abs(state.v_command[i]) > AT_REST * top:
            return True
    return False


@part_jit
def _finish(K: Any) -> int:
    """Write the command and settle the status; too many in a row without the task latch the stop."""
    task, watch, cascade, qp = K.task, K.watch, K.cascade, K.qp
    command(K)
    send(K)
    shut = not pass_gate(K)
    without_task = shut or cascade.stage == REST_STAGE or cascade.stage == REST_ELASTIC_STAGE
    watch.fallbacks = watch.fallbacks + 1 if cascade.outcome == FALLBACK and without_task else 0
    if watch.fallbacks > watch.fallback_limit and watch.latched == 0:
        watch.latched = 1
        watch.reason = STOPPED_BY_FALLBACKS
    qp.soft_rows = 0.0
    if cascade.stage == CALM_STAGE:
        if cascade.external:
            qp.warm = 0
    elif shut or cascade.stage != MAIN_STAGE:
        qp.warm = 0
    elif task.mode == LEXICOGRAPHIC and cascade.outcome == RELAXED:
        for i in range(K.chain.n):  # the second stage keeps the residual: only the first knows what causes it
            qp.z_box[i] = cascade.z_box_first[i]
        for j in range(qp.nc):
            qp.z[j] = cascade.z_first[j]
    if cascade.outcome == STOPPED and _sets_out(K):
        cascade.outcome = STOPPING
    cascade.status = report_status(K.state, K.limits, task, K.feedback, K.chain, cascade.outcome)
    return cascade.status


@rare_jit
def _begin_elastic(K: Any) -> None:
    """Let torque limits give way as little as can be, where they and the box exclude each other."""
    if box_excludes_rows(K.faults, K.chain, K.qp, K.scratch, K.aside):
        K.cascade.outcome = RELAXED
    make_room(K.chain, K.qp, K.aside)
    compliance(K.task, K.chain, K.qp, K.turned, ELASTIC_TASK_RATIO)
    K.cascade.stage = ELASTIC_STAGE


@rare_jit
def _clip(K: Any) -> None:
    """The last resort: x_rest within the box, and what free-swinging joints then do."""
    qp = K.qp
    for i in range(K.chain.n):
        x = min(max(-qp.g[i], qp.lb[i]), qp.ub[i])
        qp.x[i] = x if is_finite(x) else 0.0
    keep_free_rows(K.faults, K.chain, qp, K.scratch)


@rare_jit
def _advance_in_calm(K: Any, claim: int) -> int:
    """The answer to the QP of calm is the command, whatever the task's mode and the solver of other ticks.

    Where torque limits and the box exclude each other, torque limits give way; where that does not help, the
    task is relaxed as without calm.
    """
    task, cascade, qp = K.task, K.cascade, K.qp
    good = claim == SOLVED and check_solution(task, cascade, qp, K.scratch)
    if K.limits.on_demand and not K.kinematics.has_dynamics and not (good and keeps_torque(K)):
        add_constraints(K)
        return SOLVE
    if qp.soft_rows == 0.0:
        cascade.claim = claim
        cascade.outcome = RELAXED if claim == INFEASIBLE else FALLBACK
    if good:
        for k in range(task.m):
            s = -task.asked[k]
            for i in range(qp.nx):
                s += qp.A[k, i] * qp.x[i]
            task.slack[k] = s
        task.scale = qp.x[K.chain.n] if qp.nx > K.chain.n else 1.0
        cascade.missed = _misses_task(task)
        cascade.outside = joints_outside(K)
        if qp.soft_rows == 0.0:
            cascade.outcome = _outcome_of_solved(task, cascade)
        return _finish(K)
    qp.warm = 0
    if qp.soft_rows == 0.0 and qp.nc > 0:
        qp.soft_rows = CALM_ELASTIC
        return SOLVE
    qp.soft_rows = 0.0
    objective(K)
    for k in range(task.m):
        qp.b[k] = task.asked[k]
    qp.meq, qp.nx = task.m, K.chain.n  # a path waits
    compliance(task, K.chain, qp, K.turned, RELAXED_RATIO)
    cascade.stage = RELAX_STAGE
    return SOLVE


@jit
def _advance(K: Any, claim: int) -> int:
    """Go on to the next stage: the status when a command is found, SOLVE when the solver has to run again."""
    task, cascade, qp = K.task, K.cascade, K.qp
    n, stage = K.chain.n, cascade.stage
    follows = stage == MAIN_STAGE or stage == RELAX_STAGE or stage == ELASTIC_STAGE or stage == PLAIN_STAGE
    if stage == CALM_STAGE:
        return _advance_in_calm(K, claim)
    if stage == FIRST_STAGE:
        _begin_second_stage(K, claim)
        return QP_READY
    good = claim == SOLVED and (cascade.checked != 0 or check_solution(task, cascade, qp, K.scratch))
    if K.limits.on_demand and not K.kinematics.has_dynamics and not (good and keeps_torque(K)):
        add_constraints(K)  # the same QP again, now with torque rows
        return SOLVE
    if stage == MAIN_STAGE:
        cascade.claim = claim
    if good and stage == LEAST_EXCESS_STAGE:
        _begin_elastic(K)
        return SOLVE
    if good:
        if follows:
            task.scale = qp.x[n] if task.mode == SCALE else 1.0
            cascade.missed = _misses_task(task)
            cascade.outside = joints_outside(K)
        if stage == MAIN_STAGE:
            cascade.outcome = _outcome_of_solved(task, cascade)
        elif follows and cascade.missed and (task.mode == HARD or not cascade.external):
            cascade.outcome = RELAXED  # what compliance cannot close proves that no motion follows the task
        return _finish(K)
    qp.warm = 0
    if stage == MAIN_STAGE:
        own_proof = claim == INFEASIBLE and task.mode == HARD and not cascade.external
        cascade.outcome = RELAXED if own_proof else FALLBACK
        if task.mode == SLACK and not cascade.external:
            begin_least_excess(K)  # compliant already: only torque limits and box can exclude each other
        else:
            if task.mode != SLACK:  # else the very QP that the external solver could not solve
                compliance(task, K.chain, qp, K.turned, RELAXED_RATIO)
            cascade.stage = RELAX_STAGE
    elif stage == RELAX_STAGE:
        begin_least_excess(K)
    elif stage == ELASTIC_STAGE:
        begin_plain(K)
    elif stage == LEAST_EXCESS_STAGE or stage == PLAIN_STAGE:
        qp.soft_rows = 0.0
        cascade.outcome = FALLBACK
        begin_rest(K, max(DECAY_TIME, K.state.dt), 0.0)
    elif stage == REST_STAGE:
        qp.soft_rows = REST_ELASTIC
        if K.watch.latched:
            only_brake(K, BRAKING_SHARE)
        cascade.stage = REST_ELASTIC_STAGE
    else:
        _clip(K)
        return _finish(K)
    return SOLVE


@part_jit
def run_cascade(K: Any, code: int, claim: int) -> int:
    """Run the cascade until it has a command, or, with an external solver, until the QP itself is ready.

    Args:
        K: the record, its stage prepared.
        code: QP_READY or SOLVE when the solver is to run first, anything else when ``claim`` is already an
            answer.
        claim: the answer of an external solver.
    """
    cascade, qp = K.cascade, K.qp
    cascade.checked = 0
    while True:
        if code == QP_READY and cascade.external:
            return QP_READY
        if code == QP_READY or code == SOLVE:
            if cascade.stage == MAIN_STAGE and straight(K):
                cascade.checked, claim = 1, SOLVED
            else:
                cascade.checked, claim = 0, active_set(qp)
            if cascade.stage == MAIN_STAGE or cascade.stage == CALM_STAGE:
                cascade.qp_iterations = qp.iterations
        code = _advance(K, claim)
        if code != QP_READY and code != SOLVE:
            return code
