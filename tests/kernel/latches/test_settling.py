"""Settling as a table: what each finding makes of the times and the hold."""

from records import empty_record

from ftqp.kernel.latches import settling
from ftqp.kernel.latches.settling import settle

DT = 0.01


def calm_of(stood=0.7, sure=0.05, holding=1):
    """A room of an arm that has settled so far."""
    calm = empty_record().calm
    calm.stood, calm.sure, calm.holding = stood, sure, holding
    return calm


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
