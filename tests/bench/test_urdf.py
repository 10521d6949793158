"""The URDF that every program gets is the robot it was written from."""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from bench import cases
from bench.urdf import TIP, Arm, roll_pitch_yaw, text

import ftqp


def _rotation(angles: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return pin.rpy.rpyToMatrix(*angles)


@pytest.mark.parametrize("pitch", [-np.pi / 2, -1.0, 0.0, 0.7, np.pi / 2])
def test_roll_pitch_yaw_gives_the_rotation_back(pitch: float) -> None:
    rotation = _rotation(np.array([0.3, pitch, -2.1]))
    np.testing.assert_allclose(_rotation(roll_pitch_yaw(rotation)), rotation, atol=1e-12)


@pytest.mark.parametrize("name", ["panda", "iiwa14"])
def test_a_catalog_robot_survives_the_text(name: str) -> None:
    robot = ftqp.robots.load(name)
    arm = Arm.of(robot)
    again = ftqp.Robot.from_urdf(text(name, arm), tip=TIP, acceleration=arm.a_max)
    rng = np.random.default_rng(1)
    q = rng.uniform(robot.limits.q_min, robot.limits.q_max)
    v = rng.normal(size=robot.nv)
    np.testing.assert_allclose(again.pose(q), robot.pose(q), atol=1e-12)
    torques = [pin.rnea(r.model, r.model.createData(), q, v, v) for r in (robot, again)]
    np.testing.assert_allclose(torques[1], torques[0], atol=1e-9)
    for limit in ("q_min", "q_max", "v_max", "a_max", "tau_max"):
        np.testing.assert_array_equal(getattr(again.limits, limit), getattr(robot.limits, limit))


def test_chain30_has_30_joints_that_alternate_and_a_reach_of_3_metres() -> None:
    arm = cases.chain30()
    robot = ftqp.Robot.from_urdf(text("chain30", arm), tip=TIP, acceleration=arm.a_max)
    assert robot.nv == 30
    np.testing.assert_allclose(robot.pose(np.zeros(30))[:3, 3], [0.0, 0.0, 3.0], atol=1e-12)
    data = robot.model.createData()
    pin.computeJointJacobians(robot.model, data, np.zeros(30))
    axes = np.abs(data.J[3:].T)
    np.testing.assert_allclose(axes[0::2], np.tile([0.0, 0.0, 1.0], (15, 1)), atol=1e-12)
    np.testing.assert_allclose(axes[1::2], np.tile([0.0, 1.0, 0.0], (15, 1)), atol=1e-12)
