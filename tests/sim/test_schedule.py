import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftqp.core.errors import InputError
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.sim.schedule import FaultEvent, Schedule, first_tick


def test_events_are_sorted_by_time():
    schedule = Schedule([FaultEvent(2.0, Locked("b")), FaultEvent(1.0, Locked("a"))])
    assert [event.at for event in schedule] == [1.0, 2.0]
    assert len(schedule) == 2


@given(st.integers(0, 100_000), st.sampled_from([1e-3, 1e-2, 0.1, 1 / 3]))
def test_a_time_on_a_tick_belongs_to_that_tick_despite_rounding(k, dt):
    assert first_tick(k * dt, dt) == k
    assert first_tick(sum([k * dt / 4] * 4), dt) == k


def test_a_time_between_two_ticks_belongs_to_the_later():
    assert first_tick(0.1001, 0.1) == 2
    assert first_tick(0.0999999999, 0.1) == 1


def test_announcement_is_at_once_later_or_never():
    fault = Locked(0)
    schedule = Schedule(
        [FaultEvent(1.0, fault), FaultEvent(1.0, FreeSwinging(1), 1.5), FaultEvent(1.0, Degraded(2), "never")]
    )
    assert [event.reported_at for event in schedule] == [1.0, 1.5, None]
    assert {k: len(events) for k, events in schedule.failing(0.1).items()} == {10: 3}
    assert {k: [e.fault.joint for e in events] for k, events in schedule.announced(0.1).items()} == {
        10: [0],
        15: [1],
    }


@pytest.mark.parametrize(
    ("at", "announced", "message"),
    [
        (-1.0, None, "time of the fault is -1, expected"),
        (np.nan, None, "time of the fault is nan"),
        (2.0, 1.0, "fault of joint j at 2 s is announced at 1 s, expected no earlier"),
        (2.0, "later", "announcement of the fault is 'later', expected a time in s"),
    ],
)
def test_wrong_times_are_one_clear_sentence(at, announced, message):
    with pytest.raises(InputError, match=message):
        FaultEvent(at, Locked("j"), announced)


def test_the_order_of_earlier_versions_is_understood_with_a_warning():
    new = FaultEvent(1.0, Locked("j"), 1.5)
    for old in (
        lambda: FaultEvent(Locked("j"), 1.0, 1.5),
        lambda: FaultEvent(Locked("j"), at=1.0, announced=1.5),
    ):
        with pytest.warns(DeprecationWarning, match="write FaultEvent"):
            assert old() == new
    assert FaultEvent(fault=Locked("j"), at=1.0, announced=1.5) == new
    with pytest.warns(DeprecationWarning, match="reported_at"):
        assert new.told == new.reported_at == 1.5
