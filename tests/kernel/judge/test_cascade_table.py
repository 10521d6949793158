"""The table of the fallback cascade: its columns, and that every way through it ends at a command."""

import pytest

from ftqp.kernel.judge import cascade_table
from ftqp.kernel.judge.cascade_table import CASCADE, MASK, Says
from ftqp.kernel.layout.enums import Stage

ORDER = [row.stage for row in CASCADE]


def test_every_stage_has_one_row():
    assert sorted([*ORDER, Stage.COMMAND]) == sorted(Stage)


def test_packed_columns_hold_what_the_rows_say():
    for row in CASCADE:
        for column, entry in (
            (cascade_table.AFTER_GOOD, row.good),
            (cascade_table.AFTER_BAD, row.bad),
            (cascade_table.ASKS_FOR_TASK, row.task),
            (cascade_table.SAYS_AS_SOLVED, row.says is Says.AS_SOLVED),
            (cascade_table.SAYS_AS_MISSED, row.says is Says.AS_MISSED),
        ):
            assert column >> cascade_table.BITS * row.stage & MASK == entry
    assert max(Stage) <= MASK


@pytest.mark.parametrize("row", CASCADE, ids=lambda row: row.stage.name)
def test_the_cascade_only_goes_down_the_table(row):
    """So that it ends, whatever the answers are."""
    for following in (row.good, row.bad):
        assert following is Stage.COMMAND or ORDER.index(following) > ORDER.index(row.stage)


def test_only_a_stage_whose_good_answer_is_a_command_says_something_of_the_tick():
    for row in CASCADE:
        assert (row.says is not Says.NOTHING) == (row.good is Stage.COMMAND)
        assert row.task or row.says in (Says.NOTHING, Says.AS_BEFORE), "nothing is known of a task not asked"
