"""Goel, Maciejewski and Balakrishnan 2005: failures that nobody was told of, recomputed.

What the paper states and what does not reproduce is in docs/evidence/goel2005.md. Figures that the paper
does not print were found first by an independent program. One of its figures differs: rests with joint 3
locked begin at 2 acos c with 2 c^2 - c = 0.8, which is 43.1074 degrees, not 43.1126.
"""

import numpy as np
import pytest

import ftqp
from ftqp import analysis
from ftqp.analysis import (
    basins,
    map_chunk,
    outcome,
    point_to_point,
    points,
    rest_configurations,
    workspace_task,
)
from ftqp.analysis.rest.linearisation import RestKind
from ftqp.core.errors import InputError

GOAL = (1.5, 1.5)
SLOW_GOAL = (-0.8, 0.0)
DEG = np.pi / 180.0
SPECIAL = 45.0 + np.degrees(np.arccos(1.0 / np.hypot(*GOAL)))
"""The value of joint 1 at which a whole circle is at rest [degrees]."""


@pytest.fixture(scope="module")
def two():
    return ftqp.robots.load("planar", lengths=(1, 1), continuous=True)


@pytest.fixture(scope="module")
def three():
    return ftqp.robots.load("planar", lengths=(1, 1, 1), continuous=True)


@pytest.fixture(scope="module")
def task(three):
    return workspace_task(three, GOAL, instants=0)


@pytest.fixture(scope="module")
def found(task):
    return map_chunk(task, points(task))


def polar(rho, phi):
    """A goal about joint 2 of the 2R arm, joint 1 locked at 0."""
    return 1.0 + rho * np.cos(phi * DEG), rho * np.sin(phi * DEG)


def tip_way(q):
    tip = np.exp(1j * np.cumsum(q, axis=1)).sum(axis=1)
    return np.abs(np.diff(tip)).sum()


class TestTwoLinks:
    """Section 3 and figures 1 to 4: joint 1 locked at 0, start -30 degrees."""

    start = np.array([0.0, -30.0]) * DEG

    def test_goal_a_is_reached_the_long_way_round(self, two):
        found = outcome(two, polar(1, 45), self.start, "j1")
        assert found.kind == "correct" and found.q[1] / DEG == pytest.approx(-315.0, abs=1e-4)
        assert found.errors[0] == pytest.approx(1.21752, abs=1e-5) and found.rate == pytest.approx(1.0)
        motion = point_to_point(two, polar(1, 45), self.start, duration=1.7, locked="j1", samples=400)
        late = point_to_point(two, polar(1, 45), motion.q[-1], duration=0.03, locked="j1", samples=300)
        assert 1.7 + late.t[np.argmax(late.errors)] == pytest.approx(1.716, abs=1e-3)
        assert late.errors.max() == pytest.approx(2.0, abs=1e-4)

    def test_goal_b_leaves_the_arm_where_it_is(self, two):
        found = outcome(two, polar(1, 0), self.start, "j1")
        assert found.kind == "erroneous" and np.array_equal(found.q, self.start) and found.rate == 0.0
        assert found.error == pytest.approx(0.517638, abs=1e-6) and "curve" in found.reason

    def test_goal_c_is_missed_though_something_nearer_exists(self, two):
        found = outcome(two, polar(2, 120), self.start, "j1")
        assert found.kind == "erroneous" and found.q[1] / DEG == pytest.approx(-261.787, abs=1e-3)
        assert found.error == pytest.approx(1.133893, abs=1e-5) and found.rate == pytest.approx(
            1.75, abs=1e-4
        )

    def test_goal_d_makes_the_arm_turn_for_ever(self, two):
        found = outcome(two, polar(2, 60), self.start, "j1")
        assert found.kind == "none" and found.period == pytest.approx(3.62760, abs=1e-4)
        assert found.error_range == pytest.approx((1.0, 3.0), abs=1e-4)

    @pytest.mark.parametrize(
        ("phi", "error"), [(61, 1.71477), (75, 1.50668), (90, 1.34164), (120, 1.13389), (180, 1.0)]
    )
    def test_error_at_rest_on_the_circle_of_radius_two(self, two, phi, error):
        found = outcome(two, polar(2, phi), self.start, "j1")
        assert found.kind == "erroneous" and found.error == pytest.approx(error, abs=1e-4)

    def test_goals_to_the_right_end_at_a_singularity(self, two):
        found = outcome(two, polar(2, 30), self.start, "j1")
        assert found.kind == "singular" and found.q[1] == pytest.approx(0.0, abs=1e-6)
        assert found.error == pytest.approx(1.23931, abs=1e-4)

    @pytest.mark.parametrize("phi", [-150, -60, 20, 100, 179])
    def test_goals_on_the_unit_circle_are_reached(self, two, phi):
        found = outcome(two, polar(1, phi), self.start, "j1")
        assert found.kind == "correct" and np.cos(found.q[1] - phi * DEG) == pytest.approx(1.0)


