import numpy as np
import pinocchio as pin
import pytest

from ftqp.model import catalog
from ftqp.model.robot import Robot
from ftqp.sim.plants.plant import Arm


@pytest.mark.parametrize("rotor", [0.0, 0.3])
@pytest.mark.parametrize("name", ["panda", "planar6", "srs7"])
def test_arm_agrees_with_pinocchio(name, rotor):
    model = catalog.load(name).model.copy()
    model.armature = np.full(model.nv, rotor)
    robot = Robot.from_pinocchio(model)
    rng = np.random.default_rng(3)
    arm = Arm(robot)
    for _ in range(5):
        q, v = rng.normal(size=robot.nv), rng.normal(size=robot.nv)
        np.testing.assert_allclose(arm.tip(q), robot.pose(q), atol=1e-12)
        M, h = arm.dynamics(q, v)
        a = rng.normal(size=robot.nv)
        tau = pin.rnea(robot.model, robot.model.createData(), robot.configuration(q), v, a)
        np.testing.assert_allclose(M @ a + h, tau, atol=1e-9)
