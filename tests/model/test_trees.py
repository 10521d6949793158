"""Robots with branches: their kinematics, their frames, and another first tip."""

import json

import numpy as np
import pinocchio as pin
import pytest
from tests.model.random_robots import order_in, positions_in, random_robot

import ftqp
from ftqp.core.pose import transform
from ftqp.kernel.entry.session import ArmSession
from ftqp.model import catalog
from ftqp.model.chain import Skeleton
from ftqp.model.frames import PlacedFrames, centre_of_mass, mount_of
from ftqp.model.robot import Robot
from ftqp.model.serial import Inertial
from ftqp.model.shape import reach_of

SIZES = (3, 5, 8, 13, 20, 32)
BASE = Inertial(mass=40.0, com=np.array([0.1, 0.0, 0.2]), inertia=np.diag([2.0, 2.5, 3.0]))


def close(found, expected, tolerance=1e-12):
    return bool(np.abs(found - expected).max() <= tolerance * max(float(np.abs(expected).max()), 1.0))


def frame_of(model, name, full):
    data = model.createData()
    pin.framesForwardKinematics(model, data, full)
    return data.oMf[model.getFrameId(name)]


def placed(robot, q):
    """Joint frames by the product of transforms that the docstring of Chain gives."""
    chain, found = robot.chain, []
    for i, value in enumerate(q):
        step, move = np.eye(4), np.eye(4)
        step[:3, :3], step[:3, 3] = chain.rotation[i], chain.translation[i]
        if chain.prismatic[i]:
            move[2, 3] = value
        else:
            move[:3, :3] = pin.exp3(np.array([0.0, 0.0, value]))
        above = np.eye(4) if chain.parent[i] < 0 else found[chain.parent[i]]
        found.append(above @ step @ move)
    return found


@pytest.mark.parametrize("count", SIZES)
def test_pose_jacobian_inertia_and_bias_are_those_of_the_model_that_was_given(count):
    rng = np.random.default_rng(count)
    for _ in range(4):
        robot, model = random_robot(rng, count)
        of = order_in(model, robot)
        assert robot.nv == count
        for _ in range(2):
            q, v = rng.uniform(-2.0, 2.0, count), rng.uniform(-1.0, 1.0, count)
            full, speed = positions_in(model, robot, q), np.empty(count)
            speed[of] = v
            for tip in (None, *robot.tips):
                name = robot.tip if tip is None else tip
                assert close(robot.pose(q, tip), frame_of(model, name, full).homogeneous)
                J = pin.computeFrameJacobian(
                    model, model.createData(), full, model.getFrameId(name), pin.LOCAL_WORLD_ALIGNED
                )
                assert close(robot.jacobian(q, tip), J[:, of])
            data, rest = model.createData(), np.zeros(count)
            gravity = pin.rnea(model, data, full, rest, rest)
            M = np.array([pin.rnea(model, data, full, rest, unit) - gravity for unit in np.eye(count)])
            assert close(robot.mass_matrix(q), M[np.ix_(of, of)])
            bias = (pin.rnea(model, data, full, speed, rest) + model.damping * speed)[of]
            assert close(robot.bias(q, v), bias)
            arm = ArmSession(robot.chain.constants())
            arm.dynamics(q, v)
            assert close(arm.K.kinematics.M[:count, :count], M[np.ix_(of, of)])
            assert close(arm.K.kinematics.h[:count], bias)
            assert close(arm.K.kinematics.J[:, :count], robot.jacobian(q))


@pytest.mark.parametrize("count", SIZES)
def test_any_frame_has_its_joint_and_its_place_there(count):
    rng = np.random.default_rng(count)
    robot, model = random_robot(rng, count)
    for name in (*robot.tips, *robot.joints):
        body, T = mount_of(robot, name)
        assert robot.joints[body] == str(model.names[model.frames[model.getFrameId(name)].parentJoint])
        for _ in range(3):
            q = rng.uniform(-2.0, 2.0, count)
            assert close(placed(robot, q)[body] @ T, robot.pose(q, name))
    q = rng.uniform(-2.0, 2.0, count)
    com = pin.centerOfMass(model, model.createData(), positions_in(model, robot, q))
    assert close(centre_of_mass(robot, q), com)
    frames = PlacedFrames(robot, [*robot.tips, robot.joints[0]])
    assert close(frames.at(q), np.array([robot.pose(q, name) for name in (*robot.tips, robot.joints[0])]))


