"""Settling as a table: what each finding makes of the times and the hold."""

import pytest
from records import empty_record

from ftqp.kernel.latches import settling
from ftqp.kernel.latches.settling import MASK, SETTLING, Effect, Finding, settle

DT = 0.01


def calm_of(stood=0.7, sure=0.05, holding=1):
    """A room of an arm that has settled so far."""
    calm = empty_record().calm
    calm.stood, calm.sure, calm.holding = stood, sure, holding
    return calm


def test_every_finding_has_one_row():
    assert [row.finding for row in SETTLING] == list(Finding)


@pytest.mark.parametrize("row", SETTLING, ids=lambda row: row.finding.name)
def test_a_finding_does_what_its_row_says(row):
    for holding in (0, 1):
        calm = calm_of(holding=holding)
        settle(calm, int(row.finding), DT)
        after = {Effect.KEEP: 0.0, Effect.GROW: DT}
        assert calm.stood == (0.0 if row.stood is Effect.CLEAR else 0.7 + after[row.stood])
        assert calm.sure == (0.0 if row.sure is Effect.CLEAR else 0.05 + after[row.sure])
        assert calm.holding == (0 if row.holding is Effect.CLEAR else holding), "not sure for long enough"
    for column in (settling.STOOD_AFTER, settling.SURE_AFTER, settling.HOLDING_AFTER):
        assert column >> settling.BITS * row.finding & MASK in list(Effect)


def test_an_arm_holds_once_it_has_been_futile_for_so_long_without_a_break():
    calm = calm_of(sure=0.0, holding=0)
    ticks = round(settling.SURE / DT)
    for broken in (True, False):
        for _ in range(ticks - 1):
            settle(calm, settling.FUTILE, DT)
            assert not calm.holding
        if broken:
            settle(calm, settling.WORTH_IT, DT)
    settle(calm, settling.FUTILE, DT)
    settle(calm, settling.FUTILE, DT)  # rounding may take one more
    assert calm.holding


def test_whoever_begins_anew_holds_nothing_and_has_seen_no_swing():
    calm = calm_of()
    calm.hushed, calm.window = 2, 0.3
    settling.forget_settling(calm)
    assert (calm.stood, calm.sure, calm.holding, calm.hushed, calm.window) == (0.0, 0.0, 0, 0, 0.0)
