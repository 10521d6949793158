"""What the loss of a joint costs at a posture, which poses stay, and unions of intervals on a circle."""

from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.analysis.planar_arms import UNIT, links

import ftqp
from ftqp.analysis import reachable_after, tolerant_workspace
from ftqp.analysis.circular_intervals import TURN, CircularIntervals
from ftqp.analysis.survival.continuing import track
from ftqp.analysis.survival.task_path import task_path
from ftqp.analysis.tolerance import (
    minors,
    null_vector,
    relative_manipulability,
    structural_joints,
    velocity_jump,
)
from ftqp.control.paths import Line
from ftqp.core.errors import InputError
from ftqp.model import catalog

DRAWN = np.random.default_rng(7).normal(size=(1000, 6, 7))


def test_null_vector_times_manipulability_is_the_minors() -> None:
    n, Z = null_vector(DRAWN), minors(DRAWN)
    w = np.sqrt(np.linalg.det(DRAWN @ np.swapaxes(DRAWN, 1, 2)))
    assert (np.linalg.norm(w[:, None] * n - Z, axis=1) < 1e-9 * np.linalg.norm(Z, axis=1)).all()
    assert np.abs(np.einsum("kmn,kn->km", DRAWN, n)).max() < 1e-12


def test_null_vector_keeps_its_sign_along_a_path_and_under_units_of_rows() -> None:
    panda = catalog.load("panda")
    q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    task = task_path(panda, Line(panda.pose(q0), (0.0, 0.3, 0.1), duration=4.0), dt=0.02)
    J = np.stack([panda.jacobian(one) for one in track(task, q0, 0.5)])
    n = null_vector(J)
    assert (np.einsum("ki,ki->k", n[1:], n[:-1]) > 0.99).all()
    scaled = J * np.array([1000.0, 1000.0, 1000.0, 57.3, 57.3, 57.3])[:, None]
    assert np.allclose(null_vector(scaled), n, atol=1e-9)


def test_planar_minors_are_those_of_the_formula() -> None:
    arm = catalog.load("planar", lengths=(1.0, 1.0, 1.0))
    q = np.array([0.3, 0.7, -1.1])
    (s2, s3), s23 = np.sin(q[1:]), np.sin(q[1] + q[2])
    wanted = np.array([s3, -(s3 + s23), s2 + s23])
    assert np.allclose(minors(arm.jacobian(q)[:2]), wanted)


RANDOM = np.random.default_rng(3).normal(size=(300, 6, 7))


def manipulability(J):
    return np.sqrt(np.linalg.det(J @ np.swapaxes(J, -1, -2)))


def test_relative_manipulability_is_the_ratio_of_both() -> None:
    share = relative_manipulability(RANDOM)
    for j in range(7):
        without = manipulability(np.delete(RANDOM, j, axis=2))
        assert np.allclose(share[:, j], without / manipulability(RANDOM))
    assert np.allclose(share, np.abs(null_vector(RANDOM)))
    wide = RANDOM[:, :4]
    pairs = [(0, 1), (2, 5), (1, 3, 6)]
    for share, failed in zip(relative_manipulability(wide, pairs).T, pairs, strict=True):
        assert np.allclose(share, manipulability(np.delete(wide, failed, axis=2)) / manipulability(wide))
    assert (relative_manipulability(RANDOM, [(0, 1)]) == 0.0).all()


def test_jump_stops_the_joint_and_keeps_the_task() -> None:
    rng = np.random.default_rng(5)
    for J in (*RANDOM[:20], *RANDOM[:20, :4]):
        v, j = rng.normal(size=7), int(rng.integers(7))
        jump = velocity_jump(J, v, j)
        assert abs(v[j] + jump[j]) < 1e-9 and np.abs(J @ jump).max() < 1e-9
        assert np.isclose(np.linalg.norm(jump), abs(v[j]) / relative_manipulability(J)[j], rtol=1e-8)
        if len(J) == 6:
            assert np.allclose(jump, -v[j] / null_vector(J)[j] * null_vector(J), atol=1e-8)


def test_joint_that_is_needed_has_no_jump_unless_it_stands() -> None:
    J = np.eye(3, 4)
    assert np.isinf(velocity_jump(J, (1.0, 0.0, 0.0, 0.0), 0)).all()
    assert (velocity_jump(J, (0.0, 1.0, 0.0, 0.0), 0) == 0.0).all()


