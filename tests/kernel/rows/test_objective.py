"""What a step minimises, and where a target above a moving base is."""

import numpy as np
import pytest
from random_chains import random_robot
from records import believe, chain_record
from scipy.spatial.transform import Rotation
from session_ticks import Ticks, hessian

import ftqp
from ftqp.control.task.task import axis_frame, row_indices
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.entry.session import ArmSession, Memory
from ftqp.kernel.layout import enums
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.rows.inertial_target import (
    follow_base,
)
from ftqp.kernel.rows.objective import FLOOR, add_manipulability, manipulability_gradient
from ftqp.kernel.rows.task_rows import task_rows

DT = 0.002
Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])
V = np.array([0.3, -0.2, 0.1, 0.25, -0.4, 0.2, 0.35])
POSTURE = np.array([0.0, -0.3, 0.1, -1.8, 0.1, 1.4, 0.7])


def assembled(scheme, level, *faults):
    """H, g, M and h of one tick of a moving Panda."""
    robot = ftqp.robots.load("panda")
    ticks = Ticks(robot, DT, *faults, level=level, scheme=scheme, posture=POSTURE, torque_limits=False)
    ticks.reset(Q, V)
    ticks.tick(Q, V, ftqp.Target(pose=robot.pose(Q)))
    K, arm = ticks.K, ArmSession(robot.chain.constants())
    v = K.state.v[:7].copy()
    arm.dynamics(Q, v)
    return hessian(K), K.qp.g[:7].copy(), arm.K.kinematics.M[:7, :7], arm.K.kinematics.h[:7], v


def table(name, level, M, h, v, healthy=slice(None)):
    """W and c of a scheme by the published table; a failed joint's torque is left out of torque norms."""
    eye, S, bias = np.eye(7), M[healthy], h[healthy]
    if level == "acceleration":
        torque, pull = S.T @ bias, 8.0 * v + 16.0 * (Q - POSTURE)
        still = 4.0 * v
    else:
        torque, pull = S.T @ (DT * bias - S @ v), 4.0 * (Q - POSTURE)
        still = 0.0 * v
    share, c = {"mtn": (1.0, 0.0 * v), "dlsm": (0.995, pull), "dlsm_mvn": (0.995, still)}[name]
    return share * S.T @ S + (1.0 - share) * eye, share * torque + (1.0 - share) * c


def close(got, expected):
    """To 1e-12 of the largest entry."""
    return np.abs(got - expected).max() <= 1e-12 * max(1e-300, np.abs(expected).max())


@pytest.mark.parametrize("name", ["mtn", "dlsm", "dlsm_mvn"])
def test_torque_of_a_locked_joint_is_not_in_the_objective(name, level):
    H, g, M, h, v = assembled(name, level, ftqp.Locked(2, mode="instant"))
    W, c = table(name, level, M, h, v, healthy=[0, 1, 3, 4, 5, 6])
    assert v[2] == 0.0
    assert close(H, W) and close(g, c)
    full, _ = table(name, level, M, h, v)
    assert not close(H, full)


@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_torque_of_a_free_swinging_joint_is_not_minimised(level, damping):
    """What stands in its place is zero for every x that its equality row allows: no answer changes."""
    H, g, M, h, v = assembled("mtn", level, ftqp.FreeSwinging(3, damping=damping))
    W, c = table("mtn", level, M, h, v, healthy=[0, 1, 2, 4, 5, 6])
    row = M[3] + damping * DT * np.eye(7)[3]
    scale = DT if level == "velocity" else 1.0
    side = -scale * h[3] + (M[3] @ v if level == "velocity" else -damping * v[3])
    assert close(H, W + np.outer(row, row)) and close(g, c - row * side)
    assert np.linalg.eigvalsh(H).min() > 0.0


def test_a_continuous_joint_returns_to_its_posture_the_short_way():
    robot = random_robot(np.random.default_rng(4), 12)
    i = int(np.flatnonzero(robot.continuous)[0])
    q, posture = np.zeros(12), np.zeros(12)
    posture[i] = 6.0
    ticks = Ticks(robot, DT, scheme="rmp", posture=posture)
    ticks.reset(q)
    ticks.tick(q, np.zeros(12), ftqp.Target(pose=robot.pose(q)))
    assert abs(ticks.K.qp.g[i] - 16.0 * 2.0 * np.sin(0.5 * (2.0 * np.pi - 6.0))) < 1e-12


PANDA = ftqp.robots.load("panda")
SLIDER = ftqp.Robot.from_dh(
    [
        [0.0, 0.3, 0.0, np.pi / 2],
        [0.0, 0.2, 0.1, -np.pi / 2],
        [0.3, 0.0, 0.2, np.pi / 2],
        [0.0, 0.0, 0.3, 0.0],
    ],
    limits={"v_max": 1.0, "q_min": -3.0, "q_max": 3.0},
)


def task_record(robot, rows, failed=()):
    """A record with the robot's chain, a task of those rows, and joints that are locked."""
    K = chain_record(robot)
    task, chosen = K.task, row_indices(rows)
    task.m, task.rows[: len(chosen)] = len(chosen), chosen
    task.length, task.row_scale[:] = robot.length, [1.0, 1.0, 1.0, *[robot.length] * 3]
    task.tool_rows, task.axis[:] = rows == "position_axis", axis_frame([0.3, -0.2, 1.0]).ravel()
    believe(K, dict.fromkeys(failed, codes.LOCKED))
    return K


