"""The fallback cascade: which QP comes next when an answer is bad, as a table and the loop over it.

The table has the stages and their order; here is what goes from one to the next. The box and the failed
joints are never relaxed. There is one loop and one call of the solver, whatever happens; an external solver
takes the place of the first one for the QP itself. No foreign solver's claim that a QP has no solution is
believed: RELAXED is said where the least excess proves it, or what is left of a hard task, and FALLBACK
otherwise.

``ftqp.kernel.judge.stage_problems`` poses the QPs of the stages.
"""

from collections.abc import Iterable
from enum import Enum
from math import inf
from typing import Any, Final, NamedTuple

from ftqp.kernel.active_set.active_set import active_set
from ftqp.kernel.arm.reaction import react
from ftqp.kernel.feedback.gate import pass_gate
from ftqp.kernel.feedback.sent import send
from ftqp.kernel.feedback.status_report import goes_on, report_status
from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.judge.solution_check import check_solution, command, joints_outside, too_near
from ftqp.kernel.judge.stage_problems import (
    SETTLING_ELASTIC,
    begin_decay,
    begin_elastic,
    begin_elastic_rest,
    begin_least_excess,
    begin_plain,
    begin_relaxed,
    begin_relaxed_after_settling,
    begin_second_stage,
    box_excludes_rows,
    clip_rest,
)
from ftqp.kernel.judge.unconstrained import unconstrained_solve
from ftqp.kernel.latches.settling import give_up, keep_rows, latch, slow_enough
from ftqp.kernel.layout.enums import (
    CLIP_STAGE,
    COMMAND_STAGE,
    ELASTIC_STAGE,
    FALLBACK,
    FIRST_STAGE,
    HARD,
    INFEASIBLE,
    LEAST_EXCESS_STAGE,
    LEXICOGRAPHIC,
    MAIN_STAGE,
    MEASURED,
    NEWS,
    OK,
    PLAIN_STAGE,
    QP_READY,
    RELAX_STAGE,
    RELAXED,
    REST_ELASTIC_STAGE,
    REST_STAGE,
    SCALE,
    SCALED,
    SETTLING_ELASTIC_STAGE,
    SETTLING_STAGE,
    SLACK,
    SOLVE,
    SOLVED,
    STOPPED,
    STOPPED_BY_FALLBACKS,
    STOPPING,
    Stage,
)
from ftqp.kernel.layout.thresholds import AT_REST, RELAXED_FROM, SCALED_FROM, TASK_FLOOR
from ftqp.kernel.maths.linear_systems import assign, plus_products
from ftqp.kernel.rows.constraint_rows import add_constraints, keeps_torque
from ftqp.kernel.rows.holding_rows import leave_to_motors
from ftqp.kernel.rows.rows_given_up import is_whole, more_rows_hold
from ftqp.kernel.rows.task_terms import judge_terms


class Says(Enum):
    """What a good answer says of the tick."""

    NOTHING = "it is no command"
    AS_SOLVED = "OK, SCALED or RELAXED, by what is left of the task"
    AS_MISSED = "RELAXED where the task is missed by a proof, else what was said before"
    AS_BEFORE = "what was said when the cascade left the task's own QP"


class StageRow(NamedTuple):
    """One stage: what comes after a ``good`` and a ``bad`` answer, and whether it asks for the task."""

    stage: Stage
    good: Stage
    bad: Stage
    task: bool
    says: Says
    gives_up: str


def _rows() -> tuple[StageRow, ...]:
    S, solved, missed, before, nothing = Stage, Says.AS_SOLVED, Says.AS_MISSED, Says.AS_BEFORE, Says.NOTHING
    end = Stage.COMMAND
    return (
        StageRow(S.FIRST, S.MAIN, S.MAIN, True, nothing, "nothing: how near to the task can x be?"),
        StageRow(S.MAIN, end, S.RELAX, True, solved, "nothing: the task's QP, by its mode"),
        StageRow(S.SETTLING, end, S.SETTLING_ELASTIC, True, solved, "nothing: the QP of settling"),
        StageRow(S.SETTLING_ELASTIC, end, S.RELAX, True, before, "torque limits, and no task for them"),
        StageRow(S.RELAX, end, S.LEAST_EXCESS, True, missed, "of the task what cannot be kept"),
        StageRow(S.LEAST_EXCESS, S.ELASTIC, S.REST, False, nothing, "all: what do torque limits lack?"),
        StageRow(S.ELASTIC, end, S.PLAIN, True, missed, "of torque limits what they lack, and of the task"),
        StageRow(S.PLAIN, end, S.REST, True, missed, "the criterion of the scheme, too"),
        StageRow(S.REST, end, S.REST_ELASTIC, False, before, "the task: the arm is brought to rest"),
        StageRow(S.REST_ELASTIC, end, S.CLIP, False, before, "torque limits, too"),
        StageRow(S.CLIP, end, end, False, before, "all but box and failed joints: there is no QP any more"),
    )