@pytest.mark.parametrize("count", SIZES)
def test_a_skeleton_in_a_log_places_joints_and_tip(count):
    rng = np.random.default_rng(count)
    robot, _ = random_robot(rng, count)
    kept = json.loads(json.dumps(Skeleton.of(robot.chain).facts()))
    q = rng.uniform(-2.0, 2.0, (3, count))
    for row, frames in zip(q, Skeleton.from_facts(kept).frames(q), strict=True):
        assert close(frames[:-1], np.array(placed(robot, row)))
        assert close(frames[-1], robot.pose(row))


@pytest.mark.parametrize("count", SIZES)
def test_a_urdf_gives_the_same_robot_back(count):
    rng = np.random.default_rng(count)
    robot, _ = random_robot(rng, count)
    again = Robot.from_urdf(robot.to_urdf(), tips=robot.tips, gravity=robot.chain.gravity)
    of = [again.joint(name) for name in robot.joints]
    assert (again.name, again.tips) == (robot.name, robot.tips)
    for field in ("q_min", "q_max", "v_max", "a_max", "tau_max", "j_max"):
        assert getattr(again.limits, field)[of].tolist() == getattr(robot.limits, field).tolist()
    for _ in range(3):
        q, v = rng.uniform(-2.0, 2.0, count), rng.uniform(-1.0, 1.0, count)
        turned, speed = np.empty(count), np.empty(count)
        turned[of], speed[of] = q, v
        for tip in robot.tips:
            assert close(again.pose(turned, tip), robot.pose(q, tip))
        assert close(again.mass_matrix(turned)[np.ix_(of, of)], robot.mass_matrix(q))
        assert close(again.bias(turned, speed)[of], robot.bias(q, v))


def test_dual_panda_is_two_pandas():
    one, two = catalog.load("panda"), catalog.load("dual_panda", apart=0.8)
    assert two.tips == ("left_hand", "right_hand")
    assert two.joints == tuple(f"{side}_joint{i}" for side in ("left", "right") for i in range(1, 8))
    rng = np.random.default_rng(5)
    q, v = rng.uniform(-1.0, 1.0, 14), rng.uniform(-1.0, 1.0, 14)
    for k, (tip, y) in enumerate((("left_hand", 0.4), ("right_hand", -0.4))):
        own = slice(7 * k, 7 * k + 7)
        expected = one.pose(q[own])
        expected[1, 3] += y
        assert close(two.pose(q, tip), expected)
        assert close(two.mass_matrix(q)[own, own], one.mass_matrix(q[own]))
        assert close(two.bias(q, v)[own], one.bias(q[own], v[own]))
    assert not two.mass_matrix(q)[:7, 7:].any()