def test_elbow_between_spherical_wrists_is_structural_with_a_pose_only() -> None:
    for name in ("iiwa14", "srs7"):
        arm = catalog.load(name)
        assert structural_joints(arm) == (arm.joints[3],)
        assert structural_joints(arm, "position") == ()
    assert structural_joints(catalog.load("panda")) == structural_joints(catalog.load("zhang7")) == ()


def test_every_joint_counts_where_there_are_as_many_as_rows() -> None:
    puma = catalog.load("puma560")
    assert structural_joints(puma) == puma.joints


@pytest.mark.parametrize("name", ["panda", "iiwa14", "xarm7"])
def test_energy_is_the_potential_energy_lost_on_the_way_to_the_stop(name):
    robot = ftqp.robots.load(name)
    q = robot.neutral + np.linspace(0.1, 0.4, 7)
    data = robot.model.createData()
    fell = 0
    for i, energy in enumerate(ftqp.analysis.fall_energy(robot, q).values()):
        ends = []
        for stop in (robot.limits.q_min[i], robot.limits.q_max[i]):
            way = np.linspace(q[i], stop, 400)
            lost = []
            for angle in way:
                moved = q.copy()
                moved[i] = angle
                lost.append(pin.computePotentialEnergy(robot.model, data, moved))
            gained = lost[0] - np.array(lost[1:])
            ends.append(gained[-1] if (gained > 0.0).all() else 0.0)
        assert energy == pytest.approx(max(ends), abs=0.02 * max(1.0, max(ends)))
        fell += energy > 1.0
    assert fell >= 1


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


ANGLE = st.floats(-10.0, 10.0)
PAIRS = st.lists(st.tuples(ANGLE, st.floats(0.0, 4.0)), max_size=5)


def union(pairs: list[tuple[float, float]]) -> CircularIntervals:
    return CircularIntervals.of([(low, low + width) for low, width in pairs])


def truly(pairs: list[tuple[float, float]], a: float, slack: float) -> bool:
    return any(low - slack <= a + k * TURN <= low + w + slack for low, w in pairs for k in range(-4, 5))


@given(PAIRS, ANGLE)
def test_value_belongs_to_the_union_if_it_belongs_to_one_of_the_intervals(
    pairs: list[tuple[float, float]], a: float
) -> None:
    found = union(pairs)
    if truly(pairs, a, -1e-6):
        assert found.contains(a)
    if not truly(pairs, a, 1e-6):
        assert not found.contains(a)
    assert (found.margin(a) >= 0.0) == found.contains(a)


@given(PAIRS)
def test_intervals_are_apart_and_begin_within_one_turn(pairs: list[tuple[float, float]]) -> None:
    found = union(pairs).intervals
    assert all(-np.pi <= low <= np.pi and low <= high <= low + TURN for low, high in found)
    assert all(a[1] < b[0] for a, b in pairwise(found))
    if len(found) > 1:
        assert found[-1][1] < found[0][0] + TURN


@given(PAIRS, PAIRS, ANGLE)
def test_union_and_intersection_are_those_of_sets(
    one: list[tuple[float, float]], two: list[tuple[float, float]], a: float
) -> None:
    A, B = union(one), union(two)
    if min(abs(A.margin(a)), abs(B.margin(a))) > 1e-6:
        assert (A | B).contains(a) == (A.contains(a) or B.contains(a))
        assert (A & B).contains(a) == (A.contains(a) and B.contains(a))


def test_margin_is_the_distance_to_the_nearest_end_across_the_seam() -> None:
    found = CircularIntervals.of([(3.0, 3.5)])
    assert found.margin(3.1) == pytest.approx(0.1)
    assert found.margin(3.4 - TURN) == pytest.approx(0.1)
    assert found.margin(np.array([2.0, 4.0])) == pytest.approx([-1.0, -0.5])
    assert 3.2 - TURN in found


def test_points_are_structural() -> None:
    assert CircularIntervals.of([(1.0, 1.0), (-1.0, -1.0)]).structural
    assert not CircularIntervals.of([(1.0, 1.1)]).structural
    assert not CircularIntervals.of([]).structural
