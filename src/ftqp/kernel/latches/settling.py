"""Settling as a table: what a tick can find, and what that makes of the way to a hold.

    follows ---- the target stands ---> arrives --- futile ---> doubts --- for SURE ---> holds
      stood = 0                           stood > 0               sure > 0                 holding

An arm that follows, arrives or doubts is driven by its error; one that holds is not. The formulas that find
these things are elsewhere: ``ftqp.kernel.settling.trigger`` (regular), ``metric`` (no metric), ``rest`` (the
others). How often the arm has been seen to swing is counted beside this, see ``ftqp.kernel.settling.rest``.
Source: docs/theory/settling.md, "Holding".
"""

from collections.abc import Iterable
from enum import IntEnum
from typing import Any, Final, NamedTuple

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import ALL_BRAKES, HOLD, NO_BRAKES, STOPPED_BY_LAG
from ftqp.kernel.layout.thresholds import AT_REST, GOES_ON, STANDS

SURE = 0.1
"""How long it must be clear that hardly anything can be gained [s]."""


class Finding(IntEnum):
    """What a tick finds of the target, the error or the arm."""

    TARGET_MOVES = 0
    """Or another set of joints works, or the planner begins anew."""
    TARGET_STANDS = 1
    REGULAR = 2
    """The error bends less than the rows can hold."""
    NO_METRIC = 3
    """No joint is free to follow the gradient."""
    WORTH_IT = 4
    """More than hardly anything can be gained."""
    FUTILE = 5
    PUSHED = 6
    """An arm that held is far from where it did."""
    TASK_LEFT = 7
    """The task is not asked for beside a free-swinging joint."""


TARGET_MOVES, TARGET_STANDS, REGULAR, NO_METRIC, WORTH_IT, FUTILE, PUSHED, TASK_LEFT = map(int, Finding)


class Effect(IntEnum):
    """What becomes of a time or of the hold."""

    KEEP = 0
    CLEAR = 1
    GROW = 2
    """A time by that of a tick; a hold begins once ``sure`` has grown to SURE."""


class SettlingRow(NamedTuple):
    """What a finding makes of ``stood``, ``sure`` and ``holding``."""

    finding: Finding
    stood: Effect
    sure: Effect
    holding: Effect


KEEP, CLEAR, GROW = Effect
SETTLING: Final = (
    SettlingRow(Finding.TARGET_MOVES, CLEAR, CLEAR, CLEAR),
    SettlingRow(Finding.TARGET_STANDS, GROW, KEEP, KEEP),
    SettlingRow(Finding.REGULAR, KEEP, CLEAR, KEEP),
    SettlingRow(Finding.NO_METRIC, KEEP, CLEAR, CLEAR),
    SettlingRow(Finding.WORTH_IT, KEEP, CLEAR, KEEP),
    SettlingRow(Finding.FUTILE, KEEP, GROW, GROW),
    SettlingRow(Finding.PUSHED, CLEAR, CLEAR, CLEAR),
    SettlingRow(Finding.TASK_LEFT, KEEP, KEEP, CLEAR),
)
"""All that leads from one state to another. An arm that holds is asked only whether it was pushed."""

BITS: Final = 2
"""Of an effect in a packed column."""
MASK: Final = (1 << BITS) - 1


def _packed(effects: Iterable[tuple[Finding, Effect]]) -> int:
    """A column of the table as one number, which compiled code reads by a shift."""
    return sum(int(effect) << BITS * int(finding) for finding, effect in effects)


STOOD_AFTER: Final = _packed((row.finding, row.stood) for row in SETTLING)
SURE_AFTER: Final = _packed((row.finding, row.sure) for row in SETTLING)
HOLDING_AFTER: Final = _packed((row.finding, row.holding) for row in SETTLING)
"""The columns, packed."""
CLEARS: Final = int(CLEAR)
GROWS: Final = int(GROW)


@jit
def _time_after(time: float, effect: int, dt: float) -> float:
    if effect == CLEARS:
        return 0.0
    return time + dt if effect == GROWS else time


@jit
def settle(settling: Any, finding: int, dt: float) -> None:
    """Go on as the table says of a finding: nothing else writes ``stood``, ``sure`` and ``holding``."""
    settling.stood = _time_after(settling.stood, STOOD_AFTER >> BITS * finding & MASK, dt)
    settling.sure = _time_after(settling.sure, SURE_AFTER >> BITS * finding & MASK, dt)
    effect = HOLDING_AFTER >> BITS * finding & MASK
    if effect == CLEARS:
        settling.holding = 0
    elif effect == GROWS and settling.sure >= SURE:
        settling.holding = 1


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
