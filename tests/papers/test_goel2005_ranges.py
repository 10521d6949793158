"""Goel, Maciejewski and Balakrishnan 2005: joint ranges, rests and curves of rests of the unit 3R arm.

Figures that the paper does not print were found first by an independent program. One of its figures differs:
rests with joint 3 locked begin at 2 acos c with 2 c^2 - c = 0.8, which is 43.1074 degrees, not 43.1126.
"""

import numpy as np
import pytest

import ftqp
from ftqp import analysis
from ftqp.analysis.rest.linearisation import RestKind

ARM = ftqp.robots.load("planar", lengths=(1, 1, 1), continuous=True)
GOAL = (1.5, 1.5)


def turned(degrees: float) -> float:
    return (degrees + 180.0) % 360.0 - 180.0


@pytest.mark.parametrize(
    ("x", "ranges"),
    [
        ((1.5, 1.5), [[(-24.2952, 114.2952)], [(-111.7971, 111.7971)], [(-111.7971, 111.7971)]]),
        ((-0.8, 0.0), [[(-180.0, 180.0)], *[[(-168.5217, -51.6839), (51.6839, 168.5217)]] * 2]),
        ((2.0, -1.4), [[(-87.6745, 17.6905)], [(-87.7827, 87.7827)], [(-87.7827, 87.7827)]]),
        ((-0.9, 1.8), [[(41.6870, 191.4431)], [(-119.1738, 119.1738)], [(-119.1738, 119.1738)]]),
    ],
)
def test_ranges_of_the_table(x: tuple[float, float], ranges: list[list[tuple[float, float]]]) -> None:
    found = analysis.joint_ranges(ARM, x)
    for B, expected in zip(found.values(), ranges, strict=True):
        assert np.rad2deg(B.intervals) == pytest.approx(np.array(expected), abs=1e-3)


def test_error_along_a_joint_alone_does_not_make_a_rest() -> None:
    q = np.deg2rad([20.0, 50.0, 70.0])
    column = ARM.jacobian(q)[:2, 0]
    found = analysis.rest_test(ARM, q, ["j1"], ARM.pose(q)[:2, 3] + column)
    assert found.collinear < 1e-12
    assert found.rank > 0.1
    command = np.array([0.87028, 0.24927, -0.22529])
    assert found.rest == pytest.approx(np.linalg.norm(command[1:]) / np.linalg.norm(command), abs=1e-5)
    assert not found.passes()


def test_stretched_last_link_makes_a_rest_of_joint_1() -> None:
    q = np.deg2rad([20.0, 50.0, 0.0])
    found = analysis.rest_test(ARM, q, ["j1"], ARM.pose(q)[:2, 3] + ARM.jacobian(q)[:2, 0])
    assert found.rest < 1e-12
    assert found.rank < 1e-12
    assert found.passes()


def test_rests_of_figure_8_are_saddles() -> None:
    found = analysis.rest_configurations(ARM, GOAL, "j2", np.deg2rad(45.0))
    table = sorted((float(turned(np.rad2deg(rest.q[0]))), rest) for rest in found)
    assert [first for first, _ in table] == pytest.approx([-173.2216, 15.7216], abs=1e-4)
    (_, far), (_, near) = table
    for rest in (far, near):
        assert np.rad2deg(rest.q[1:]) == pytest.approx([45.0, 157.5], abs=1e-4)
        assert rest.kind is RestKind.SADDLE
    assert (near.error, far.error) == pytest.approx((1.283394, 2.946333), abs=1e-6)
    assert near.eigenvalues.real == pytest.approx([-2.25746, 8.82651], abs=1e-5)
    assert far.eigenvalues.real == pytest.approx([-20.5974, 2.22085], abs=1e-4)


def test_arm_of_figure_6_rests_at_a_sink_off_its_goal() -> None:
    found = analysis.rest_configurations(ARM, GOAL, "j1", np.deg2rad(150.0))
    (sink,) = (rest for rest in found if rest.kind is RestKind.SINK)
    assert turned(np.rad2deg(sink.q[1])) == pytest.approx(-109.2385, abs=1e-3)
    assert sink.q[2] == pytest.approx(0.0, abs=1e-9)
    assert sink.error == pytest.approx(0.904434, abs=1e-6)
    assert not analysis.reachable_after(ARM, GOAL, {"j1": np.deg2rad(150.0)})