def rows_at(K, q):
    """The task's rows at q, into the record."""
    K.state.q[: len(q)] = q
    forward_kinematics(K, K.state)
    task_rows(K, 0.0)


def measure(K, robot, q, failed):
    """log sqrt det(A_f A_f' + (FLOOR length)^2 I)."""
    n, m = robot.nv, int(K.task.m)
    rows_at(K, q)
    A = K.qp.A[:m, :n][:, [i for i in range(n) if i not in failed]]
    return 0.5 * np.linalg.slogdet(A @ A.T + (FLOOR * robot.length) ** 2 * np.eye(m))[1]


@pytest.mark.parametrize("rows", ["pose", "position", "position_axis", ("x", "z", "ry")])
@pytest.mark.parametrize("failed", [(), (2,), (0, 5)])
@pytest.mark.parametrize("seed", range(3))
def test_gradient_is_that_of_finite_differences(rows, failed, seed):
    check(PANDA, rows, failed, PANDA.neutral + np.random.default_rng(seed).uniform(-0.5, 0.5, 7))


@pytest.mark.parametrize(("robot", "rows", "q", "tolerance"), [
    *((SLIDER, rows, [0.3, -0.4, 0.7, 0.2], 1e-6) for rows in ("position", "position_axis", ("x", "y"))),
    (PANDA, "pose", np.zeros(7), 1e-3),
])  # fmt: skip
def test_gradient_of_an_arm_with_other_axes_and_at_a_singular_posture(robot, rows, q, tolerance):
    check(robot, rows, (), np.array(q), tolerance)


def check(robot, rows, failed, q, tolerance=1e-6):
    K = task_record(robot, rows, failed)
    rows_at(K, q)
    manipulability_gradient(K)
    found = K.scratch.joints[: robot.nv].copy()
    K.qp.g[:], K.criteria.manipulability = 0.0, 0.7
    add_manipulability(K)  # less of the objective where the measure is greater
    np.testing.assert_array_equal(K.qp.g[: robot.nv], -0.7 * found)
    h = 3e-5
    for i in (i for i in range(robot.nv) if i not in failed):
        ends = [measure(K, robot, q + sign * h * np.eye(robot.nv)[i], failed) for sign in (1.0, -1.0)]
        assert found[i] == pytest.approx((ends[0] - ends[1]) / (2.0 * h), rel=tolerance, abs=tolerance), i


def test_step_is_as_near_to_the_demand_as_its_box_allows(level):
    """d = x_r + kv (v_r - v) + kp (q_r - q), each joint cut to its interval."""
    rng = np.random.default_rng(1)
    planner = ftqp.Planner(PANDA, 1e-3, level=level, torque_limits=False)
    memory = Memory("joints")
    joints = memory.fields
    lead = planner.lead(memory)
    joints.kp, joints.kv = 100.0, 20.0
    for _ in range(20):
        q, v = PANDA.neutral + rng.uniform(-0.1, 0.1, 7), rng.uniform(-0.3, 0.3, 7)
        joints.q[:7], joints.v[:7] = q + rng.uniform(-0.01, 0.01, 7), v + rng.uniform(-0.1, 0.1, 7)
        joints.x[:7] = rng.uniform(-4.0, 4.0, 7)
        planner.reset(q, v)
        step = lead.step(q, v, (), None, None)
        demand = joints.x[:7] + 20.0 * (joints.v[:7] - v) + 100.0 * (joints.q[:7] - q)
        assert np.abs(joints.demand[:7] - demand).max() < 1e-12
        x = step.a if level == "acceleration" else step.v
        assert np.abs(x - np.clip(demand, step.lower, step.upper)).max() < 1e-9
        cut = np.abs(demand - np.clip(demand, step.lower, step.upper)).max() > 1.0
        assert (step.status is ftqp.StepStatus.RELAXED) or not cut


def test_error_of_the_tip_is_to_where_the_motion_of_the_working_joints_puts_it():
    planner = ftqp.Planner(PANDA)
    planner.report(ftqp.Locked(3, mode="instant"))
    memory = Memory("joints")
    lead = planner.lead(memory)
    q = PANDA.neutral
    ahead = q + np.linspace(-0.01, 0.01, 7)
    planner.reset(q)
    memory.fields.q[:7] = ahead
    step = lead.step(q, np.zeros(7), (), None, None)
    ahead[3] = q[3]
    shift = PANDA.pose(ahead)[:3, 3] - PANDA.pose(q)[:3, 3]
    assert np.abs(step.task_error[:3] - shift).max() < 1e-12


TEN_MS = 0.01


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
        self.K.state.dt, self.K.task.length = TEN_MS, 0.2
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
    np.testing.assert_allclose(follower.base.twist, expected / TEN_MS, atol=1e-9)


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
        T[:3, 3] = 0.5 * a * (k * TEN_MS) ** 2
        return T

    for k in range(late, 30):
        then = k - late
        mean = a * (then + 0.5) * TEN_MS
        follower.tick(q, goal, base=base(then), twist=[*mean, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(follower.base.pose[:3, 3], base(29)[:3, 3], atol=1e-14)
    np.testing.assert_allclose(follower.base.twist[:3], a * 29.5 * TEN_MS, atol=1e-13)
