import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftqp.core.errors import InputError
from ftqp.faults.kinds import Degraded, FreeSwinging, Locked
from ftqp.sim.schedule import FaultEvent, Schedule, first_tick


def test_events_are_sorted_by_time():
    schedule = Schedule([FaultEvent(Locked("b"), 2.0), FaultEvent(Locked("a"), 1.0)])
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
        [FaultEvent(fault, 1.0), FaultEvent(FreeSwinging(1), 1.0, 1.5), FaultEvent(Degraded(2), 1.0, "never")]
    )
    assert [event.told for event in schedule] == [1.0, 1.5, None]
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
        (np.inf, None, "time of the fault is inf"),
        ("soon", None, "time of the fault is 'soon', expected a number in s"),
        (2.0, 1.0, "fault of joint j at 2 s is announced at 1 s, expected no earlier"),
        (2.0, "later", "announcement of the fault is 'later', expected a time in s"),
        (2.0, np.nan, "announcement of the fault is nan"),
    ],
)
def test_wrong_times_are_one_clear_sentence(at, announced, message):
    with pytest.raises(InputError, match=message):
        FaultEvent(Locked("j"), at, announced)
