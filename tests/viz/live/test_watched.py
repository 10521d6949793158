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


def test_the_way_that_an_arm_is_to_go_is_a_ghost_and_stays_one_while_it_is_the_same():
    q = PANDA.neutral
    way = np.stack([q, q + 0.3, q + 0.5])
    with View(PANDA, port=0) as shown:
        shown.show(q, way=way)
        (ghost,) = ways = shown.frame().ways
        assert ghost.kind == "way round" and ghost.price == f"{0.5 * 7**0.5:.1f} rad"
        assert np.allclose(ghost.joints[-1], PANDA.pose(way[-1]))
        assert np.allclose(ghost.tips[[0, -1]], [PANDA.pose(way[k])[:3, 3] for k in (0, -1)])
        named = [
            node for node in shown._page._server.scene._handle_from_node_name if node.endswith("ways/0/tip")
        ]
        assert len(named) == 1
        shown._due = 0.0
        shown.show(q + 0.1, way=way.copy())
        assert shown.frame().ways is ways
        shown._due = 0.0
        shown.show(q + 0.2)
        assert shown.frame().ways == ()
        with pytest.raises(ftqp.InputError, match="way has shape"):
            shown.show(q, way=way[:, :6])


def test_a_robot_is_shown_in_any_configuration_and_has_no_clock():
    with View(PANDA, PANDA.neutral + 0.1, port=0) as shown:
        assert np.allclose(shown.frame().q, PANDA.neutral + 0.1)
        inputs = shown._page._server.gui._gui_input_handle_from_uuid.values()
        assert not {"time", "joint1"} & {getattr(one, "label", None) for one in inputs}


def test_what_stands_around_the_arm_of_a_planner_is_drawn():
    scene = ftqp.Scene()
    scene.add("wall", ftqp.Box(size=(0.5, 0.06, 0.7), place=(0.6, 0.0, 0.35)))
    planner = ftqp.Planner(PANDA, dt=1e-3, scene=scene)
    planner.reset(PANDA.neutral)
    with ftqp.view(planner, port=0) as shown:
        (wall,) = (one for one in shown.frame().further if one.name == "wall")
        assert wall.solid.kind == "box" and wall.solid.extent == (0.25, 0.03, 0.35)
        to = planner.distances(PANDA.neutral)
        assert wall.value == pytest.approx(min(float(d) for pair, d in to.items() if "wall" in pair))


def test_what_is_neither_planner_nor_robot_is_refused():
    with pytest.raises(ftqp.InputError, match="a planner or a robot, got ndarray"):
        ftqp.view(np.zeros(7))