CASCADE: Final = _rows()
"""All stages, in the order in which they give up more. A tick enters at FIRST (lexicographic mode), MAIN,
CALM or REST (a stop, or a free-swinging joint that the task is left for). A stage that adds nothing to the
one that failed is passed over. Box and failed joints are
never given up."""

BITS: Final = 4
"""Of an entry of a packed column."""
MASK: Final = (1 << BITS) - 1
"""The largest entry."""


def _packed(entries: Iterable[tuple[Stage, int]]) -> int:
    """A column of the table as one number, which compiled code reads by a shift."""
    return sum(int(entry) << BITS * int(stage) for stage, entry in entries)


AFTER_GOOD: Final = _packed((row.stage, row.good) for row in CASCADE)
AFTER_BAD: Final = _packed((row.stage, row.bad) for row in CASCADE)
ASKS_FOR_TASK: Final = _packed((row.stage, row.task) for row in CASCADE)
SAYS_AS_SOLVED: Final = _packed((row.stage, row.says is Says.AS_SOLVED) for row in CASCADE)
SAYS_AS_MISSED: Final = _packed((row.stage, row.says is Says.AS_MISSED) for row in CASCADE)
"""The columns, packed."""


NEARER = 0.99
"""A task whose error is below this share of the least one so far is still being approached."""
LONGEST = 64
"""Rows are taken back after so many times the patience at most: it doubles whenever they come back. A
convention."""


@rare_jit
def count_rows(K: Any, status: int) -> None:
    """After a tick of this status: the next set of rows is given up, or the last one taken back.

    Rows are given up where that was asked for, ``healthy_too``, the task has been infeasible for ``patience``
    ticks, and its error has not become less; beside a joint that swings freely unasked, and also where it
    has. They come back after ``wait`` ticks in which they could be held.
    """
    task, terms = K.task, K.terms
    swings = K.faults.movable > K.faults.working
    if status != RELAXED:
        task.late = task.held = 0
        return
    if task.given_up > 0:
        held = K.cascade.missed == 0 and more_rows_hold(K)
        task.held = task.held + 1 if held else 0
        if task.held > task.wait:
            keep_rows(task, terms, K.qp, 0 if is_whole(K) else task.given_up - 1)
            task.wait = min(2 * task.wait, LONGEST * task.patience)
            return
    if K.cascade.missed == 0 or (task.healthy_too == 0 and not swings):
        task.late = 0
        return
    feedback = K.feedback
    e = task.position_error / feedback.tolerance + task.rotation_error / feedback.rotation_tolerance
    if task.late == 0:
        task.nearest = e
    elif e < NEARER * task.nearest and not swings:
        task.nearest, task.late = e, 0
    task.late += 1
    if task.late > task.patience:
        give_up(task, terms, K.qp)


@jit
def _misses_task(task: Any) -> bool:
    """Whether the solved QP leaves more of the task than counts as none."""
    size, residual = task.beyond, 0.0
    for k in range(task.m):
        size = max(size, abs(task.asked[k]))
        residual = max(residual, abs(task.slack[k]))
    return bool(residual > RELAXED_FROM * size + TASK_FLOOR)


@jit
def _outcome_of_solved(task: Any, cascade: Any, terms: Any) -> int:
    """OK, SCALED or RELAXED, by what is left of the tasks, rows given up included, and by limits not kept."""
    if cascade.missed or cascade.outside > 0 or cascade.jump < 1.0 or task.given_up > 0:
        return RELAXED
    if terms.count and terms.missed > 0:
        return RELAXED
    return SCALED if task.scale < SCALED_FROM else OK


