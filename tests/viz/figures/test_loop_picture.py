"""The picture of a loop of one's own: what is drawn where."""

import numpy as np
import pytest

import ftqp

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')
from ftqp.viz.figures import loop_picture

T = np.linspace(0.0, 2.0, 50)


@pytest.fixture
def figure(monkeypatch, tmp_path):
    """Draws, and gives the figure that would have been written."""
    kept = []
    monkeypatch.setattr(loop_picture, "save", lambda figure, path: kept.append(figure) or path)

    def draw(*given, **more):
        loop_picture.draw_loop(tmp_path / "a.png", "title", *given, **more)
        return kept[-1]

    return draw


def test_curves_and_the_fault_are_drawn_and_named(figure):
    panels = {"error [mm]": {"a": (T, T), "b": (T, -T)}, "speed": {"v": (T, T**2)}}
    first, second = figure(panels, fault=(1.0, "joint 2 locks")).axes
    assert [text.get_text() for text in first.get_legend().get_texts()] == ["a", "b", "joint 2 locks"]
    assert np.array_equal(first.lines[1].get_ydata(), -T) and list(first.lines[2].get_xdata()) == [1.0, 1.0]
    assert (first.get_ylabel(), first.get_xlabel(), second.get_xlabel()) == ("error [mm]", "", "time [s]")


def test_a_curve_that_later_ones_hide_is_wider(figure):
    (panel,) = figure({"x": {"a": (T, T), "b": (T, T)}}).axes
    assert panel.lines[0].get_linewidth() > panel.lines[1].get_linewidth()


@pytest.mark.parametrize(("name", "flat"), [("planar6", True), ("panda", False)])
def test_the_arm_is_drawn_six_times_and_its_tip_is_where_it_was(figure, name, flat):
    robot = ftqp.robots.load(name)
    motion = robot.neutral + 0.2 * T[:, None]
    arm, _ = figure({"x": {"a": (T, T)}}, arm=(robot, motion)).axes
    view = np.eye(3)[:2] if flat else loop_picture.OBLIQUE
    chains = [line.get_xydata() for line in arm.lines if len(line.get_xydata()) == robot.nv + 2]
    assert len(chains) == 6
    for chain, q in ((chains[0], motion[0]), (chains[-1], motion[-1])):
        assert np.allclose(chain[-1], view @ robot.pose(q)[:3, 3]) and np.allclose(chain[0], 0.0)


def test_a_folder_that_is_missing_is_one_sentence(tmp_path):
    with pytest.raises(ftqp.InputError, match="cannot be written"):
        loop_picture.draw_loop(tmp_path / "no" / "a.png", "title", {"x": {"a": (T, T)}})
