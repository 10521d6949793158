"""Pictures of motions after failures: what is drawn where."""

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures import failure_pictures
from ftqp.viz.figures.failure_pictures import SignPanel, draw_basins, draw_error_signs, draw_motions


@pytest.fixture
def drawn(monkeypatch):
    """The figure that would have been written."""
    kept = []
    monkeypatch.setattr(failure_pictures, "save", lambda figure, path: kept.append(figure))
    return kept


def test_motions_are_drawn_from_start_to_end_with_their_errors(drawn, tmp_path):
    t, q = np.linspace(0.0, 5.0, 30), np.linspace([0.1, 0.2, 0.3], [1.0, 0.2, -0.4], 30)
    still = np.tile(q[0], (30, 1))
    motions = {"moves": (t, q, np.exp(-t)), "stands": (t, still, np.full(30, 0.5))}
    draw_motions(tmp_path / "m.png", "way", np.ones(3), motions, np.array([1.5, 1.5]))
    moves, error, stands, _ = drawn[0].axes
    tip = np.array([np.exp(1j * np.cumsum(row)).sum() for row in q])
    way, goal = moves.lines[-2].get_xydata(), moves.lines[-1].get_xydata()
    np.testing.assert_allclose(way, np.column_stack([tip.real, tip.imag]), atol=1e-12)
    np.testing.assert_array_equal(goal, [[1.5, 1.5]])
    np.testing.assert_array_equal(error.lines[0].get_ydata(), np.exp(-t))
    assert np.ptp(stands.lines[-2].get_xydata(), axis=0).max() == 0.0


def test_basins_have_a_colour_each_and_ways_are_broken_where_they_leave_the_square(drawn, tmp_path):
    angles = -np.pi + 2.0 * np.pi * (np.arange(20) + 0.5) / 20
    label = np.zeros((20, 20), np.int64)
    label[:5], label[5:7], label[7:8] = 1, -1, -2
    way = np.linspace([0.0, 0.0], [9.0, -7.0], 200)
    ends = np.array([[0.5, 0.5], [-1.0, 2.0]])
    kinds = ("correct", "erroneous")
    draw_basins(
        tmp_path / "b.png", "basins", ("j1", "j3"), angles, label, ends, kinds, np.ones((1, 2)), [way]
    )
    (axes,) = drawn[0].axes
    image = np.asarray(axes.images[0].get_array()).reshape(-1, 3)
    assert len(np.unique(image, axis=0)) == 4
    line = axes.lines[0].get_xydata()
    assert np.nanmax(np.abs(line)) <= 180.0 and np.isnan(line).any()
    assert [text.get_text() for text in drawn[0].legends[0].get_texts()][:2] == [
        "correct, 60.0 %", "erroneous, 25.0 %"
    ]  # fmt: skip


def test_signs_of_an_error_are_drawn_over_goals_and_angles(drawn, tmp_path):
    phi = theta = np.linspace(-np.pi, np.pi, 41)
    rest = np.sin(phi)[:, None] - np.sin(theta)[None, :]
    panel = SignPanel(phi=phi, theta=theta, falls=rest > 0, rate=rest, rest=rest, taken_in=np.abs(phi) < 1.0)
    draw_error_signs(tmp_path / "s.png", "signs", {"one": panel})
    (axes,) = drawn[0].axes
    shade = np.asarray(axes.images[0].get_array()).T
    assert np.array_equal(shade == shade.min(), panel.falls)
    x = axes.lines[0].get_xdata()
    assert np.array_equal(np.isfinite(x), panel.taken_in)
