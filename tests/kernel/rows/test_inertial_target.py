"""Formulas of the moving base, each against homogeneous transforms in plain numpy."""

import numpy as np
import pytest
from records import address, chain_record, on_record
from scipy.spatial.transform import Rotation

import ftqp
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.rows.inertial_target import (
    base_from_tip,
    exponential,
    follow_base,
    is_rank_deficient,
    reduce_by_lead,
)

observe_tick = on_record(follow_base)
kinematics_tick = on_record(forward_kinematics)
lead_tick = on_record(reduce_by_lead)
DT = 0.01


def pose(generator, turn=1.0):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(turn * generator.standard_normal(3)).as_matrix()
    T[:3, 3] = generator.standard_normal(3)
    return T


class Follower:
    """A record with a moving base, and the arm's true tip pose."""

    def __init__(self, **fields):
        self.robot = ftqp.robots.load("panda")
        self.W = chain_record(self.robot)
        K = self.W
        K["dt"], K["base_moves"], K["length"] = DT, 1, 0.2
        K["base_nominal"] = np.eye(3).ravel()
        K["base_patience"] = 0.05
        for name, value in fields.items():
            K[name] = value

    def tick(self, q, target, *, tip=None, base=None, twist=None):
        """One tick; (valid, target as it came out: pose (4, 4) and twist (6,))."""
        K, n = self.W, self.robot.nv
        K["q"][0, :n] = q
        kinematics_tick(address(K))
        has = 0
        for name, value, bit in (
            ("tip_world", tip, codes.HAS_TIP),
            ("base_given", base, codes.HAS_BASE),
            ("base_rate", twist, codes.HAS_TWIST),
        ):
            if value is not None:
                K[name][0] = value
                has |= bit
        K["base_has"] = has
        K["target"][0] = target.packed
        valid = bool(observe_tick(address(K)))
        return valid, K["target"][0, :16].reshape(4, 4).copy(), K["target"][0, 16:22].copy()


@pytest.fixture
def rng():
    return np.random.default_rng(11)


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-4, 1.0, 3.1])
def test_exponential_is_that_of_the_rotation_vector(rng, size):
    w = size * np.array([0.6, -0.64, 0.48])
    R = np.empty(9)
    exponential(*w, R)
    np.testing.assert_allclose(R.reshape(3, 3), Rotation.from_rotvec(w).as_matrix(), atol=1e-14)


def test_base_from_tip_undoes_the_arm(rng):
    base, arm = pose(rng), pose(rng)
    T = np.eye(4)
    base_from_tip(base @ arm, np.concatenate([arm[:3, :3].ravel(), arm[:3, 3]]), T)
    np.testing.assert_allclose(T, base, atol=1e-14)


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
    np.testing.assert_allclose(follower.W["T_base"][0, :3], base[:3], atol=1e-13)


@pytest.mark.parametrize("attitude", [codes.NOMINAL_ATTITUDE, codes.MEASURED_ATTITUDE])
def test_other_attitudes_turn_both_halves_of_the_inertial_error(rng, attitude):
    nominal, measured = pose(rng)[:3, :3], pose(rng)
    follower = Follower(base_attitude=attitude, base_nominal=nominal.ravel())
    q, base, goal = follower.robot.neutral, pose(rng), pose(rng)
    arm = follower.robot.pose(q)
    tip = base @ arm
    _, seen, _ = follower.tick(q, ftqp.Target(pose=goal), tip=tip, base=measured)
    R = nominal if attitude == codes.NOMINAL_ATTITUDE else measured[:3, :3]
    e = goal[:3, 3] - tip[:3, 3]
    turn = Rotation.from_matrix(goal[:3, :3] @ tip[:3, :3].T).as_rotvec()
    np.testing.assert_allclose(seen[:3, 3] - arm[:3, 3], R.T @ e, atol=1e-13)
    found = Rotation.from_matrix(seen[:3, :3] @ arm[:3, :3].T).as_rotvec()
    np.testing.assert_allclose(found, R.T @ turn, atol=1e-12)
    np.testing.assert_allclose(follower.W["base_error"][0], [*e, *turn], atol=1e-12)


def test_known_twist_of_the_base_is_taken_to_the_tip(rng):
    follower = Follower()
    q, base, V = follower.robot.neutral, pose(rng), rng.standard_normal(6)
    tip = base @ follower.robot.pose(q)
    _, _, seen = follower.tick(q, ftqp.Target(pose=tip), base=base, twist=V)
    at_tip = [*(V[:3] + np.cross(V[3:], tip[:3, 3] - base[:3, 3])), *V[3:]]
    np.testing.assert_allclose(follower.W["base_twist"][0], at_tip, atol=1e-13)
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
    np.testing.assert_allclose(follower.W["base_shift"][0], expected, atol=1e-12)
    np.testing.assert_allclose(follower.W["base_twist"][0], expected / DT, atol=1e-9)