def test_curve_of_figure_9_changes_its_kind_where_the_paper_draws_it_and_where_it_does_not() -> None:
    found = analysis.rest_curves(ARM, GOAL, "j1")
    (curve,) = (one for one in found if np.abs(np.sin(one.q[:, 2])).max() < 1e-6 and np.cos(one.q[0, 2]) > 0)
    assert curve.closed
    values = np.rad2deg(curve.q[:, 0])
    assert np.ptp(values) == pytest.approx(350.858 - 99.142, abs=0.01)
    changes = sorted((turned(np.rad2deg(c.value)), {c.before, c.after}) for c in curve.changes)
    regular, singular = 0.05, 0.3
    expected = [
        (286.87, {RestKind.SINK, RestKind.SOURCE}, singular),
        (335.7048, {RestKind.SADDLE, RestKind.SINK}, regular),
        (350.858, {RestKind.SADDLE, RestKind.SOURCE}, regular),
        (99.142, {RestKind.SADDLE, RestKind.SOURCE}, regular),
        (114.2952, {RestKind.SADDLE, RestKind.SINK}, regular),
        (163.13, {RestKind.SINK, RestKind.SOURCE}, singular),
    ]
    for (value, kinds), (degrees, names, tolerance) in zip(changes, expected, strict=True):
        assert value == pytest.approx(turned(degrees), abs=tolerance)
        assert kinds == names
    (low, high), *more = found.sink_intervals().intervals
    assert not more
    assert np.rad2deg([low, high]) == pytest.approx([114.2952, 335.7048], abs=1e-3)


def test_folded_last_link_rests_on_whole_circles() -> None:
    found = analysis.rest_curves(ARM, GOAL, "j1")
    circles = [one for one in found if np.cos(one.q[0, 2]) < 0]
    middles = sorted(turned(np.rad2deg(np.mean(one.q[:, 0]))) for one in circles)
    assert middles == pytest.approx([-16.87450, 106.87450], abs=1e-4)
    for circle in circles:
        assert circle.closed
        assert np.ptp(circle.q[:, 0]) < 1e-6
        assert set(circle.kinds) == {RestKind.DEGENERATE}
        assert np.ptp(circle.q[:, 1]) == pytest.approx(2.0 * np.pi)


@pytest.mark.parametrize("joint", ["j2", "j3"])
def test_sinks_of_joints_2_and_3_are_exactly_where_the_goal_is_out_of_reach(joint: str) -> None:
    found = analysis.rest_curves(ARM, GOAL, joint)
    sinks, ranges = found.sink_intervals(), analysis.joint_ranges(ARM, GOAL)[joint]
    assert sinks.size + ranges.size == pytest.approx(2.0 * np.pi, abs=1e-5)
    assert (sinks & ranges).size < 1e-5
    assert all(any(kind is not RestKind.SINK for kind in curve.kinds) for curve in found)
    assert found.intervals(RestKind.SADDLE).whole


def test_pair_of_eigenvalues_crosses_the_imaginary_axis() -> None:
    found = analysis.rest_curves(ARM, (-0.8, 0.0), "j2")
    hopf = [c for c in found.changes if {c.before, c.after} == {RestKind.SINK, RestKind.SOURCE}]
    assert sorted(turned(np.rad2deg(c.value)) for c in hopf) == pytest.approx([-175.3167, 175.3167], abs=0.01)
    for change in hopf:
        rests = analysis.rest_configurations(ARM, (-0.8, 0.0), "j2", change.value)
        best = min((rest for rest in rests), key=lambda rest: np.abs(rest.eigenvalues.real).max())
        assert np.abs(best.eigenvalues.real).max() < 1e-6
        assert np.abs(best.eigenvalues.imag) == pytest.approx([0.0784, 0.0784], abs=1e-4)


def test_joint_3_has_no_rest_below_its_fold() -> None:
    found = analysis.rest_curves(ARM, (-0.8, 0.0), "j3").intervals()
    c = (1.0 + np.sqrt(1.0 + 6.4)) / 4.0
    fold = 2.0 * np.arccos(c)
    assert np.rad2deg(fold) == pytest.approx(43.1074, abs=1e-4)
    assert found.margin(0.0) == pytest.approx(-fold, abs=1e-8)
    assert analysis.rest_configurations(ARM, (-0.8, 0.0), "j3", fold - 1e-4) == []
    kinds = {rest.kind for rest in analysis.rest_configurations(ARM, (-0.8, 0.0), "j3", fold + 1e-4)}
    assert kinds == {RestKind.SINK, RestKind.SADDLE}
