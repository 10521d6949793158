"""Tool and friction in copies of a robot."""

import numpy as np
import pytest
from tests.arm_at import arm_at

import ftqp
from ftqp.core.errors import InputError, ModelError
from ftqp.core.pose import rotation_x, transform
from ftqp.model.robot import Robot

Q = [0.3, -0.5, 0.4, -1.9, 0.2, 1.6, 0.5]
PANDA = ftqp.robots.load("panda")
PLACE = transform(rotation_x(0.4), np.array([0.05, 0.0, 0.1]))

FRICTION = '<dynamics damping="0.6" friction="0.25"/>'


def notes(robot):
    return [finding.sentence for finding in robot.findings if finding.about == "friction"]


def test_tip_moves_and_masses_and_length_stay():
    tool = PANDA.with_tip(PLACE, "gripper")
    assert tool.tip == "gripper"
    np.testing.assert_allclose(tool.pose(Q), PANDA.pose(Q) @ PLACE, atol=1e-12)
    assert tool.length == PANDA.length
    np.testing.assert_allclose(arm_at(tool, Q).M, arm_at(PANDA, Q).M, atol=1e-12)
    assert PANDA.tip == "panda_hand_tcp"


def test_pose_or_name_of_a_tip_that_cannot_be_is_refused():
    with pytest.raises(InputError, match="T has a rotation part that is not a rotation"):
        PANDA.with_tip(np.diag([1.0, 1.0, -1.0, 1.0]))
    with pytest.raises(InputError, match="'panda_hand_tcp' is already a frame of panda; give the new tip"):
        PANDA.with_tip(np.eye(4), "panda_hand_tcp")


def test_friction_is_data_of_the_robot_and_its_viscous_part_a_torque():
    rough = PANDA.with_friction(viscous=[1, 2, 3, 4, 5, 6, 7], coulomb=0.3)
    assert rough.viscous.tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert rough.coulomb.tolist() == [0.3] * 7
    v = np.linspace(-0.5, 0.7, 7)
    np.testing.assert_allclose(arm_at(rough, Q, v).h - arm_at(PANDA, Q, v).h, rough.viscous * v, atol=1e-12)
    assert notes(rough) == [
        "joint friction is known: viscous 1 to 7 N m s/rad, Coulomb 0.3 N m; torques count the viscous part; "
        "replace it with robot.with_friction(viscous=..., coulomb=...)",
        *(
            f"joint 'panda_joint{k}' needs {torque} N m against its viscous friction at its speed limit, "
            "beyond its torque limit of 12 N m; correct one of them, "
            "robot.with_friction(viscous=..., coulomb=...)"
            for k, torque in ((5, "13"), (6, "15.7"), (7, "18.3"))
        ),
    ]


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"viscous": -1.0}, "joint 'panda_joint1' has a viscous friction .* of -1, expected >= 0"),
        ({"coulomb": np.nan}, "joint 'panda_joint1' has a Coulomb friction of nan, expected >= 0"),
        ({"viscous": [1.0, 2.0]}, r"viscous has shape \(2,\), expected \(nv,\) = \(7,\)"),
    ],
)
def test_friction_that_drives_a_joint_is_refused(given, sentence):
    with pytest.raises((InputError, ModelError), match=sentence):
        PANDA.with_friction(**given)


def test_urdf_friction_is_read_and_said(two_joints):
    robot = Robot.from_urdf(two_joints(joint=FRICTION))
    assert robot.viscous.tolist() == [0.6, 0.0]
    assert robot.coulomb.tolist() == [0.25, 0.0]
    assert notes(robot)[0].startswith(
        "joint friction is known: viscous 0 to 0.6 N m s/rad, Coulomb 0 to 0.25"
    )
    assert Robot.from_urdf(two_joints()).viscous.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("-1", r"joint 'a' has a viscous friction \(damping\) of -1, expected >= 0"),
        ("nan", "joint 'a' has damping or friction that is no finite number"),
        ("much", "joint 'a' has damping or friction that is no finite number"),
    ],
)
def test_urdf_friction_that_is_none_is_refused(two_joints, text, sentence):
    with pytest.raises(ModelError, match=sentence):
        Robot.from_urdf(two_joints(joint=f'<dynamics damping="{text}"/>'))