@rare_jit
def _sets_out(K: Any) -> bool:
    """Whether something is sent that moves: beside a joint that swings freely, off a limit, or to brake."""
    limits, faults, state, feedback = K.limits, K.faults, K.state, K.feedback
    slow = slow_enough(K)
    for k in range(K.chain.n):
        i = faults.order[k]
        top = limits.v_max[i] if limits.v_max[i] < inf else 1.0
        if k < faults.working and abs(state.v_command[i]) > slow * top:
            return True
        held = k >= faults.movable and faults.code[i] != MEASURED
        if held and abs(feedback.v_sent[i]) > AT_REST * top:
            return True
    return False


@part_jit
def _finish(K: Any) -> int:
    """Write the command and settle the status; too many in a row without the task latch the stop."""
    task, watch, cascade, qp = K.task, K.watch, K.cascade, K.qp
    command(K)
    if K.chain.floating:
        react(K)
    send(K)
    shut = not pass_gate(K)
    without_task = shut or not _entry(ASKS_FOR_TASK, cascade.stage)
    watch.fallbacks = watch.fallbacks + 1 if cascade.outcome == FALLBACK and without_task else 0
    if watch.fallbacks > watch.fallback_limit and watch.latched == 0:
        latch(watch, STOPPED_BY_FALLBACKS)
    qp.soft_rows = 0.0
    if _is_settling(cascade.stage):
        if cascade.external:
            qp.warm = 0
    elif shut or cascade.stage != MAIN_STAGE:
        qp.warm = 0
    elif task.mode == LEXICOGRAPHIC and cascade.outcome == RELAXED:
        for i in range(K.chain.n):  # the second stage keeps the residual: only the first knows what causes it
            qp.z_box[i] = cascade.z_box_first[i]
        assign(qp.z, cascade.z_first, qp.nc)
    if watch.latched or cascade.outcome == STOPPED:
        at_rest = cascade.outcome == STOPPED and not _sets_out(K)
        if goes_on(K, at_rest) or (cascade.outcome == STOPPED and not at_rest):
            cascade.outcome = STOPPING
    cascade.status = report_status(K.state, K.limits, task, K.feedback, K.chain, K.terms, cascade.outcome)
    if task.sets > 0 and (cascade.status == RELAXED or task.late > 0 or task.held > 0):
        count_rows(K, cascade.status)
    return cascade.status + NEWS if K.monitor.news else cascade.status


@jit
def _entry(column: int, stage: int) -> int:
    """What a packed column of the table says of a stage."""
    return column >> BITS * stage & MASK


@jit
def _is_settling(stage: int) -> bool:
    return stage == SETTLING_STAGE or stage == SETTLING_ELASTIC_STAGE


@rare_jit
def _stage_after_bad(K: Any, stage: int) -> int:
    """The next stage by the table; one that adds nothing to the QP that has just failed is passed over.

    In mode ``slack`` the QP is as compliant as the best feasible one already, so that only torque limits and
    box can exclude each other, if the solver was the kernel's own. Without torque rows none can give way.
    """
    following = _entry(AFTER_BAD, stage)
    compliant = stage == MAIN_STAGE and K.task.mode == SLACK and not K.cascade.external
    if (following == RELAX_STAGE and compliant) or (following == SETTLING_ELASTIC_STAGE and K.qp.nc == 0):
        return _entry(AFTER_BAD, following)
    return following


@rare_jit
def _begin(K: Any, stage: int, claim: int) -> int:
    """Pose the QP of a stage: QP_READY for the task's own, which an external solver may take, else SOLVE."""
    cascade, was = K.cascade, K.cascade.stage
    cascade.stage = stage
    if stage == MAIN_STAGE:
        begin_second_stage(K, claim)
        return QP_READY
    if stage == SETTLING_ELASTIC_STAGE:
        leave_to_motors(K)
        K.qp.soft_rows = SETTLING_ELASTIC
    elif stage == RELAX_STAGE:
        if _is_settling(was):
            begin_relaxed_after_settling(K)
        else:
            begin_relaxed(K)
    elif stage == LEAST_EXCESS_STAGE:
        begin_least_excess(K)
    elif stage == ELASTIC_STAGE:
        if box_excludes_rows(K.faults, K.chain, K.qp, K.scratch, K.aside):
            cascade.outcome = RELAXED
        begin_elastic(K)
    elif stage == PLAIN_STAGE:
        begin_plain(K)
    elif stage == REST_STAGE:
        cascade.outcome = FALLBACK
        begin_decay(K)
    elif stage == REST_ELASTIC_STAGE:
        begin_elastic_rest(K)
    return SOLVE


