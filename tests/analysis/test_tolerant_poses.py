"""Poses that stay within reach whichever joint locks, against closed forms and another way of solving."""

import numpy as np
import pytest
from tests.analysis.planar_arms import UNIT, links

import ftqp
from ftqp.analysis import reachable_after, tolerant_workspace
from ftqp.core.errors import InputError

BENT = [(0.2, 0.9), (0.8, 1.6), (0.8, 1.6)]
BOTH_SIDES = [(-0.317, 0.317), (-1.943, 1.943), (-1.943, 1.943)]
ONE_SIDE = [(-0.2, 0.2), (0.9, 1.5), (-1.4, 1.0)]


def within_reach(lengths, joint, value, z):
    """Whether the other two links bring the tip of a planar arm to points z with a joint locked."""
    a, b, c = lengths
    if joint == 0:
        far, near, z = b + c, abs(b - c), z - a * np.exp(1j * value)
    else:
        stiff, left = (
            (abs(a + b * np.exp(1j * value)), c) if joint == 1 else (abs(b + c * np.exp(1j * value)), a)
        )
        far, near = stiff + left, abs(stiff - left)
    return (np.abs(z) <= far) & (np.abs(z) >= near)


def tolerates(lengths, limits, z, values=201):
    """Whether points stay within reach at so many values of each joint, (k, 3)."""
    found = np.ones((len(z), 3), bool)
    for joint, (low, high) in enumerate(limits):
        for value in np.linspace(low, high, values):
            found[:, joint] &= within_reach(lengths, joint, value, z)
    return found


def reached(lengths, limits, z, values=401):
    """Whether points are reached within the limits: joint 1 at many values, two links in closed form."""
    (a, b, c), found = lengths, np.zeros(len(z), bool)

    def inside(angle, ends):
        middle, half = 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])
        return np.abs(np.angle(np.exp(1j * (angle - middle)))) <= half

    for value in np.linspace(*limits[0], values):
        w = z * np.exp(-1j * value) - a
        cosine = (np.abs(w) ** 2 - b * b - c * c) / (2.0 * b * c)
        for third in (np.arccos(np.clip(cosine, -1, 1)), -np.arccos(np.clip(cosine, -1, 1))):
            second = np.angle(w / (b + c * np.exp(1j * third)))
            found |= (np.abs(cosine) <= 1.0) & inside(second, limits[1]) & inside(third, limits[2])
    return found


@pytest.mark.parametrize(
    ("lengths", "limits"),
    [((1, 1, 1), BENT), ((1, 1, 1), BOTH_SIDES), ((1.2, 0.9, 0.8), ONE_SIDE)],
)
def test_area_of_a_planar_arm_is_that_of_points_in_closed_form(lengths, limits):
    report = tolerant_workspace(links(*lengths), limits, poses=1)
    random, whole = np.random.default_rng(4), sum(lengths)
    z = random.uniform(-whole, whole, (8000, 2)) @ np.array([1.0, 1.0j])
    before = reached(lengths, limits, z)
    tolerant = before & tolerates(lengths, limits, z).all(axis=1)
    for area, counted in ((report.area, tolerant), (report.reach, before)):
        share = counted.mean()
        error = 4 * whole**2 * np.sqrt(share * (1.0 - share) / len(z))
        assert error < area and abs(area - 4 * whole**2 * share) < 3.0 * error


def test_elbows_that_may_bend_both_ways_leave_more_to_unit_links_than_those_that_may_not():
    assert tolerant_workspace(UNIT, BENT, poses=1).area < 1.3
    assert 3.55 < tolerant_workspace(UNIT, BOTH_SIDES, poses=1).area < 3.57


@pytest.mark.parametrize("limits", [BENT, BOTH_SIDES])
def test_poses_are_kept_where_closed_forms_say_so_at_every_value(limits):
    report = tolerant_workspace(UNIT, limits, poses=40, seed=2)
    z = report.poses[:, 0, 3] + 1j * report.poses[:, 1, 3]
    expected = tolerates((1, 1, 1), limits, z, values=2001)
    assert (report.kept == expected).all() and 0 < expected.sum() < expected.size
    assert report.share == expected.all(axis=1).mean()
    low, high = report.interval
    assert low < report.share < high


def test_a_panda_in_a_narrow_range_keeps_poses_that_another_way_of_solving_reaches():
    panda = ftqp.robots.load("panda")
    limits = panda.neutral[:, None] + np.array([-0.08, 0.08])
    report = tolerant_workspace(panda, limits, "pose", poses=6)
    random, asked = np.random.default_rng(0), 0
    for pose, kept in zip(report.poses, report.kept, strict=True):
        for joint in np.flatnonzero(kept):
            value = random.uniform(*limits[joint])
            assert reachable_after(panda, pose, {joint: value}, "pose")
            asked += 1
    assert asked > 10 and report.by_joint["panda_joint4"] < 0.2 < report.by_joint["panda_joint1"]
    assert np.isnan(report.area)


def test_without_artificial_limits_any_lock_of_a_whole_range_loses_poses():
    assert tolerant_workspace(UNIT, poses=20).share == 0.0


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ([(0, 1)], r"shape \(1, 2\), expected \(nv, 2\) = \(3, 2\)"),
        ([(0, 1), (1, 0), (0, 1)], "'j2' are 1 and 0, expected low <= high"),
        ([(0, 1), (0, float("nan")), (0, 1)], "'j2' are 0 and nan"),
        ("narrow", "expected low and high of each joint"),
    ],
)
def test_limits_that_make_no_sense_are_refused(limits, said):
    with pytest.raises(InputError, match=said):
        tolerant_workspace(UNIT, limits)


def test_limits_beyond_the_arms_own_and_arms_without_a_joint_to_spare_are_refused():
    panda = ftqp.robots.load("panda")
    with pytest.raises(InputError, match="panda_joint1"):
        tolerant_workspace(panda, np.tile([-3.0, 3.0], (7, 1)), "pose")
    with pytest.raises(InputError, match="no lock is survived"):
        tolerant_workspace(links(1, 1), rows="position")
