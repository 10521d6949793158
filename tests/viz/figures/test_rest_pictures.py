"""Pictures of rests: what is drawn of the curves, and where the goal stays within reach."""

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp import robots
from ftqp.analysis import CircularIntervals, rest_curves
from ftqp.viz.figures import rest_pictures

ARM, GOAL = robots.load("planar", lengths=(1, 1, 1), continuous=True), (1.5, 1.5)


@pytest.fixture
def drawn(monkeypatch, tmp_path):
    """The panels of a drawn picture."""
    kept = []
    monkeypatch.setattr(rest_pictures, "save", lambda figure, path: kept.append(figure))

    def draw(*given):
        rest_pictures.draw_rests(tmp_path / "r.png", "rests", *given)
        return kept[-1].axes

    return draw


def test_every_stretch_of_a_curve_has_the_colour_of_its_kind(drawn):
    rests = rest_curves(ARM, GOAL, "j1")
    for axes in drawn(rests):
        lines = [line for line in axes.lines if line.get_linestyle() != "None"]
        assert sum(len(line.get_xdata()) for line in lines) == sum(len(curve.q) for curve in rests)
        kinds = {kind for curve in rests for kind in curve.kinds}
        assert {line.get_color() for line in lines} == {rest_pictures.COLOURS[kind] for kind in kinds}
        assert max(np.ptp(line.get_xdata()) for line in lines) < 180.0


def test_values_across_the_seam_are_shaded_on_both_sides_and_no_rest_is_an_empty_picture(drawn):
    none = rest_curves(ARM, (-0.8, 0.0), "j1")
    assert not len(none)
    for axes in drawn(none, CircularIntervals.of([(3.0, 3.4)])):
        assert len(axes.patches) == 2 and not axes.lines
