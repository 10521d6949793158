"""Self-motions of an arm, and the ranges of its joints on them."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import minimize
from tests.analysis.planar_arms import closed_form_ends, links, telescope

from ftqp.analysis.goals import goal_study
from ftqp.analysis.manifolds.joint_ranges import joint_ranges, reachable_after
from ftqp.analysis.manifolds.manifold import self_motion
from ftqp.core.errors import InputError
from ftqp.model import catalog


def components(lengths, R):
    """How many self-motions three links have: arcs of the last link's angle that the first two reach."""
    l1, l2, l3 = lengths
    psi = np.linspace(0.0, 2.0 * np.pi, 100_001)[:-1]
    wrist = np.hypot(R - l3 * np.cos(psi), l3 * np.sin(psi))
    inside = (wrist >= abs(l1 - l2)) & (wrist <= l1 + l2)
    return 2 if inside.all() else int((inside & ~np.roll(inside, 1)).sum())


@pytest.mark.parametrize("lengths", [(1.0, 1.0, 1.0), (1.0, 0.6, 0.4), (0.5, 1.0, 0.9)])
def test_three_links_have_as_many_self_motions_as_the_closed_form_says(lengths):
    for R in np.linspace(0.13, sum(lengths) - 0.07, 9):
        assert len(self_motion(links(*lengths), (R, 0.0))) == components(lengths, R)


def test_points_of_a_panda_keep_pose_and_limits():
    robot = catalog.load("panda")
    goal = robot.pose(robot.neutral + 0.2)
    found = self_motion(robot, goal)
    assert found
    limits = robot.limits
    for manifold in found:
        assert not manifold.closed
        assert not manifold.singular
        assert max(np.abs(robot.pose(q) - goal).max() for q in manifold.q) < 1e-11
        assert ((manifold.q >= limits.q_min) & (manifold.q <= limits.q_max)).all()
        for q in (manifold.q[0], manifold.q[-1]):
            assert min(np.abs(q - limits.q_min).min(), np.abs(limits.q_max - q).min()) < 1e-9
    away = [np.linalg.norm(m.q - (robot.neutral + 0.2), axis=1).min() for m in found]
    assert min(away) < 0.05  # the configuration that made the goal is on one of them


def test_every_solution_within_limits_is_on_a_self_motion():
    robot = catalog.load("panda")
    goal = robot.pose(robot.neutral + 0.2)
    found = np.vstack([manifold.q for manifold in self_motion(robot, goal)])
    study = goal_study(robot, goal, "pose")
    rng = np.random.default_rng(11)
    q, left, _ = study.limited.solutions(
        rng.uniform(robot.limits.q_min, robot.limits.q_max, (300, 7)), bounded=True
    )
    solutions = q[left < 1e-11]
    assert len(solutions) > 30
    for solution in solutions:
        assert np.linalg.norm(found - solution, axis=1).min() < 0.06


def test_spread_points_are_equally_far_apart():
    (manifold,) = self_motion(links(1, 1, 1), (1.5, 1.5))
    q = manifold.spread(300)
    gaps = np.linalg.norm(np.diff(np.vstack([q, q[:1]]), axis=0), axis=1)
    assert gaps == pytest.approx(manifold.length / 300, rel=1e-3)


def test_samples_of_two_joints_to_spare_claim_no_components():
    robot = links(1, 1, 1, 1)
    (manifold,) = self_motion(robot, (1.5, 1.5))
    assert not manifold.connected
    assert manifold.dimension == 2
    assert len(manifold.q) > 100
    assert manifold.ranges() == joint_ranges(robot, (1.5, 1.5))
    assert max(np.abs(robot.pose(q)[:2, 3] - 1.5).max() for q in manifold.q) < 1e-11


def test_goal_out_of_reach_is_refused():
    with pytest.raises(InputError, match=r"is not reached by planar\(1, 1, 1\) \(nearest: 0\.50"):
        self_motion(links(1, 1, 1), (3.5, 0.0))
    with pytest.raises(InputError, match="only outside its joint limits"):
        self_motion(catalog.load("planar", lengths=(1, 1, 1)).with_limits(q_max=0.1, q_min=-0.1), (0.5, 0.0))
    with pytest.raises(InputError, match="at the edge of the workspace"):
        self_motion(links(1, 1, 1), (3.0, 0.0))


