"""The URDF that every program gets is the robot it was written from."""

import numpy as np
import pinocchio as pin
import pytest
from bench.urdf import TIP, Arm, text

import ftqp


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