class TestThreeLinks:
    """Section 4 and figures 5 to 8; start configurations are recovered from the tip positions in print."""

    @pytest.mark.parametrize(
        ("start", "end", "way"),
        [
            ((-79.3348, 45.0, 42.7735), (-5.6173, 45.0, 66.1698), 3.045),
            ((-35.6493, 45.0, -87.7735), (50.6173, 45.0, -111.1698), 2.959),
        ],
    )
    def test_figure_5_converges_from_both_configurations(self, three, start, end, way):
        found = outcome(three, GOAL, np.array(start) * DEG, "j2")
        assert found.kind == "correct" and found.q / DEG == pytest.approx(end, abs=0.01)
        motion = point_to_point(three, GOAL, np.array(start) * DEG, duration=40, locked="j2", samples=4000)
        assert tip_way(motion.q) == pytest.approx(way, abs=2e-3)

    def test_figure_6_rests_on_a_circle_of_rests_at_one_value_of_joint_1(self, three):
        wrist = complex(-0.9, 1.8) - np.exp(1j * SPECIAL * DEG)
        elbow = np.arccos(0.5 * abs(wrist) ** 2 - 1.0)
        first = np.angle(wrist) - np.angle(1.0 + np.exp(1j * elbow))
        found = outcome(three, GOAL, [SPECIAL * DEG, first - SPECIAL * DEG, elbow], "j1")
        assert found.kind == "erroneous" and found.rate == 0.0
        assert found.q / DEG == pytest.approx((106.8745, -65.6468, 180.0), abs=0.01)
        assert found.error == pytest.approx(1.870829, abs=1e-4)

    def test_figure_6_otherwise_rests_with_the_goal_out_of_reach(self, three):
        found = outcome(three, GOAL, np.array([150.0, -107.9446, 98.8833]) * DEG, "j1")
        assert found.kind == "erroneous" and found.rate > 0.1
        assert found.q / DEG == pytest.approx((150.0, -109.2385, 0.0), abs=0.01)
        assert found.error == pytest.approx(0.904434, abs=1e-4)
        assert np.hypot(*(np.array(GOAL) - [np.cos(150 * DEG), np.sin(150 * DEG)])) > 2.0

    @pytest.mark.parametrize(
        ("value", "period"), [(10, 1.897359), (20, 4.172185), (30, 7.74332), (40, 22.23123), (-30, 7.74332)]
    )
    def test_figure_7_goes_round_for_ever(self, three, value, period):
        found = outcome(three, SLOW_GOAL, np.array([10.8852, 72.5087, value]) * DEG, "j3")
        assert found.kind == "none" and found.period == pytest.approx(period, rel=1e-3)
        turns = (found.path[-1, 0] - found.path[len(found.path) // 2, 0]) * np.sign(value)
        assert turns < -2.0 * np.pi

    def test_figure_7_has_these_errors_whatever_gain_and_speed_limit(self, three):
        start = np.array([10.8852, 72.5087, 30.0]) * DEG
        one = outcome(three, SLOW_GOAL, start, "j3")
        other = outcome(three, SLOW_GOAL, start, "j3", gain=3.0, v_max=0.25)
        assert one.error_range == pytest.approx((0.227119, 1.776600), abs=1e-5)
        assert other.error_range == pytest.approx(one.error_range, abs=1e-5)
        assert other.period > 2.0 * one.period

    def test_figure_7_between_rests_and_reach_there_are_sinks(self, three):
        found = outcome(three, SLOW_GOAL, np.array([10.8852, 72.5087, 45.0]) * DEG, "j3")
        assert found.kind == "erroneous" and found.error == pytest.approx(0.161, abs=1e-3)

    def test_a_sink_whose_eigenvalues_cross_becomes_a_small_cycle(self, three):
        """Joint 2 at 175.4: det > 0 at the rest, as at any sink, but the arm circles it for ever."""
        rest = next(
            one for one in rest_configurations(three, SLOW_GOAL, "j2", 175.4 * DEG)
            if np.iscomplexobj(one.eigenvalues) and np.abs(one.eigenvalues.imag).max() > 0.01
        )  # fmt: skip
        assert np.prod(rest.eigenvalues).real > 0.0
        found = outcome(three, SLOW_GOAL, rest.q + np.array([0.02, 0.0, 0.02]), "j2")
        assert found.kind == "none" and found.error_range[0] > 0.5
        assert found.period == pytest.approx(83.883, rel=1e-3)

    def test_figure_8_has_two_basins_of_the_same_size(self, three):
        found = basins(three, GOAL, "j2", 45.0 * DEG, grid=200)
        assert found.kinds == ("correct", "correct") and (found.label >= 0).all()
        near = np.argmin(np.abs(found.ends[:, 0] / DEG + 5.6173))
        assert found.ends[near] / DEG == pytest.approx((-5.6173, 45.0, 66.1698), abs=0.01)
        assert found.share[near] == pytest.approx(0.499, abs=0.003)
        expected = {
            1.283394: ((15.7216, 45.0, 157.5), (-2.25746, 8.82651)),
            2.946333: ((-173.2216, 45.0, 157.5), (-20.5974, 2.22085)),
        }
        assert len(found.saddles) == 2 and len(found.separatrices) == 4
        for q, eigenvalues in zip(found.saddles, found.eigenvalues, strict=True):
            error = abs(np.exp(1j * np.cumsum(q)).sum() - complex(*GOAL))
            key = min(expected, key=lambda other: abs(other - error))
            assert error == pytest.approx(key, abs=1e-4)
            assert q / DEG == pytest.approx(expected[key][0], abs=0.01)
            assert eigenvalues == pytest.approx(expected[key][1], abs=1e-3)


def test_theorem_1_as_printed_does_not_hold(three):
    """A tip velocity along the column of joint 1 is not commanded to joint 1 alone, unless n_1 is zero."""
    J = three.jacobian(np.array([20.0, 50.0, 70.0]) * DEG)[:2]
    assert np.linalg.pinv(J) @ J[:, 0] == pytest.approx((0.87028, 0.24927, -0.22529), abs=1e-5)
    J = three.jacobian(np.array([20.0, 50.0, 0.0]) * DEG)[:2]
    assert np.linalg.pinv(J) @ J[:, 0] == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)


class TestWorkspace:
    """Section 5 and figure 10."""

    @pytest.mark.slow
    def test_means_over_the_2032_samples(self, task, found):
        assert len(points(task)) == 2032 and found["configurations"].sum() == 202320
        assert found["failed"].sum() == 0
        mean = {name: value.mean(axis=0) for name, value in found.items() if value.ndim == 2}
        assert mean["R100"] == pytest.approx([35.87, 54.46, 51.85, 17.95], abs=0.5)
        assert mean["Ravg"] == pytest.approx([56.35, 68.98, 69.66, 28.01], abs=0.5)
        assert mean["Rsens"] == pytest.approx([92.2, 78.2, 77.5, 82.1], abs=2.0)

    @pytest.mark.slow
    def test_how_many_samples_are_safe_and_how_many_have_a_chance(self, found):
        whole = (found["R100"] > 100.0 - 1e-9).sum(axis=0)
        some = (found["R100"] > 0.0).sum(axis=0)
        assert whole == pytest.approx([83, 185, 185, 83], abs=2)
        assert some == pytest.approx([1568, 1873, 1941, 1318], abs=15)

    @pytest.mark.slow
    def test_any_failure_is_survived_only_beyond_and_around_the_goal(self, task, found):
        safe = points(task)[found["R100"][:, 3] > 100.0 - 1e-9, :2]
        distance, angle = np.hypot(*safe.T), np.degrees(np.arctan2(safe[:, 1], safe[:, 0]))
        assert ((distance > 2.24) & (distance < 3.0) & (angle > 20.0) & (angle < 70.0)).all()

    def test_the_two_points_in_print(self, task):
        found = map_chunk(task, np.array([[2.0, -1.4, 0.0], [-0.9, 1.8, 0.0]]))
        assert found["R100"] == pytest.approx(
            np.array([[40.8, 70.8, 64.2, 16.9], [45.3, 63.6, 60.6, 14.2]]), abs=1.5
        )
        assert found["Ravg"] == pytest.approx(
            np.array([[59.4, 80.6, 76.8, 30.4], [63.3, 69.8, 67.9, 22.7]]), abs=0.6
        )

    def test_claim_of_r100_at_100_percent_at_these_points_does_not_reproduce(self, task):
        """The paper states it for (2, -1.4), joint 2, and for (-0.9, 1.8), joint 1."""
        found = map_chunk(task, np.array([[2.0, -1.4, 0.0], [-0.9, 1.8, 0.0]]))
        assert found["R100"][0, 1] < 75.0 and found["R100"][1, 0] < 50.0
        (q,) = task.starts(np.array([-0.9, 1.8, 0.0]))
        first = q[:, 0] / DEG % 360.0
        assert first.max() > 190.0  # joint 1 leaves its range, which ends at 114.3 degrees

    def test_a_short_horizon_makes_f_low(self, three, task):
        """A likely cause of the low F in print: joint 1 fails at once on the self-motion of (-0.9, 1.8)."""
        (q,) = workspace_task(three, GOAL, configurations=2000).starts(np.array([-0.9, 1.8, 0.0]))
        ((low, high),) = task.ranges[0].intervals
        q = q[(np.mod(q[:, 0] - low, 2.0 * np.pi) <= high - low)]
        _, _, facts = task.study().runs(q, np.full(len(q), 1), horizon=100.0, success=1e-2)
        shares = [100.0 * np.mean(facts[:, 1] <= T) for T in (10.0, 20.0, 50.0, 100.0)]
        assert shares == pytest.approx([0.6, 10.0, 89.0, 97.0], abs=1.5)

    def test_failures_in_range_end_at_the_goal_by_brute_force(self, three):
        task = workspace_task(three, GOAL, configurations=12, steps=25, instants=25)
        found = map_chunk(task, points(task)[::29])
        assert found["runs"].sum() > 20000
        wrong = 1.0 - np.nanmean(found["Favg"][:, :3]) / 100.0
        assert wrong < 1e-3 and found["unresolved"].sum() <= 1e-3 * found["runs"].sum()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"W": [1.0, -1.0, 1.0]}, "eigenvalue -1"),
        ({"q0": [0.3, 0.0, 0.0]}, "q0 is singular"),
        ({"locked": "j4"}, "'j4' is not a joint"),
        ({"locked": ["j1", "j2", "j3"]}, "all 3 joints"),
        ({"at": 1.5}, "at is 1.5"),
        ({"horizon": -1.0}, "horizon is -1"),
        ({"gain": 0.0}, "gain is 0"),
        ({"goal": (1.0, 2.0, 3.0, 4.0)}, "goal has shape"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(three, options, sentence):
    with pytest.raises(InputError, match=sentence):
        outcome(three, **{"goal": GOAL, "q0": [0.3, 0.4, 0.5], "locked": "j2", **options})


ARM = ftqp.robots.load("planar", lengths=(1, 1, 1), continuous=True)


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