def test_arm_without_a_joint_to_spare_is_refused():
    with pytest.raises(InputError, match="has no self-motion"):
        self_motion(links(1, 1), (1.0, 1.0))


def test_piece_within_limits_that_is_shorter_than_a_step_is_found():
    highest = joint_ranges(links(1, 1, 1), (1.5, 1.5))["j1"].intervals[0][1]
    low = np.array([highest - 1e-5, -2.9, -2.9])
    robot = catalog.load("planar", lengths=(1, 1, 1)).with_limits(q_min=low, q_max=2.9)
    (manifold,) = self_motion(robot, (1.5, 1.5))
    assert 1e-3 < manifold.length < 0.03
    assert manifold.q[[0, -1], 0] == pytest.approx([low[0]] * 2, abs=1e-10)
    assert manifold.ranges()["j1"].intervals[0] == pytest.approx((low[0], highest), abs=1e-9)


def test_joint_with_a_range_of_two_turns_has_every_copy_of_a_piece():
    one = catalog.load("planar", lengths=(1, 1, 1)).with_limits(
        q_min=[-np.pi, -2.5, -2.5], q_max=[np.pi, 2.5, 2.5]
    )
    two = one.with_limits(q_min=[-np.pi, -2.5, -2.5], q_max=[3.0 * np.pi, 2.5, 2.5])
    single, double = self_motion(one, (1.5, 1.5)), self_motion(two, (1.5, 1.5))
    assert len(single) == 1
    assert single[0].closed
    assert len(double) == 2
    first = sorted(float(manifold.q[:, 0].mean()) for manifold in double)
    assert first[1] - first[0] == pytest.approx(2.0 * np.pi, abs=0.05)


@pytest.mark.parametrize("lengths", [(1.0, 1.0, 1.0), (1.0, 1.0, 0.5), (0.4, 0.9, 1.2)])
@pytest.mark.parametrize("x", [(0.7, 0.2), (-1.2, 0.8), (0.1, -1.9)])
def test_ends_of_three_links_are_those_of_the_closed_form(lengths, x):
    found = joint_ranges(links(*lengths), x)
    for B, ends in zip(found.values(), closed_form_ends(lengths, x), strict=True):
        edges = [edge for pair in B.intervals for edge in pair if not B.whole]
        for edge in edges:
            assert min(abs((edge - end + np.pi) % (2.0 * np.pi) - np.pi) for end in ends) < 1e-9
        if not ends:
            assert B.whole


def farthest(robot, goal, rows, i, way, starts):
    """The largest way * q_i of the arm at the goal by SQP with pinocchio's kinematics, from many starts."""
    data, tip = robot.model.createData(), robot.model.getFrameId(robot.tip)

    def error(q):
        pin.framesForwardKinematics(robot.model, data, q)
        pose = data.oMf[tip]
        turn = pin.log3(goal[:3, :3] @ pose.rotation.T)
        return np.asarray(np.concatenate([goal[:3, 3] - pose.translation, turn])[:rows])

    slope = -way * np.eye(robot.nv)[i]
    best = -np.inf
    for start in starts:
        answer = minimize(
            lambda q: float(slope @ q),
            start,
            jac=lambda q: slope,
            bounds=list(zip(robot.limits.q_min, robot.limits.q_max, strict=True)),
            constraints={"type": "eq", "fun": error},
            method="SLSQP",
            options={"maxiter": 200, "ftol": 1e-13},
        )
        if np.abs(error(answer.x)).max() < 1e-8:
            best = max(best, way * float(answer.x[i]))
    return best


@pytest.mark.slow
@pytest.mark.parametrize(("name", "rows"), [("panda", "pose"), ("panda", "position"), ("iiwa14", "position")])
def test_ends_of_seven_joints_are_those_of_sqp(name, rows):
    robot = catalog.load(name)
    goal = robot.pose(robot.neutral + 0.2)
    found = joint_ranges(robot, goal, rows)
    rng = np.random.default_rng(2)
    starts = rng.uniform(robot.limits.q_min, robot.limits.q_max, (25, 7))
    for i in (1, 3):
        B = found[robot.joints[i]]
        high = farthest(robot, goal, 6 if rows == "pose" else 3, i, 1.0, starts)
        low = -farthest(robot, goal, 6 if rows == "pose" else 3, i, -1.0, starts)
        assert high == pytest.approx(B.intervals[-1][1], abs=np.deg2rad(0.002))
        assert low == pytest.approx(B.intervals[0][0], abs=np.deg2rad(0.002))


