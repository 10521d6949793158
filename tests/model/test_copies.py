"""Load, tool and friction in copies of a robot."""

import numpy as np
import pytest
from tests.arm_at import arm_at

import ftqp
from ftqp.core.errors import ModelError
from ftqp.model.robot import Robot

LOAD = ftqp.Payload(1.5, com=(0.02, -0.03, 0.1), inertia=np.diag([0.01, 0.02, 0.015]))
Q = [0.3, -0.5, 0.4, -1.9, 0.2, 1.6, 0.5]
V = [0.4, -0.3, 0.5, 0.2, -0.6, 0.7, -0.8]


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


PANDA = ftqp.robots.load("panda")


def notes(robot):
    return [finding.sentence for finding in robot.findings if finding.about == "friction"]


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
