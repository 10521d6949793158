"""A page of an arm that somebody else's loop leads."""

from urllib.request import urlopen

import numpy as np
import pytest

import ftqp
from ftqp.viz.live.watched import View

PANDA = ftqp.robots.load("panda")


def test_a_loop_shows_its_steps_and_what_its_planner_believes():
    planner = ftqp.Planner(PANDA, dt=1e-3)
    planner.reset(PANDA.neutral)
    target = ftqp.Target(PANDA.pose(PANDA.neutral))
    with ftqp.view(planner, port=0) as shown:
        with urlopen(shown.url) as answer:
            assert b"<html" in answer.read(2000).lower()
        assert "iframe" in shown._repr_html_() and shown.url in shown._repr_html_()
        planner.report(ftqp.Locked(2))
        step = planner.step(PANDA.neutral, None, target)
        shown.show(step)
        assert np.array_equal(shown.frame().q, step.q) and shown.frame().belief[2] == 1
        before = shown.frame()
        shown.show(PANDA.neutral + 0.1)  # too early for another picture
        assert shown.frame() is before


def test_a_robot_is_shown_in_any_configuration_and_has_no_clock():
    with View(PANDA, PANDA.neutral + 0.1, port=0) as shown:
        assert np.allclose(shown.frame().q, PANDA.neutral + 0.1)
        inputs = shown._page._server.gui._gui_input_handle_from_uuid.values()
        assert not {"time", "joint1"} & {getattr(one, "label", None) for one in inputs}


def test_what_is_neither_planner_nor_robot_is_refused():
    with pytest.raises(ftqp.InputError, match="a planner or a robot, got ndarray"):
        ftqp.view(np.zeros(7))