def test_sliding_joint_goes_from_its_reach_to_its_limit():
    found = joint_ranges(telescope(), (1.0, 0.4))
    reach = np.hypot(1.0, 0.4)
    assert found["slide"].intervals[0] == pytest.approx((reach - 0.5, 1.5), abs=1e-9)
    assert not found["slide"].circular
    side = np.arccos((reach**2 + 1.5**2 - 0.25) / (3.0 * reach))
    widest = max(side, np.arcsin(0.5 / reach))
    half = 0.5 * np.ptp(found["turn"].intervals[0])
    assert half == pytest.approx(widest, abs=1e-9)


def test_range_of_a_joint_of_four_links_is_that_of_its_closed_form():
    x = (3.5, 1.0)
    found = joint_ranges(links(1, 1, 1, 1), x)
    R = np.hypot(*x)
    half = np.arccos((1.0 + R * R - 9.0) / (2.0 * R))
    (low, high), *_ = found["j1"].intervals
    assert (low, high) == pytest.approx(np.arctan2(1.0, 3.5) + np.array([-half, half]), abs=1e-9)
    bend = np.arccos(((R - 2.0) ** 2 - 2.0) / 2.0)
    for joint in ("j2", "j3", "j4"):
        assert found[joint].intervals[0] == pytest.approx((-bend, bend), abs=1e-9)


@pytest.mark.parametrize(("name", "rows"), [("panda", "position"), ("panda", "pose"), ("xarm7", "pose")])
def test_every_solution_within_limits_has_its_joints_in_their_ranges(name, rows):
    robot = catalog.load(name)
    rng = np.random.default_rng(8)
    low, high = robot.limits.q_min, robot.limits.q_max
    goal = robot.pose(rng.uniform(low, high))
    found = joint_ranges(robot, goal, rows)
    q, left, _ = goal_study(robot, goal, rows).limited.solutions(
        rng.uniform(low, high, (400, 7)), bounded=True
    )
    solutions = q[left < 1e-11]
    assert len(solutions) > 40
    for B, values, least, most in zip(found.values(), solutions.T, low, high, strict=True):
        assert B.contains(values, 1e-7).all()
        assert not B.circular
        assert B.intervals[0][0] >= least - 1e-9
        assert B.intervals[-1][1] <= most + 1e-9


@pytest.mark.slow
def test_gap_between_intervals_of_a_scan_is_out_of_reach():
    robot = catalog.load("panda")
    rng = np.random.default_rng(8)
    goal = robot.pose(rng.uniform(robot.limits.q_min, robot.limits.q_max))
    B = joint_ranges(robot, goal)["panda_joint3"]
    assert len(B.intervals) == 3
    (_, end), (begin, _), _ = B.intervals
    for value in (end + 1e-4, begin - 1e-4):
        assert not reachable_after(robot, goal, {"panda_joint3": value})
    for value in (end - 1e-4, begin + 1e-4):
        assert reachable_after(robot, goal, {"panda_joint3": value})


def test_goal_is_within_reach_just_where_the_locked_value_is_in_its_range():
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


def test_elbow_that_may_lock_at_two_values_only_is_told_by_its_range():
    robot = catalog.load("iiwa14")
    goal = robot.pose(robot.neutral + 0.2)
    value = float(joint_ranges(robot, goal, "pose")["iiwa_joint_4"].intervals[0][0])
    assert reachable_after(robot, goal, {"iiwa_joint_4": value + 5e-10}, rows="pose")
    assert not reachable_after(robot, goal, {"iiwa_joint_4": value + 1e-6}, rows="pose")


def test_several_locks_are_looked_at_together():
    robot = links(1, 1, 1, 1)
    q = np.array([0.3, 0.5, -0.4, 0.9])
    goal = robot.pose(q)[:2, 3]
    assert reachable_after(robot, goal, {"j1": 0.3, "j3": -0.4})
    assert not reachable_after(robot, goal, {"j1": 0.3 + np.pi, "j3": -0.4})
    assert reachable_after(robot, goal, {0: 0.3, 1: 0.5, 2: -0.5}) is False  # one joint left of two needed
