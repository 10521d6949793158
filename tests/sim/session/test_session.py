"""A session: orders between ticks, truth and belief, and a clock that skips nothing."""

import numpy as np
import pytest

from ftqp.app.view.casting import cast_of
from ftqp.sim.session.cast import Choice
from ftqp.sim.session.orders import Break, Pause, Repair, Reset
from ftqp.sim.session.session import Session


@pytest.fixture
def panda():
    return Session(cast_of, Choice(scenario="panda-y-line"))


def test_click_breaks_the_plant_and_the_planner_is_told_at_once(panda):
    panda.put(Break("panda_joint2"))
    panda.advance(0.004)
    facts = panda.facts
    assert facts.truth.tolist() == facts.belief.tolist() == [0, 1, 0, 0, 0, 0, 0]
    assert facts.message == ""
    panda.put(Repair(1))
    panda.advance(0.004)
    assert not panda.facts.truth.any() and not panda.facts.belief.any()


def test_pause_makes_no_tick_and_reset_shows_the_same_first_frame(panda):
    first = panda.facts
    panda.put(Break(3, "degraded"))
    panda.advance(0.1)
    panda.put(Pause(True))
    assert panda.advance(1.0) == 0
    assert panda.facts.paused
    tick = panda.facts.tick
    panda.put(Reset())
    panda.advance(0.0)
    again = panda.facts
    assert tick == 50 and again.tick == 0
    np.testing.assert_array_equal(again.q, first.q)
    assert not again.truth.any() and not again.belief.any()
