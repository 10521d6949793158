"""Load, tool and friction in copies of a robot."""

import numpy as np
import pytest
from tests.arm_at import arm_at

import ftqp
from ftqp.core.errors import InputError, ModelError
from ftqp.core.pose import rotation_x, transform
from ftqp.model.robot import Robot

LOAD = ftqp.Payload(1.5, com=(0.02, -0.03, 0.1), inertia=np.diag([0.01, 0.02, 0.015]))
Q = [0.3, -0.5, 0.4, -1.9, 0.2, 1.6, 0.5]
V = [0.4, -0.3, 0.5, 0.2, -0.6, 0.7, -0.8]


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"mass": 0.0}, "mass is 0, expected a finite number > 0 kg"),
        ({"mass": -1.0}, "mass is -1, expected a finite number > 0 kg"),
        ({"mass": np.nan}, "mass is nan, expected"),
        ({"mass": np.inf}, "mass is inf, expected"),
        ({"mass": "heavy"}, "mass is 'heavy', expected a number in kg"),
        ({"mass": 1.0, "com": (0.0, 1.0)}, r"com has shape \(2,\), expected \(3,\)"),
        ({"mass": 1.0, "com": (0.0, np.nan, 0.0)}, "com contains NaN at index 1"),
        ({"mass": 1.0, "inertia": [1.0, 1.0, 1.0]}, r"inertia has shape \(3,\), expected \(3, 3\)"),
        ({"mass": 1.0, "inertia": np.diag([1.0, 1.0, -0.1])}, "principal moments -0.1, 1, 1 kg m2, which no"),
        ({"mass": 1.0, "inertia": np.diag([1.0, 1.0, 3.0])}, "principal moments 1, 1, 3 kg m2, which no"),
        ({"mass": 1.0, "inertia": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}, "inertia is not symmetric"),
        ({"mass": 1e308}, r"mass of a payload is 1e\+308 kg, expected at most 1e\+06 kg; look at its unit"),
        ({"mass": 1.0, "com": (0.0, -1e308, 0.0)}, r"com of a payload is 1e\+308 m, expected at most 1000 m"),
        (
            {"mass": 1.0, "inertia": 1e308 * np.eye(3)},
            r"inertia of a payload is 1e\+308 kg m2, expected at most",
        ),
    ],
)
def test_what_no_rigid_body_is_is_refused(given, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.Payload(**given)


def test_the_heaviest_load_has_torques_that_are_numbers():
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, 1e-3, drive="torque")
    planner.carry(ftqp.Payload(1e6, com=(1e3, 1e3, 1e3), inertia=1e12 * np.eye(3)))
    planner.reset(robot.neutral)
    for _ in range(20):
        step = planner.step(robot.neutral, None, ftqp.Target(pose=robot.pose(robot.neutral)))
        assert (abs(step.tau) <= robot.limits.tau_max).all()
    assert np.isfinite(planner.robot.bias(robot.neutral, V)).all()


def test_load_adds_its_own_kinetic_energy_and_weight():
    """By the bare arm's Jacobian: 1/2 m v_com' v_com + 1/2 w' R I R' w, and m g times the height's slope."""
    bare = ftqp.robots.load("panda")
    empty, full = arm_at(bare, Q, V), arm_at(bare.with_payload(LOAD), Q, V)
    T = bare.pose(Q)
    lever = T[:3, :3] @ LOAD.com
    twist = empty.J @ V
    speed = twist[:3] + np.cross(twist[3:], lever)
    turn = T[:3, :3].T @ twist[3:]
    energy = 0.5 * LOAD.mass * speed @ speed + 0.5 * turn @ LOAD.inertia @ turn
    assert 0.5 * np.array(V) @ (full.M - empty.M) @ V == pytest.approx(energy, rel=1e-10)
    rest_empty, rest_full = arm_at(bare, Q), arm_at(bare.with_payload(LOAD), Q)
    slope = np.array([0.0, 0.0, 9.81 * LOAD.mass])
    pull = empty.J[:3].T @ slope + empty.J[3:].T @ np.cross(lever, slope)
    np.testing.assert_allclose(rest_full.h - rest_empty.h, pull, atol=1e-11)


def test_robot_without_masses_and_what_is_no_payload_are_refused():
    with pytest.raises(InputError, match="puma560 has no masses, so a payload means nothing to it"):
        ftqp.robots.load("puma560").with_payload(LOAD)
    with pytest.raises(
        InputError, match=r"payload is 0.5, expected an ftqp.Payload, ftqp.Payload\(mass=0.5\)"
    ):
        ftqp.robots.load("panda").with_payload(0.5)


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
