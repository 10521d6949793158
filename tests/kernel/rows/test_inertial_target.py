"""Formulas of the moving base, each against homogeneous transforms in plain numpy."""

import numpy as np
import pytest
from records import chain_record
from scipy.spatial.transform import Rotation

import ftqp
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.entry.session import Memory
from ftqp.kernel.layout import enums
from ftqp.kernel.rows.inertial_target import (
    follow_base,
)

DT = 0.01


def pose(generator, turn=1.0):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(turn * generator.standard_normal(3)).as_matrix()
    T[:3, 3] = generator.standard_normal(3)
    return T


class Follower:
    """An arm's record and that of the base under it, with the arm's true tip pose."""

    def __init__(self, **fields):
        self.robot = ftqp.robots.load("panda")
        self.K = chain_record(self.robot)
        self.K.state.dt, self.K.task.length = DT, 0.2
        self.base = Memory("base").fields
        self.base.nominal[:] = np.eye(3).ravel()
        self.base.patience = 0.05
        for name, value in fields.items():
            setattr(self.base, name, value)

    def tick(self, q, target, *, tip=None, base=None, twist=None):
        """One tick; (valid, target as it came out: pose (4, 4) and twist (6,))."""
        K = self.K
        K.state.q[: self.robot.nv] = q
        forward_kinematics(K, K.state)
        has = 0
        for room, value, bit in (
            (self.base.tip_world, tip, enums.HAS_TIP),
            (self.base.given, base, enums.HAS_BASE),
            (self.base.rate, twist, enums.HAS_TWIST),
        ):
            if value is not None:
                room[:] = value
                has |= bit
        self.base.has = has
        K.task.target[:] = target.packed
        valid = bool(follow_base(K, self.base))
        return valid, K.task.target[:16].reshape(4, 4).copy(), K.task.target[16:22].copy()


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def test_target_in_the_base_is_the_inertial_one_seen_from_the_estimate(rng):
    follower = Follower()
    q, base, goal = follower.robot.neutral, pose(rng), pose(rng)
    twist = rng.standard_normal(6)
    valid, seen, seen_twist = follower.tick(
        q, ftqp.Target(pose=goal, twist=twist), tip=base @ follower.robot.pose(q)
    )
    assert valid
    np.testing.assert_allclose(seen, np.linalg.inv(base) @ goal, atol=1e-13)
    np.testing.assert_allclose(seen_twist[:3], base[:3, :3].T @ twist[:3], atol=1e-13)
    np.testing.assert_allclose(seen_twist[3:], base[:3, :3].T @ twist[3:], atol=1e-13)
    np.testing.assert_allclose(follower.base.pose[:3], base[:3], atol=1e-13)


def test_known_twist_of_the_base_is_taken_to_the_tip(rng):
    follower = Follower()
    q, base, V = follower.robot.neutral, pose(rng), rng.standard_normal(6)
    tip = base @ follower.robot.pose(q)
    _, _, seen = follower.tick(q, ftqp.Target(pose=tip), base=base, twist=V)
    at_tip = [*(V[:3] + np.cross(V[3:], tip[:3, 3] - base[:3, 3])), *V[3:]]
    np.testing.assert_allclose(follower.base.twist, at_tip, atol=1e-13)
    expected = -np.concatenate([base[:3, :3].T @ at_tip[:3], base[:3, :3].T @ at_tip[3:]])
    np.testing.assert_allclose(seen, expected, atol=1e-12)


@pytest.mark.parametrize("lowpass", [1.0, 0.25])
def test_observer_sees_the_displacement_of_the_tip_by_the_base_alone(rng, lowpass):
    follower = Follower(observer=lowpass)
    robot, q = follower.robot, follower.robot.neutral
    bases = [pose(rng)]
    bases.append(bases[0] @ np.linalg.inv(pose(rng, 0.1)) @ pose(rng, 0.1))
    q2 = q + 0.3  # the arm moves as well: that is not the base's doing
    goal = ftqp.Target(pose=np.eye(4))
    follower.tick(q, goal, tip=bases[0] @ robot.pose(q))
    follower.tick(q2, goal, tip=bases[1] @ robot.pose(q2))
    before, after = bases[0] @ robot.pose(q2), bases[1] @ robot.pose(q2)
    turn = Rotation.from_matrix(after[:3, :3] @ before[:3, :3].T).as_rotvec()
    expected = lowpass * np.array([*(after[:3, 3] - before[:3, 3]), *turn])
    np.testing.assert_allclose(follower.base.shift, expected, atol=1e-12)
    np.testing.assert_allclose(follower.base.twist, expected / DT, atol=1e-9)


def test_late_tip_belongs_to_the_arm_pose_of_that_time(rng):
    """A base at rest, an arm that moves: the estimate is exact however late the tip is measured."""
    late, base = 3, pose(rng)
    follower = Follower(delay=late)
    robot, goal = follower.robot, ftqp.Target(pose=np.eye(4))
    way = [robot.neutral + 0.02 * k for k in range(10)]
    for k, q in enumerate(way):
        follower.tick(q, goal, tip=base @ robot.pose(way[max(0, k - late)]))
        np.testing.assert_allclose(follower.base.pose[:3], base[:3], atol=1e-12)


def test_late_twist_is_extrapolated_over_the_delay():
    """A base that accelerates steadily, measured 5 samples late: pose and coming twist are exact."""
    late, a = 5, np.array([0.4, -0.2, 0.3])
    follower = Follower(delay=late)
    q, goal = follower.robot.neutral, ftqp.Target(pose=np.eye(4))

    def base(k):
        T = np.eye(4)
        T[:3, 3] = 0.5 * a * (k * DT) ** 2
        return T

    for k in range(late, 30):
        then = k - late
        mean = a * (then + 0.5) * DT
        follower.tick(q, goal, base=base(then), twist=[*mean, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(follower.base.pose[:3, 3], base(29)[:3, 3], atol=1e-14)
    np.testing.assert_allclose(follower.base.twist[:3], a * 29.5 * DT, atol=1e-13)