def test_frozen_observer_keeps_what_it_had(rng):
    follower = Follower(observer=1.0)
    q, goal = follower.robot.neutral, ftqp.Target(pose=np.eye(4))
    arm = follower.robot.pose(q)
    for _ in range(2):
        follower.tick(q, goal, tip=pose(rng) @ arm)
    kept = follower.W["base_shift"][0].copy()
    follower.W["base_hold"] = 1
    follower.tick(q, goal, tip=pose(rng) @ arm)
    np.testing.assert_array_equal(follower.W["base_shift"][0], kept)


def test_late_tip_belongs_to_the_arm_pose_of_that_time(rng):
    """A base at rest, an arm that moves: the estimate is exact however late the tip is measured."""
    late, base = 3, pose(rng)
    follower = Follower(base_delay=late)
    robot, goal = follower.robot, ftqp.Target(pose=np.eye(4))
    way = [robot.neutral + 0.02 * k for k in range(10)]
    for k, q in enumerate(way):
        follower.tick(q, goal, tip=base @ robot.pose(way[max(0, k - late)]))
        np.testing.assert_allclose(follower.W["T_base"][0, :3], base[:3], atol=1e-12)


def test_late_twist_is_extrapolated_over_the_delay():
    """A base that accelerates steadily, measured 5 samples late: pose and coming twist are exact."""
    late, a = 5, np.array([0.4, -0.2, 0.3])
    follower = Follower(base_delay=late)
    q, goal = follower.robot.neutral, ftqp.Target(pose=np.eye(4))

    def base(k):
        T = np.eye(4)
        T[:3, 3] = 0.5 * a * (k * DT) ** 2
        return T

    for k in range(late, 30):
        then = k - late
        mean = a * (then + 0.5) * DT
        follower.tick(q, goal, base=base(then), twist=[*mean, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(follower.W["T_base"][0, :3, 3], base(29)[:3, 3], atol=1e-14)
    np.testing.assert_allclose(follower.W["base_twist"][0, :3], a * 29.5 * DT, atol=1e-13)


def test_base_that_is_not_seen_is_held_for_its_patience_and_then_lost(rng):
    follower = Follower(observer=1.0)
    q, goal = follower.robot.neutral, ftqp.Target(pose=np.eye(4))
    arm, base = follower.robot.pose(q), pose(rng)
    assert not follower.tick(q, goal)[0]
    assert follower.tick(q, goal, tip=base @ arm)[0]
    bad = base @ arm
    bad[1, 3] = np.nan
    for _ in range(5):
        valid, seen, _ = follower.tick(q, goal, tip=bad)
        assert valid and follower.W["base_stale"][0] == 1
        np.testing.assert_allclose(seen, np.linalg.inv(base), atol=1e-13)
    assert not follower.tick(q, goal)[0]
    assert follower.tick(q, goal, tip=base @ arm)[0] and follower.W["base_stale"][0] == 0


def test_lead_of_the_set_point_narrows_the_interval_but_never_empties_it():
    follower = Follower()
    K, n = follower.W, 7
    K["v_max"][0, :n] = 1.0
    K["lb"][0, :n], K["ub"][0, :n] = -0.8, 0.8
    K["q"][0, :n] = 0.0
    K["setpoint"][0, :n] = DT * np.array([0.0, 0.5, -0.5, 1.5, -1.5, 9.0, -9.0])
    K["fault"][0, 0] = codes.LOCKED
    lead_tick(address(K))
    np.testing.assert_allclose(K["ub"][0, :n], [0.8, 0.5, 0.8, -0.5, 0.8, -0.8, 0.8])
    np.testing.assert_allclose(K["lb"][0, :n], [-0.8, -0.8, -0.5, -0.8, 0.5, -0.8, 0.8])


@pytest.mark.parametrize("threshold", [0.01, 0.1, 0.3])
def test_rank_is_deficient_exactly_when_the_smallest_singular_value_is_below_the_threshold(rng, threshold):
    test = on_record(lambda_for(threshold))
    W = chain_record(ftqp.robots.load("panda"))
    W["m"], W["length"] = 6, 0.25
    for _ in range(20):
        A = rng.standard_normal((6, 7)) * 10.0 ** rng.uniform(-2, 0)
        W["A"][0, :6, :7] = A
        W["fault"][0, 3] = codes.LOCKED
        smallest = np.linalg.svd(np.delete(A, 3, axis=1), compute_uv=False)[-1]
        assert bool(test(address(W))) == (smallest / 0.25 < threshold)


def lambda_for(threshold):
    """The rank test at one threshold, as a helper of the kernel."""
    from ftqp.kernel.jit import jit

    @jit
    def deficient(K):
        return is_rank_deficient(K, threshold)

    return deficient
