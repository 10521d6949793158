"""Settling: what a tick can find, and what that makes of the way to a hold; and the latch of a stop.

    follows ---- the target stands ---> arrives --- futile ---> doubts --- for SURE ---> holds
      stood = 0                           stood > 0               sure > 0                 holding

An arm that follows, arrives or doubts is driven by its error; one that holds is not. The formulas that find
these things are elsewhere: ``ftqp.kernel.settling.trigger`` (regular), ``metric`` (no metric), ``rest`` (the
others). How often the arm has been seen to swing is counted beside this, see ``ftqp.kernel.settling.rest``.
Source: docs/theory/settling.md, "Holding".
"""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import ALL_BRAKES, HOLD, NO_BRAKES, STOPPED_BY_LAG
from ftqp.kernel.layout.thresholds import AT_REST, GOES_ON, STANDS

SURE = 0.1
"""How long it must be clear that hardly anything can be gained [s]."""


TARGET_MOVES, TARGET_STANDS, REGULAR, NO_METRIC, WORTH_IT, FUTILE, PUSHED, TASK_LEFT = range(8)
"""What a tick finds: the target moves, or another set of joints works; it stands; the error bends less than
the rows can hold; no joint is free to follow the gradient; more than hardly anything can be gained, or not;
an arm that held is far from where it did; the task is not asked for beside a free-swinging joint."""


@jit
def settle(settling: Any, finding: int, dt: float) -> None:
    """Go on as a finding has it: nothing else writes ``stood``, ``sure`` and ``holding``."""
    if finding == TARGET_STANDS:
        settling.stood += dt
        return
    if finding == TARGET_MOVES or finding == PUSHED:
        settling.stood = 0.0
    if finding == FUTILE:
        settling.sure += dt
        if settling.sure >= SURE:
            settling.holding = 1
        return
    if finding != TASK_LEFT:
        settling.sure = 0.0
    if finding != REGULAR and finding != WORTH_IT:
        settling.holding = 0


@jit
def forget_settling(settling: Any) -> None:
    """Begin anew: nothing is held, and no swing has been seen."""
    settle(settling, TARGET_MOVES, 0.0)
    settling.gradient_suppressed = 0
    settling.window = 0.0


@jit
def keep_rows(task: Any, terms: Any, qp: Any, level: int) -> None:
    """Reduce the task by so many sets; 0 is the whole task. The tip is drawn to rows that are given up."""
    task.given_up = level
    task.m, task.tool_rows = task.m_of[level], task.tool_of[level]
    task.late = task.held = qp.warm = 0
    terms.count = terms.own + (1 if level > 0 and task.uses_rotation != 0 else 0)


@jit
def restore(task: Any, terms: Any, qp: Any) -> None:
    """The whole task again, as if nothing had been given up."""
    keep_rows(task, terms, qp, 0)
    task.wait = task.patience


@jit
def give_up(task: Any, terms: Any, qp: Any) -> bool:
    """Give up the next set of rows; False where no more may be."""
    if task.given_up >= task.sets:
        return False
    keep_rows(task, terms, qp, task.given_up + 1)
    return True


@jit
def latch(watch: Any, reason: int) -> None:
    """Latch a stop; whoever does asks before whether one is latched, whose reason stays."""
    watch.latched = 1
    watch.reason = reason


@jit
def ask_for_brake(watch: Any, feedback: Any, i: int) -> None:
    """Let the brake of joint i be asked for from now on, if the arm has any; that of all stops it."""
    if feedback.brakes == NO_BRAKES:
        return
    feedback.asks[i] = 1
    if feedback.brakes == ALL_BRAKES and watch.latched == 0:
        feedback.isolated_joint = i
        latch(watch, STOPPED_BY_LAG)


@jit
def slow_enough(K: Any) -> float:
    """Below this share of its limit a joint counts as at rest in a stop."""
    if K.faults.movable == K.faults.working or K.free.mode != HOLD:
        return AT_REST
    return GOES_ON if K.watch.stopped else STANDS