@rare_jit
def _read_calm(K: Any) -> None:
    """What is left of the task in settling, whose rows are in the objective, and the rate of a path."""
    task, qp = K.task, K.qp
    for k in range(task.m):
        task.slack[k] = plus_products(-task.asked[k], qp.A[k], qp.x, qp.nx)
    task.scale = qp.x[K.chain.n] if qp.nx > K.chain.n else 1.0


@jit
def _weigh(K: Any, stage: int) -> None:
    """What a good answer leaves of the task, and what is said of the tick, as the table has it."""
    task, cascade = K.task, K.cascade
    if K.terms.count:
        judge_terms(K, _entry(ASKS_FOR_TASK, stage) != 0)
    if not _entry(ASKS_FOR_TASK, stage):
        return
    if _is_settling(stage):
        _read_calm(K)
    else:
        task.scale = K.qp.x[K.chain.n] if task.mode == SCALE else 1.0
    cascade.missed = _misses_task(task)
    cascade.outside = joints_outside(K) + too_near(K)
    if _entry(SAYS_AS_SOLVED, stage):
        cascade.outcome = _outcome_of_solved(task, cascade, K.terms)
    elif _entry(SAYS_AS_MISSED, stage) and cascade.missed and (task.mode == HARD or not cascade.external):
        cascade.outcome = RELAXED  # what compliance cannot close proves that no motion follows the task


@jit
def _advance(K: Any, claim: int) -> int:
    """Go on to the next stage: the status when a command is found, SOLVE when the solver has to run again."""
    task, cascade, qp = K.task, K.cascade, K.qp
    stage = cascade.stage
    if stage == FIRST_STAGE:
        return _begin(K, _entry(AFTER_BAD, stage), claim)
    good = claim == SOLVED and (cascade.checked != 0 or check_solution(task, cascade, qp, K.scratch))
    if K.limits.on_demand and not K.kinematics.has_dynamics and not (good and keeps_torque(K)):
        add_constraints(K)  # the same QP again, now with torque rows
        return SOLVE
    first_choice = _entry(SAYS_AS_SOLVED, stage)
    if first_choice:
        cascade.claim = claim
    if good:
        following = _entry(AFTER_GOOD, stage)
        if following == COMMAND_STAGE:
            _weigh(K, stage)
            return _finish(K)
        return _begin(K, following, claim)
    qp.warm = 0
    if first_choice:
        own_proof = claim == INFEASIBLE and (
            _is_settling(stage) or (task.mode == HARD and not cascade.external)
        )
        cascade.outcome = RELAXED if own_proof else FALLBACK
    following = _stage_after_bad(K, stage)
    if following == CLIP_STAGE:
        cascade.stage = CLIP_STAGE
        clip_rest(K)
        _weigh(K, CLIP_STAGE)
        return _finish(K)
    return _begin(K, following, claim)


@part_jit
def run_cascade(K: Any, code: int, claim: int) -> int:
    """Run the cascade until it has a command, or, with an external solver, until the QP itself is ready."""
    cascade, qp = K.cascade, K.qp
    cascade.checked = 0
    while True:
        if code == QP_READY and cascade.external:
            return QP_READY
        if code == QP_READY or code == SOLVE:
            if cascade.stage == MAIN_STAGE and unconstrained_solve(K):
                cascade.checked, claim = 1, SOLVED
            else:
                cascade.checked, claim = 0, active_set(qp)
            if cascade.stage == MAIN_STAGE or _is_settling(cascade.stage):
                cascade.qp_iterations = qp.iterations
        code = _advance(K, claim)
        if code != QP_READY and code != SOLVE:
            return code
