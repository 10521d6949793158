"""Joints that follow others: which a reader takes, what they do to limits, and what it refuses."""

import numpy as np
import pinocchio as pin
import pytest
from tests.telescope import telescope

from ftqp.core.errors import InputError, ModelError
from ftqp.model.robot import Robot
from ftqp.model.serial import Inertial


@pytest.fixture(scope="module")
def robot():
    return Robot.from_urdf(telescope(), "tool")


def test_joints_on_the_way_that_follow_others_move_with_them(robot):
    assert robot.joints[2] == "lift2" and robot.chain.lead.tolist() == [0, 1, 1, 3, 3, 5, 6, 7]
    assert robot.neutral[2] == pytest.approx(0.5 * robot.neutral[1] + 0.02, abs=0.0)
    assert not robot.is_serial


def test_a_leader_keeps_where_its_followers_are_in_their_range_and_within_their_speed(robot):
    at = robot.joint("lift"), robot.joint("lift2")
    assert robot.limits.q_max[list(at)] == pytest.approx([0.36, 0.2])  # 0.2 = 0.5 q + 0.02
    assert robot.limits.v_max[list(at)] == pytest.approx([0.5, 0.25])
    assert np.isinf(robot.limits.tau_max[at[1]])
    slower = robot.with_limits(v_max=np.where(np.arange(8) == at[1], 0.1, robot.limits.v_max))
    assert slower.limits.v_max[at[0]] == pytest.approx(0.2)


def test_jacobian_mass_matrix_and_bias_are_those_of_pinocchios_own_mimic_joints(robot):
    model = pin.buildModelFromXML(telescope(), mimic=True)
    leads = robot.chain.lead == np.arange(robot.nv)
    rng = np.random.default_rng(0)
    q = rng.uniform(-0.5, 0.5, robot.nv)
    q = robot.chain.ratio * q[robot.chain.lead] + robot.chain.offset
    data, tip = model.createData(), model.getFrameId("tool")
    J = pin.computeFrameJacobian(model, data, q[leads], tip, pin.LOCAL_WORLD_ALIGNED)
    assert robot.jacobian(q)[:, leads] == pytest.approx(J, abs=1e-12)
    M = pin.crba(model, data, q[leads])
    M = np.triu(M) + np.triu(M, 1).T
    assert robot.mass_matrix(q)[np.ix_(leads, leads)] == pytest.approx(M, abs=1e-12)
    gravity = pin.computeGeneralizedGravity(model, data, q[leads])
    assert robot.bias(q, np.zeros(robot.nv))[leads] == pytest.approx(gravity, abs=1e-12)
    pin.framesForwardKinematics(model, data, q[leads])
    assert robot.pose(q) == pytest.approx(data.oMf[tip].homogeneous, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (telescope(yaw='<mimic joint="lift2"/>'), "'yaw' mimics 'lift2', but 'lift2' mimics 'lift' in turn"),
        (telescope(yaw='<mimic joint="yaw"/>'), "'yaw' mimics 'yaw', but"),
        (telescope(yaw='<mimic joint="jaw"/>'), "'yaw' mimics 'jaw', but that is no joint that moves"),
        (telescope(yaw='<mimic joint="pitch" multiplier="0"/>'), "a multiplier other than 0"),
        (telescope(yaw='<mimic joint="pitch" multiplier="much"/>'), "by nan times its position"),
        (
            telescope(lift2='<mimic joint="lift" offset="0.3"/>'),
            "no place of 'lift' keeps both in their ranges",
        ),
    ],
)
def test_a_follower_that_cannot_follow_is_refused_in_a_sentence(text, message):
    with pytest.raises(ModelError, match=message):
        Robot.from_urdf(text, "tool")


def test_a_follower_may_be_held_or_its_leader_which_holds_both():
    held = Robot.from_urdf(telescope(), "tool", locked=["lift2"], q_locked={"lift2": 0.1})
    assert "lift" in held.joints and "lift2" not in held.joints
    both = Robot.from_urdf(telescope(), "tool", locked=["lift"], q_locked={"lift": 0.2})
    assert not {"lift", "lift2"} & set(both.joints)
    moving = Robot.from_urdf(telescope(), "tool")
    q = moving.neutral.copy()
    q[1], q[2] = 0.2, 0.12
    assert both.pose(q[[0, 3, 4, 5, 6, 7]]) == pytest.approx(moving.pose(q), abs=1e-12)


def test_what_follows_is_kept_by_every_way_to_another_robot(robot):
    again = Robot.from_urdf(robot.to_urdf(), "tool")
    body = Inertial(mass=50.0, com=(0.0, 0.0, 0.1), inertia=np.eye(3))
    based = robot.on_planar_base(v_max=1.0, a_max=2.0, inertial=body)
    for one in (again, robot.with_first_tip("roll"), robot.with_rotors(0.1), based):
        names = {one.joints[i]: one.joints[leader] for i, leader in enumerate(one.chain.lead) if leader != i}
        assert names == {"lift2": "lift", "elbow": "shoulder"}
    assert again.limits.q_max == pytest.approx(robot.limits.q_max)


def test_a_pinocchio_model_is_told_what_follows_what():
    model = pin.buildModelFromXML(telescope())
    follows = {"lift2": ("lift", 0.5, 0.02), "elbow": ("shoulder", -0.7, 0.3)}
    robot = Robot.from_pinocchio(model, "tool", mimics=follows)
    assert robot.chain.lead.tolist() == [0, 1, 1, 3, 3, 5, 6, 7]
    assert Robot.from_pinocchio(model, "tool", mimics={"lift2": "lift"}).chain.ratio[2] == 1.0
    with pytest.raises(InputError, match="'list' is not a joint"):
        Robot.from_pinocchio(model, "tool", mimics={"lift2": "list"})
    with pytest.raises(InputError, match="mimics has"):
        Robot.from_pinocchio(model, "tool", mimics={"lift2": ("lift", "half")})
