"""The ladder: which QP comes next when an answer is bad.

    first stage (lexicographic mode) -> the QP -> best feasible: task relaxed -> torque limits elastic too
                                              -> decay towards rest -> the same with elastic torque limits ->
                                              plain clip

The box and the failed joints are never relaxed. A stop enters at "towards rest". There is one loop and one
call of the
solver, whatever happens; an external solver takes the place of the first one for the QP itself.
"""

from math import inf
from typing import Any

from ftqp.kernel.active_set.active_set import active_set
from ftqp.kernel.jit import jit
from ftqp.kernel.judge.verdict import command, judge
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    ELASTIC_STAGE,
    FALLBACK,
    FIRST_STAGE,
    HARD,
    HEALTHY,
    INFEASIBLE,
    LEXICOGRAPHIC,
    MAIN_STAGE,
    OK,
    READY,
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
    STOPPING,
)
from ftqp.kernel.maths.finite import is_finite
from ftqp.kernel.rows.path_rows import advance
from ftqp.kernel.rows.task_rows import compliance
from ftqp.kernel.rows.torque_rows import add_torques, within_guard
from ftqp.kernel.rows.turned_rows import turn_back

RELAXED_RATIO = 1e-8
"""Compliance of the task rows when the best feasible command is sought, and in the first lexicographic
stage."""
SECOND_STAGE_RATIO = 1e-9
"""Compliance of the task rows in the second lexicographic stage."""
ELASTIC_TASK_RATIO = 1e-6
"""Compliance of the task rows when torque limits have to give way too."""
ELASTIC_RATIO = 1e-4
"""Compliance of torque rows, relative to that of the task rows: torque limits go before the task."""
REST_ELASTIC = 1e-12
"""Compliance of torque rows beside |x - x_rest|^2 when the arm is brought to rest."""
RELAXED_FROM = 1e-3
"""A task residual above this share of the task's right side, plus TASK_FLOOR, counts as relaxed."""
TASK_FLOOR = 1e-4
SCALED_FROM = 0.999
"""A path scale below this counts as scaled."""
AT_REST = 1e-3
"""An arm whose joints all move slower than this share of their velocity limit has stopped."""
DECAY_TIME = 0.05
"""Time constant [s] of the fallback command."""


@jit
def begin_first_stage(K: Any) -> None:
    """Lexicographic: x1 = argmin |Ax - b|^2 + eps |x|^2 over box and torque rows, the objective aside."""
    for i in range(K.n):
        K.g_task[i], K.d_task[i] = K.g[i], K.H_diagonal[i]
        K.g[i], K.H_diagonal[i] = 0.0, 1.0
    K.dense_task = K.dense
    K.dense = 0
    compliance(K, RELAXED_RATIO)
    K.warm = 0
    K.stage = FIRST_STAGE


@jit
def _begin_second_stage(K: Any, claim: int) -> None:
    """Lexicographic: the objective over those x with A x = A x1."""
    for i in range(K.n):
        K.g[i], K.H_diagonal[i] = K.g_task[i], K.d_task[i]
    K.dense = K.dense_task
    if claim == SOLVED:
        for k in range(K.m):
            s = 0.0
            for i in range(K.n):
                s += K.A[k, i] * K.x[i]
            K.b[k] = s
    for i in range(K.n):
        K.z_box_first[i] = K.z_box[i]
        K.z_first[i] = K.z[i] if i < K.nc else 0.0
    for k in range(K.m):
        K.damp[k] = 0.0  # what the damping leaves of the task is now to be kept
    compliance(K, SECOND_STAGE_RATIO)
    K.warm = 0
    K.stage = MAIN_STAGE


@jit
def begin_rest(K: Any, time: float) -> None:
    """No task: x as near to v -> 0 within ``time`` as box, torque rows and failed joints allow.

    A joint outside its position limits is not pushed back during a stop: its interval is opened just enough
    to come to rest.
    """
    n = K.n
    K.nx, K.meq, K.dense, K.warm = n, 0, 0, 0
    for i in range(n):
        K.H_diagonal[i] = 1.0
        if K.fault[i] == HEALTHY:
            if K.level == ACCELERATION:
                wanted = min(max(-K.v[i] / time, -K.a_max[i]), K.a_max[i])
            else:
                change = K.v[i] * min(1.0, K.dt / time)
                most = K.a_max[i] * K.dt
                wanted = K.v[i] - min(max(change, -most), most)
            if K.q[i] < K.q_min[i] or K.q[i] > K.q_max[i]:
                K.lb[i], K.ub[i] = min(K.lb[i], wanted), max(K.ub[i], wanted)
        else:
            wanted = 0.0 if K.level == ACCELERATION else K.v[i]
        K.g[i] = -wanted
    for k in range(K.m):
        K.slack[k] = 0.0
    K.scale = 0.0
    K.stage = REST_STAGE


