"""Kinematics, dynamics and the error of a pose in the kernel against pinocchio and finite differences."""

import numpy as np
import pinocchio as pin
import pytest
from random_chains import configuration, random_robot
from records import chain_record, empty_record

import ftqp
from ftqp.control.task.task import axis_frame
from ftqp.kernel.arm.dynamics import knows_no_gravity, torque_bound, torques_of
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.arm.pose_error import pose_error, rotation_vector
from ftqp.kernel.entry.session import ArmSession
from ftqp.model.catalog import load
from ftqp.model.robot import Robot

SIZES = (*range(2, 13), 16, *(pytest.param(n, marks=pytest.mark.slow) for n in (20, 25, 31, 32)))


def relative(got, expected):
    """Largest deviation over the largest entry."""
    return np.abs(np.asarray(got) - expected).max() / np.abs(expected).max()


def arm_of(robot):
    """The arm alone."""
    return ArmSession(robot.chain.constants())


@pytest.mark.parametrize("joints", SIZES)
def test_continuous_joints_may_be_given_by_cosine_and_sine(joints):
    rng = np.random.default_rng(100 + joints)
    robot = random_robot(rng, joints)
    while robot.nq == robot.nv:
        robot = random_robot(rng, joints)
    by_angle, by_pair = arm_of(robot), arm_of(robot)
    q, full, v = configuration(rng, robot)
    by_angle.kinematics(q, v)
    by_pair.kinematics(full, v)
    assert np.abs(by_pair.K.state.q[:joints] - q).max() < 1e-14
    for name in ("R_tip", "o_tip", "J", "drift"):
        by = [getattr(arm.K.kinematics, name) for arm in (by_pair, by_angle)]
        assert relative(*by) < 1e-12


@pytest.mark.parametrize("held", [[], [2], [0, 5]])
def test_rotor_inertia_stands_on_the_diagonal_as_in_pinocchio(held):
    rng = np.random.default_rng(11)
    whole = load("panda").model.copy()
    whole.armature = rng.uniform(0.1, 2.0, 7)
    robot = Robot.from_pinocchio(whole, "panda_hand_tcp", held)
    bare = Robot.from_pinocchio(load("panda").model, "panda_hand_tcp", held)
    free = [i for i in range(7) if i not in held]
    arm, bare_arm, q = arm_of(robot), arm_of(bare), rng.uniform(-1.0, 1.0, robot.nv)
    for one in (arm, bare_arm):
        one.dynamics(q, np.zeros(robot.nv))
    M, M_bare = (one.K.kinematics.M[: robot.nv, : robot.nv] for one in (arm, bare_arm))
    assert np.abs(M - M_bare - np.diag(whole.armature[free])).max() < 1e-14
    upper = np.triu(pin.crba(robot.model, robot.model.createData(), q))
    assert np.abs(M - upper - np.triu(upper, 1).T).max() < 1e-12 * np.abs(M).max()
    assert np.array_equal(arm.K.kinematics.h, bare_arm.K.kinematics.h)


def test_only_the_first_joint_of_an_upright_arm_knows_no_gravity():
    K = chain_record(ftqp.robots.load("panda"))
    forward_kinematics(K, K.state)
    assert [knows_no_gravity(K.kinematics, K.chain, i) for i in range(7)] == [True, *[False] * 6]
    K.chain.gravity[:] = 0.0
    assert all(knows_no_gravity(K.kinematics, K.chain, i) for i in range(7))


@pytest.mark.long
@pytest.mark.parametrize("joints", [1, 2, 4, 8])
def test_no_torque_is_beyond_the_bound(joints):
    rng = np.random.default_rng(joints)
    closest = 0.0
    for _ in range(40):
        robot = random_robot(rng, joints)
        K, (q, _, v) = chain_record(robot), configuration(rng, robot)
        a = rng.normal(size=joints) * rng.choice([0.0, 0.1, 10.0])
        K.state.q[:joints], K.chain.viscous[:joints] = q, rng.uniform(0.0, 2.0, joints)
        K.state.v[:joints] = v * rng.choice([0.0, 0.1, 3.0])
        forward_kinematics(K, K.state)
        motion(K, K.state)
        torques_of(K.state, K.kinematics, K.chain, a)
        tau = np.abs(K.kinematics.tau[:joints])
        torque_bound(K.state, K.kinematics, K.chain, a)
        bound = K.kinematics.tau[:joints]
        assert np.all(tau <= bound * (1.0 + 1e-12))
        closest = max(closest, float((tau / bound).max()))
    assert closest > 0.5, "it is not so wide as to be of no use"


def test_bound_is_reached_by_a_stretched_arm_that_turns_all_joints_one_way():
    """A planar arm without gravity: all lengths, speeds and accelerations along one another."""
    robot = ftqp.robots.load("planar(3)")
    K = chain_record(robot)
    a = np.array([2.0, 1.0, 0.5])
    forward_kinematics(K, K.state)
    motion(K, K.state)
    torques_of(K.state, K.kinematics, K.chain, a)
    tau = K.kinematics.tau[:3].copy()
    torque_bound(K.state, K.kinematics, K.chain, a)
    assert np.abs(K.kinematics.tau[:3] - tau).max() < 1e-12 * tau.max() and tau.min() > 0.1


