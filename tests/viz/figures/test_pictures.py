"""Pictures of arms, of loops of one's own, of arms that do not know of their failure; curves and legends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.viz.figures.conftest import legend

import ftqp
from ftqp.viz.figures import arm_picture, canvas, loop_picture, map_pictures

POINTS = np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.3], [0.3, 0.1, 0.6], [0.6, -0.1, 0.5]])
AXES = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
RANGES = np.array([[-1.0, 2.0], [-np.inf, np.inf], [0.0, 1.0]])
T = np.linspace(0.0, 2.0, 50)
GOAL = (1.5, 1.5)


@given(st.integers(1, 5000), st.integers(1, 700), st.integers(0, 99))
def test_thinned_curve_keeps_ends_and_every_extreme_of_a_bin(count, bins, seed):
    y = np.random.default_rng(seed).standard_normal(count)
    kept = canvas.thinned(y, bins=bins)
    assert (np.diff(kept) > 0).all() and kept[0] == 0 and kept[-1] == count - 1
    assert len(kept) <= 2 * bins + 2 + count // bins
    assert y[kept].max() == y.max() and y[kept].min() == y.min()


def test_gap_stays_a_gap():
    y = np.sin(np.arange(10_000.0))
    y[3000:6000] = np.nan
    kept = canvas.thinned(y, bins=100)
    inside = kept[(kept >= 3000) & (kept < 6000)]
    assert len(inside) > 10 and np.isnan(y[inside]).all()
    assert not np.isnan(y[kept[(kept < 3000) | (kept >= 6000)]]).any()


def arm_panels(drawn, folder, points=POINTS):
    q, limbs = np.array([0.5, 9.0, 0.2]), [[0, 1, 2, 3, 4]]
    up = np.array([0.0, 0.0, 1.0])
    arm_picture.draw_arm(folder / "a.png", "arm", ["a", "b", "c"], points, AXES, up, RANGES, q, limbs)
    return drawn[-1].axes


def test_joints_that_coincide_share_a_label_and_base_and_tip_are_named(drawn, tmp_path):
    for panel, title in zip(arm_panels(drawn, tmp_path), ("from the side", "from above"), strict=False):
        assert [text.get_text() for text in panel.texts] == ["1, 2", "3", "base", "tip"]
        assert panel.get_title() == title
    flat = arm_panels(drawn, tmp_path, POINTS * [1.0, 1.0, 0.0])
    assert flat[0].get_title() == "from above" and len(flat) == 2


def test_every_joint_has_its_range_and_an_endless_one_half_a_turn_either_way(drawn, tmp_path):
    panel = arm_panels(drawn, tmp_path)[-1]
    assert [label.get_text() for label in panel.get_yticklabels()] == ["1  a", "2  b", "3  c"]
    bars = [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in panel.patches]
    assert bars[0] == (-1.0, 2.0)
    assert bars[1] == pytest.approx((9.0 - np.pi, 9.0 + np.pi))
    assert len(panel.lines) == 4 + 1  # two ends of each limited range, and the posture


def loop(drawn, folder, panels, **more):
    loop_picture.draw_loop(folder / "a.png", "title", panels, **more)
    return drawn[-1].axes


def test_curves_of_a_loop_and_the_fault_are_drawn_and_named(drawn, tmp_path):
    panels = {"error [mm]": {"a": (T, T), "b": (T, -T)}, "speed": {"v": (T, T**2)}}
    first, second = loop(drawn, tmp_path, panels, fault=(1.0, "joint 2 locks"))
    assert [text.get_text() for text in first.get_legend().get_texts()] == ["a", "b", "joint 2 locks"]
    assert np.array_equal(first.lines[1].get_ydata(), -T) and list(first.lines[2].get_xdata()) == [1.0, 1.0]
    assert (first.get_ylabel(), first.get_xlabel(), second.get_xlabel()) == ("error [mm]", "", "time [s]")
    assert first.lines[0].get_linewidth() > first.lines[1].get_linewidth()  # later ones do not hide it


@pytest.mark.parametrize(("name", "flat"), [("planar6", True), ("panda", False)])
def test_the_arm_of_a_loop_is_drawn_six_times_and_its_tip_is_where_it_was(drawn, tmp_path, name, flat):
    robot = ftqp.robots.load(name)
    motion = robot.neutral + 0.2 * T[:, None]
    arm, _ = loop(drawn, tmp_path, {"x": {"a": (T, T)}}, arm=(robot, motion))
    view = np.eye(3)[:2] if flat else loop_picture.OBLIQUE
    chains = [line.get_xydata() for line in arm.lines if len(line.get_xydata()) == robot.nv + 2]
    assert len(chains) == 6
    for chain, q in ((chains[0], motion[0]), (chains[-1], motion[-1])):
        assert np.allclose(chain[-1], view @ robot.pose(q)[:3, 3]) and np.allclose(chain[0], 0.0)


def test_motions_after_failures_are_drawn_from_start_to_end_with_their_errors(drawn, tmp_path):
    t, q = np.linspace(0.0, 5.0, 30), np.linspace([0.1, 0.2, 0.3], [1.0, 0.2, -0.4], 30)
    still = np.tile(q[0], (30, 1))
    motions = {"moves": (t, q, np.exp(-t)), "stands": (t, still, np.full(30, 0.5))}
    map_pictures.draw_motions(tmp_path / "m.png", "way", np.ones(3), motions, np.array(GOAL))
    moves, error, stands, _ = drawn[0].axes
    tip = np.array([np.exp(1j * np.cumsum(row)).sum() for row in q])
    way, goal = moves.lines[-2].get_xydata(), moves.lines[-1].get_xydata()
    np.testing.assert_allclose(way, np.column_stack([tip.real, tip.imag]), atol=1e-12)
    np.testing.assert_array_equal(goal, [GOAL])
    np.testing.assert_array_equal(error.lines[0].get_ydata(), np.exp(-t))
    assert np.ptp(stands.lines[-2].get_xydata(), axis=0).max() == 0.0
    assert legend(drawn[0])[:2] == ["at the failure", "in the end"]


def test_edges_of_what_stands_around_an_arm_are_drawn_behind_it(drawn, tmp_path):
    edges = [((0.5, 0.0, 0.0), (0.5, 0.0, 1.0)), ((0.5, 0.0, 1.0), (0.5, 1.0, 1.0))]
    arm = ftqp.robots.load("panda")
    panels = {"error [mm]": {"a": (T, T)}}
    view = loop(drawn, tmp_path, panels, arm=(arm, np.tile(arm.neutral, (9, 1))), edges=edges)[0]
    assert np.allclose(view.lines[0].get_xydata(), np.array(edges[0]) @ loop_picture.OBLIQUE.T)
    assert np.allclose(view.lines[1].get_xydata(), np.array(edges[1]) @ loop_picture.OBLIQUE.T)