@jit
def begin_stop(K: Any) -> None:
    """Brake every healthy joint within its limits: STOPPING, or STOPPED once all are at rest."""
    K.verdict = STOPPED
    for i in range(K.n):
        top = K.v_max[i] if K.v_max[i] < inf else 1.0
        if K.fault[i] == HEALTHY and abs(K.v[i]) > AT_REST * top:
            K.verdict = STOPPING
    begin_rest(K, K.dt)


@jit
def _verdict_on_task(K: Any) -> int:
    """OK, SCALED or RELAXED, by what the solved QP leaves of the task."""
    size = residual = 0.0
    for k in range(K.m):
        size = max(size, abs(K.b_task[k]))
        residual = max(residual, abs(K.slack[k]))
        if K.on_path:  # whose own speed is no part of b
            size = max(size, abs(K.A[k, K.n]) * (K.kv * K.dt if K.level == ACCELERATION else 1.0))
    if residual > RELAXED_FROM * size + TASK_FLOOR:
        return RELAXED
    return SCALED if K.scale < SCALED_FROM else OK


@jit
def _finish(K: Any) -> int:
    """Write the command and settle the status; too many in a row without the task latch the stop."""
    command(K)
    without_task = K.stage == REST_STAGE or K.stage == REST_ELASTIC_STAGE
    K.fallbacks = K.fallbacks + 1 if K.verdict == FALLBACK and without_task else 0
    if K.fallbacks > K.fallback_limit:
        K.latched = 1
    K.soft_rows = 0.0
    if K.stage != MAIN_STAGE:
        K.warm = 0
    elif K.mode == LEXICOGRAPHIC and K.verdict == RELAXED:
        for i in range(K.n):  # the second stage keeps the residual: only the first one knows what causes it
            K.z_box[i], K.z[i] = K.z_box_first[i], K.z_first[i]
    if K.turned:
        turn_back(K)
    if K.on_path:
        advance(K)
    K.status = K.verdict
    return K.status


@jit
def _begin_elastic(K: Any) -> None:
    """Box and torque limits exclude each other: the latter give way too, as little as can be."""
    compliance(K, ELASTIC_TASK_RATIO)
    K.soft_rows = ELASTIC_RATIO * K.soft[0]
    K.stage = ELASTIC_STAGE


@jit
def _advance(K: Any, claim: int) -> int:
    """One rung: the status when a command is found, SOLVE when the solver has to run again."""
    stage = K.stage
    if stage == FIRST_STAGE:
        _begin_second_stage(K, claim)
        return READY
    good = claim == SOLVED and judge(K)
    if K.guard > 0.0 and not K.has_torques and not (good and within_guard(K)):
        add_torques(K)  # the same QP again, now with torque rows
        return SOLVE
    if stage == MAIN_STAGE:
        K.claim = claim
    if good:
        if stage == MAIN_STAGE or stage == RELAX_STAGE or stage == ELASTIC_STAGE:
            K.scale = K.x[K.n] if K.mode == SCALE else 1.0
        if stage == MAIN_STAGE:
            K.verdict = _verdict_on_task(K)
        elif K.mode == HARD and _verdict_on_task(K) == RELAXED:
            K.verdict = (
                RELAXED  # a residual that compliance cannot close proves that the hard QP has no solution
            )
        return _finish(K)
    K.warm = 0
    if stage == MAIN_STAGE:
        K.verdict = RELAXED if claim == INFEASIBLE else FALLBACK
        if K.mode == SLACK and not K.external:  # compliant already: only torque limits can exclude each other
            _begin_elastic(K)
        else:
            if K.mode != SLACK:  # else the very QP that the external solver could not solve
                compliance(K, RELAXED_RATIO)
            K.stage = RELAX_STAGE
    elif stage == RELAX_STAGE:
        _begin_elastic(K)
    elif stage == ELASTIC_STAGE:
        K.soft_rows = 0.0
        K.verdict = FALLBACK
        begin_rest(K, max(DECAY_TIME, K.dt))
    elif stage == REST_STAGE:
        K.soft_rows = REST_ELASTIC
        K.stage = REST_ELASTIC_STAGE
    else:
        for i in range(K.n):
            x = min(max(-K.g[i], K.lb[i]), K.ub[i])
            K.x[i] = x if is_finite(x) else 0.0
        return _finish(K)
    return SOLVE


@jit
def climb(K: Any, code: int, claim: int) -> int:
    """Run the ladder until it has a command, or, with an external solver, until the QP itself is ready.

    Args:
        K: the record, its stage prepared.
        code: READY or SOLVE when the solver is to run first, anything else when ``claim`` is already an
            answer.
        claim: the answer of an external solver.
    """
    while True:
        if code == READY and K.external:
            return READY
        if code == READY or code == SOLVE:
            claim = active_set(K)
            if K.stage == MAIN_STAGE:
                K.qp_iterations = K.iterations
        code = _advance(K, claim)
        if code != READY and code != SOLVE:
            return code
