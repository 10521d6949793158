"""What is within reach after joints have locked."""

import numpy as np
import pytest
from planar_arms import links

from ftqp.analysis.manifolds.joint_ranges import joint_ranges, reachable_after
from ftqp.core.errors import InputError
from ftqp.model import catalog


def test_goal_is_within_reach_just_where_the_locked_value_is_in_its_range() -> None:
    robot = links(1, 1, 0.5)
    x = (-0.8, 0.3)
    ranges = joint_ranges(robot, x)
    for joint, B in ranges.items():
        for a in np.linspace(-3.0, 3.0, 13):
            assert reachable_after(robot, x, {joint: a}) is B.contains(a)
        for low, high in B.intervals if not B.whole else ():
            assert reachable_after(robot, x, {joint: low})
            assert reachable_after(robot, x, {joint: high})
            assert not reachable_after(robot, x, {joint: low - 1e-6})
            assert not reachable_after(robot, x, {joint: high + 1e-6})


def test_elbow_that_may_lock_at_two_values_only_is_told_by_its_range() -> None:
    robot = catalog.load("iiwa14")
    goal = robot.pose(robot.neutral + 0.2)
    value = float(joint_ranges(robot, goal, "pose")["iiwa_joint_4"].intervals[0][0])
    assert reachable_after(robot, goal, {"iiwa_joint_4": value + 5e-10}, rows="pose")
    assert not reachable_after(robot, goal, {"iiwa_joint_4": value + 1e-6}, rows="pose")


def test_several_locks_are_looked_at_together() -> None:
    robot = links(1, 1, 1, 1)
    q = np.array([0.3, 0.5, -0.4, 0.9])
    goal = robot.pose(q)[:2, 3]
    assert reachable_after(robot, goal, {"j1": 0.3, "j3": -0.4})
    assert not reachable_after(robot, goal, {"j1": 0.3 + np.pi, "j3": -0.4})
    assert reachable_after(robot, goal, {0: 0.3, 1: 0.5, 2: -0.5}) is False  # one joint left of two needed


def test_goal_outside_the_workspace_is_within_reach_of_nothing() -> None:
    assert reachable_after(links(1, 1, 1), (3.5, 0.0), {"j1": 0.0}) is False


@pytest.mark.parametrize(
    ("locked", "sentence"),
    [
        ({"j9": 0.0}, "is not a joint"),
        ({"j1": np.nan}, "expected a finite position"),
        ({"j1": 0.0, 0: 0.0}, "twice"),
        ({}, "expected 1 to 2 of 3"),
        ({"j1": 0.0, "j2": 0.0, "j3": 0.0}, "expected 1 to 2 of 3"),
    ],
)
def test_silly_locks_are_refused(locked: dict[str | int, float], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        reachable_after(links(1, 1, 1), (1.0, 1.0), locked)
