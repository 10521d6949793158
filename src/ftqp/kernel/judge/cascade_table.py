"""The fallback cascade as a table: what each stage gives up, and which stage comes after its answer.

The formulas are elsewhere: ``ftqp.kernel.judge.stage_problems`` poses the QPs of the stages, and
``ftqp.kernel.judge.fallback_cascade`` goes from stage to stage as this table says.
"""

from collections.abc import Iterable
from enum import Enum
from typing import Final, NamedTuple

from ftqp.kernel.layout.enums import Stage


class Says(Enum):
    """What a good answer says of the tick."""

    NOTHING = "it is no command"
    AS_SOLVED = "OK, SCALED or RELAXED, by what is left of the task"
    AS_MISSED = "RELAXED where the task is missed by a proof, else what was said before"
    AS_BEFORE = "what was said when the cascade left the task's own QP"


class StageRow(NamedTuple):
    """One stage of the cascade.

    ``good`` and ``bad`` are the stages after an answer that keeps the QP and after one that does not;
    ``task`` tells whether the QP asks for the task.
    """

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
        StageRow(S.CALM, end, S.CALM_ELASTIC, True, solved, "nothing: the QP of calm"),
        StageRow(S.CALM_ELASTIC, end, S.RELAX, True, before, "torque limits, and no task for them"),
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
one that failed is passed over: ``ftqp.kernel.judge.fallback_cascade`` says which. Box and failed joints are
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
