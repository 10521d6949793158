"""Pictures of rests."""

import numpy as np

from ftqp import robots
from ftqp.analysis import CircularIntervals, joint_ranges, rest_curves
from ftqp.viz.figures.canvas import paper
from ftqp.viz.figures.rest_pictures import COLOURS, _draw, _shade, draw_rests


def is_picture(path):
    return path.read_bytes()[:4] == b"\x89PNG" and path.stat().st_size > 10_000


def unit_arm():
    return robots.load("planar", lengths=(1, 1, 1), continuous=True)


def test_rests_are_drawn_and_an_arm_without_any_too(tmp_path):
    arm, goal = unit_arm(), (1.5, 1.5)
    rests = rest_curves(arm, goal, "j1")
    assert is_picture(draw_rests(tmp_path / "r.png", "rests", rests, joint_ranges(arm, goal)["j1"]))
    none = rest_curves(arm, (-0.8, 0.0), "j1")
    assert not len(none)
    assert is_picture(draw_rests(tmp_path / "n.png", "none", none))


def test_every_stretch_of_a_curve_has_the_colour_of_its_kind():
    (curve, *_) = rest_curves(unit_arm(), (1.5, 1.5), "j1")
    axes = paper(4.0, 3.0, "").add_subplot()
    _draw(axes, curve, np.degrees(curve.q[:, 0]), curve.error)
    drawn = sum(len(line.get_xdata()) for line in axes.lines)
    assert drawn == len(curve.q)
    assert {line.get_color() for line in axes.lines} == {COLOURS[kind] for kind in set(curve.kinds)}
    assert max(np.ptp(line.get_xdata()) for line in axes.lines) < 180.0


def test_values_across_the_seam_are_shaded_on_both_sides():
    axes = paper(4.0, 3.0, "").add_subplot()
    _shade(axes, CircularIntervals.of([(3.0, 3.4)]))
    assert len(axes.patches) == 2
