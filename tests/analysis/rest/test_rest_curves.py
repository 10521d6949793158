"""Curves of rests: every point is one, and none of a scan is missing."""

import numpy as np
import pytest
from planar_arms import links, telescope

from ftqp.analysis.manifolds.joint_ranges import joint_ranges
from ftqp.analysis.rest.linearisation import RestKind, rest_test
from ftqp.analysis.rest.rest_configurations import rest_configurations
from ftqp.analysis.rest.rest_curves import rest_curves
from ftqp.model import catalog

W = np.array([[1.0, 0.3, 0.0], [0.3, 2.0, -0.4], [0.0, -0.4, 0.7]])


@pytest.mark.parametrize("joint", ["j1", "j3"])
def test_rests_of_a_scan_are_on_the_curves_with_their_kind(joint: str) -> None:
    robot, goal = links(1, 0.8, 0.55), (1.1, 0.6)
    curves = rest_curves(robot, goal, joint, W)
    points = np.vstack([curve.q for curve in curves])
    kinds = np.array([kind for curve in curves for kind in curve.kinds])
    count = 0
    for value in np.linspace(-3.0, 3.0, 14):
        for rest in rest_configurations(robot, goal, joint, float(value), W):
            away = points - rest.q
            distance = np.linalg.norm(away - 2.0 * np.pi * np.round(away / (2.0 * np.pi)), axis=1)
            nearest = np.argsort(distance)[:3]
            assert distance[nearest[0]] < 0.05
            assert rest.kind in kinds[nearest]
            count += 1
    assert count > 14


def test_points_of_a_curve_rest() -> None:
    robot, goal = links(1, 1, 1, 1), (1.5, 1.5)
    curves = rest_curves(robot, goal, "j2")
    assert len(curves) > 0
    for curve in curves:
        tested = [rest_test(robot, q, ["j2"], goal) for q in curve.q[::25]]
        assert max(found.rest for found in tested if found.full_rank > 1e-3) < 1e-7


def test_goal_out_of_reach_has_rests_all_the_same() -> None:
    curves = rest_curves(links(1, 1, 1), (3.5, 0.0), "j2")
    assert curves.sink_intervals().intervals


def test_sinks_within_reach_appear_with_a_long_second_link() -> None:
    robot, goal = links(1.0, 1.0, 0.4), (0.9, 0.3)
    inside = rest_curves(robot, goal, "j1").sink_intervals() & joint_ranges(robot, goal)["j1"]
    assert inside.size > 0.01
    low, high = max(inside.intervals, key=lambda pair: pair[1] - pair[0])
    rests = rest_configurations(robot, goal, "j1", 0.5 * (low + high))
    assert any(rest.kind is RestKind.SINK for rest in rests)


def test_sliding_joint_has_sinks_up_to_where_the_goal_comes_within_reach() -> None:
    robot, goal = telescope(), (1.0, 0.4)
    curves = rest_curves(robot, goal, "slide")
    ranges = joint_ranges(robot, goal)["slide"]
    reach = np.hypot(*goal) - 0.5
    assert ranges.intervals[0] == pytest.approx((reach, 1.5), abs=1e-9)
    assert curves.sink_intervals().intervals[0] == pytest.approx((0.2, reach), abs=1e-6)
    assert not curves.sink_intervals().circular


def test_values_of_a_joint_with_limits_stay_within_them() -> None:
    robot = catalog.load("planar", lengths=(1, 1, 1)).with_limits(q_min=-2.8, q_max=2.8)
    free = rest_curves(links(1, 1, 1), (1.5, 1.5), "j1").sink_intervals()
    found = rest_curves(robot, (1.5, 1.5), "j1").sink_intervals()
    assert found.intervals
    for low, high in found.intervals:
        assert -2.8 <= low < high <= 2.8
        assert free.contains(np.linspace(low + 1e-6, high - 1e-6, 9)).all()


@pytest.mark.slow
def test_sinks_of_a_panda_end_where_rests_leave_its_limits() -> None:
    robot = catalog.load("panda")
    goal = robot.pose(robot.neutral)
    curves = rest_curves(robot, goal, "panda_joint2", rows="pose")
    sinks = curves.sink_intervals()
    assert sinks.intervals
    i = robot.joint("panda_joint2")
    assert all(
        low >= robot.limits.q_min[i] and high <= robot.limits.q_max[i] for low, high in sinks.intervals
    )
    middle = [0.5 * (low + high) for low, high in sinks.intervals]
    for value in middle:
        rests = rest_configurations(robot, goal, "panda_joint2", value, rows="pose")
        assert any(rest.kind is RestKind.SINK for rest in rests)


def test_crossings_of_curves_are_flagged() -> None:
    curves = rest_curves(links(1, 1, 1), (1.5, 1.5), "j2")
    main, circle = sorted(curves, key=lambda curve: np.ptp(curve.q[:, 1]), reverse=True)
    shared = [
        q
        for q in main.branches
        if np.linalg.norm((circle.q - q + np.pi) % (2.0 * np.pi) - np.pi, axis=1).min() < 0.05
    ]
    assert len(shared) >= 4
    assert not any(len(curve.branches) for curve in rest_curves(links(1, 1, 1), (1.5, 1.5), "j1"))