@pytest.mark.parametrize("count", [3, 7, 12])
def test_a_planar_base_moves_all_that_stands_on_it(count):
    rng = np.random.default_rng(count)
    robot, _ = random_robot(rng, count)
    based = robot.on_planar_base(v_max=[1.0, 1.0, 2.0], a_max=2.0, inertial=BASE)
    assert based.joints == ("base_x", "base_y", "base_yaw", *robot.joints)
    assert (based.tips, based.length) == (robot.tips, robot.length)
    assert reach_of(based.chain, based.limits) == pytest.approx(reach_of(robot.chain, robot.limits))
    oracle = pin.Model()
    oracle.gravity = robot.model.gravity
    planar = oracle.addJoint(0, pin.JointModelPlanar(), pin.SE3.Identity(), "planar")
    oracle.appendBodyToJoint(planar, pin.Inertia(BASE.mass, BASE.com, BASE.inertia), pin.SE3.Identity())
    for i in range(1, robot.model.njoints):
        made = oracle.addJoint(
            int(robot.model.parents[i]) + 1, robot.model.joints[i], robot.model.jointPlacements[i], f"j{i}"
        )
        oracle.appendBodyToJoint(made, robot.model.inertias[i], pin.SE3.Identity())
    oracle.armature = np.concatenate([np.zeros(3), robot.model.armature])
    x, y, yaw = base = np.array([0.7, -1.2, 2.5])
    q = rng.uniform(-2.0, 2.0, count)
    T = pin.SE3(pin.exp3(np.array([0.0, 0.0, yaw])), np.array([x, y, 0.0])).homogeneous
    for tip in robot.tips:
        assert close(based.pose(np.concatenate([base, q]), tip), T @ robot.pose(q, tip))
    full = np.concatenate([[x, y, np.cos(yaw), np.sin(yaw)], robot.configuration(q)])
    M = pin.crba(oracle, oracle.createData(), full)
    M = np.triu(M) + np.triu(M, 1).T
    turn = np.eye(count + 3)
    turn[:2, :2] = T[:2, :2]  # the planar joint's velocities are along the base's own axes
    assert close(based.mass_matrix(np.concatenate([base, q])), turn @ M @ turn.T)


UNALIGNED_CONTINUOUS = """<robot name="c"><link name="base"/><link name="one"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/><parent link="base"/><child
link="one"/> <axis xyz="1 2 -3"/></joint></robot>"""


def test_continuous_joint_about_a_slanted_axis_is_turned_to_its_z_axis():
    robot = Robot.from_urdf(UNALIGNED_CONTINUOUS, "one")
    assert robot.chain.continuous.tolist() == [True]
    assert (robot.nq, robot.nv) == (2, 1)
    for angle in (-2.0, 0.0, 3.0):
        end = transform(robot.chain.tip_rotation, robot.chain.tip_translation)
        assert close(placed(robot, np.array([angle]))[0] @ end, robot.pose([angle]))


BOTH = ftqp.robots.load("dual_panda")
LEFT, RIGHT = BOTH.tips
TURNED = BOTH.with_first_tip(RIGHT)


@pytest.mark.parametrize("frame", [RIGHT, LEFT, "right_joint4", "left_joint3"])
def test_the_robot_is_the_same_and_its_tip_is_the_frame(frame):
    robot, q = BOTH.with_first_tip(frame), BOTH.neutral + 0.1
    assert robot.tip == frame and set(robot.tips) == {frame, LEFT, RIGHT} and robot.joints == BOTH.joints
    np.testing.assert_array_equal(robot.pose(q), BOTH.pose(q, frame))
    np.testing.assert_array_equal(robot.jacobian(q), BOTH.jacobian(q, frame))
    np.testing.assert_array_equal(robot.pose(q, LEFT), BOTH.pose(q, LEFT))
    np.testing.assert_array_equal(robot.mass_matrix(q), BOTH.mass_matrix(q))
    assert robot.length == BOTH.length and robot.limits is BOTH.limits
    assert robot.with_first_tip(LEFT).tips[0] == LEFT


def test_a_goal_is_of_that_tip_while_the_other_stays_and_a_joint_fails(level):
    tasks = [ftqp.Task(), ftqp.PoseTask(LEFT, level=0)]
    planner = ftqp.Planner(TURNED, 2e-3, level=level, tasks=tasks)
    goal = TURNED.pose(TURNED.neutral).copy()
    goal[:3, 3] += [0.05, 0.0, -0.1]
    going, q = ftqp.GoTo(planner, pose=goal), TURNED.neutral.copy()
    going.reset(q)
    for k in range(3000):
        if k == 100:
            planner.report(ftqp.Locked("right_joint3"))
        q = going.step(q, None).q.copy()
        if going.done:
            break
    assert going.status is ftqp.GoToStatus.REACHED
    np.testing.assert_allclose(BOTH.pose(q, RIGHT), goal, atol=1e-3)
    np.testing.assert_allclose(BOTH.pose(q, LEFT), BOTH.pose(BOTH.neutral, LEFT), atol=1e-5)