OFF = (0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3)
"""Distances of an angle from pi [rad]."""


def axes(count=60):
    """Unit vectors: the coordinate axes, the diagonals of planes and of the cube, and random ones."""
    grid = np.array(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1])).reshape(3, -1).T
    random = np.random.default_rng(1).normal(size=(count, 3))
    vectors = np.vstack([grid[np.any(grid != 0, axis=1)], random, [1.0, 1e-9, -1e-9], [1e-5, 1.0, 1e-12]])
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def rodrigues(axis, angle):
    """cos I + sin [axis] + (1 - cos) axis axis'."""
    return (
        np.cos(angle) * np.eye(3)
        + np.sin(angle) * pin.skew(axis)
        + (1.0 - np.cos(angle)) * np.outer(axis, axis)
    )


def error(R, R_target, p=(0.0, 0.0, 0.0), p_target=(0.0, 0.0, 0.0), tool=None, measured=False):
    """The kernel's error, (6,), of a tip at (R, p); with ``tool`` in axis mode."""
    K = empty_record()
    task, kinematics = K.task, K.kinematics
    task.uses_rotation, task.tool_rows = 1, tool is not None
    task.axis[:] = axis_frame((0, 0, 1) if tool is None else tool).ravel()
    target = np.eye(4)
    target[:3, :3], target[:3, 3] = R_target, p_target
    task.target[:16] = target.ravel()
    if measured:
        task.has_tip_measured = 1
        task.tip_measured[:3, :3], task.tip_measured[:3, 3] = R, p
    else:
        kinematics.R_tip[:], kinematics.o_tip[:] = np.ravel(R), p
    pose_error(K)
    return task.error.copy()


def turns(count, seed=0):
    """Random rotations."""
    rng = np.random.default_rng(seed)
    return [pin.exp3(rng.uniform(-1.8, 1.8, 3)) for _ in range(count)]


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-15, 1e-9, 1e-4, 0.5, 1.5, 2.0, 2.5, 3.0, 3.14])
def test_rotation_vector_is_axis_times_angle(angle):
    for axis in axes():
        vector = np.array(rotation_vector(*rodrigues(axis, angle)))
        assert np.abs(vector - angle * axis).max() < 1e-14


@pytest.mark.parametrize("off", OFF)
def test_rotation_vector_is_accurate_at_and_near_pi(off):
    for axis in axes():
        vector = np.array(rotation_vector(*rodrigues(axis, np.pi - off)))
        assert abs(np.linalg.norm(vector) - (np.pi - off)) < 1e-14
        wrong_side = off <= 1e-15 and vector @ axis < 0.0  # at pi both directions are right
        assert np.abs((-vector if wrong_side else vector) - (np.pi - off) * axis).max() < 1e-14


def test_error_carries_the_tip_onto_the_target():
    for R, X in zip(turns(50), turns(50, 1), strict=True):
        e = error(R, X, (1, 2, 3), (2, 0, 7))
        assert np.array_equal(e[:3], (1, -2, 4))
        assert np.abs(pin.exp3(e[3:]) @ R - X).max() < 1e-14


def test_error_changes_as_its_derivative_says():
    """R -> exp(eps w) R changes the rotation vector of X R' by -Jlog3(X R') eps w."""
    rng, eps = np.random.default_rng(3), 1e-6
    for R, X in zip(turns(30), turns(30, 1), strict=True):
        w, u = rng.normal(size=(2, 3))
        ends = [error(pin.exp3(s * eps * w) @ R, X, s * eps * u) for s in (1.0, -1.0)]
        slope = (ends[0] - ends[1]) / (2.0 * eps)
        assert np.abs(slope[:3] + u).max() < 1e-9
        assert np.abs(slope[3:] + pin.Jlog3(X @ R.T) @ w).max() < 1e-7


def test_measured_tip_takes_the_place_of_forward_kinematics():
    for R, X in zip(turns(20), turns(20, 1), strict=True):
        assert np.array_equal(
            error(R, X, (1, 2, 3), (3, 2, 2), measured=True), error(R, X, (1, 2, 3), (3, 2, 2))
        )


def test_axis_mode_is_the_shortest_turn_of_the_tool_axis():
    for R, X, tool in zip(turns(80), turns(80, 1), axes(80), strict=False):
        e = error(R, X, tool=tool)[3:]
        here, there = R @ tool, X @ tool
        assert np.abs(pin.exp3(e) @ here - there).max() < 1e-14
        assert abs(np.linalg.norm(e) - np.arccos(np.clip(here @ there, -1.0, 1.0))) < 1e-7
        assert abs(e @ here) < 1e-14 and abs(e @ there) < 1e-14


@pytest.mark.parametrize("off", OFF)
def test_axis_mode_turns_an_opposite_tool_round(off):
    for R, axis in zip(turns(60), axes(60), strict=False):
        frame = axis_frame(axis)
        X = R @ rodrigues(frame[:, 0], np.pi - off)
        e = error(R, X, tool=axis)[3:]
        assert np.pi - off - 1e-12 < np.linalg.norm(e) < np.pi + 1e-14
        assert np.abs(pin.exp3(e) @ R @ axis - X @ axis).max() < 2e-12
