"""Joints that follow others in physics: tied to their leaders, without motors, and locked with them."""

import numpy as np
import pytest
from tests.telescope import telescope

import ftqp

pytest.importorskip("mujoco", reason="needs MuJoCo: pip install 'ftqp[sim]'")

from ftqp.sim.plants.mujoco_plant import MujocoPlant

START = np.array([0.3, 0.2, 0.12, 0.5, -0.05, 0.2, 0.9, 0.3])


@pytest.mark.parametrize("joint", [None, "elbow", "lift"])
def test_an_arm_with_mimic_joints_follows_its_path_in_physics_also_when_one_locks(joint):
    robot = ftqp.Robot.from_urdf(telescope(), "tool")
    planner = ftqp.Planner(robot, task=ftqp.Task("position"), drive=ftqp.Drive(bandwidth=94.0))
    plant = MujocoPlant(robot, 1e-3)
    planner.reset(START)
    plant.reset(START, np.zeros(8))
    path = ftqp.paths.Circle(robot.pose(START), radius=0.03, duration=3.0)
    sampled = path.sample(0.001 * np.arange(1600))
    targets = ftqp.Targets(sampled.pose, sampled.twist, sampled.acceleration)
    worst = tied = 0.0
    for k in range(1600):
        if k == 700 and joint is not None:
            plant.fail(ftqp.Locked(joint))
            planner.report(ftqp.Locked(joint))
        step = planner.step(plant.q, None, targets.at(k))
        plant.advance(step)
        image = robot.chain.ratio * plant.q[robot.chain.lead] + robot.chain.offset
        tied = max(tied, np.abs(image - plant.q).max())
        worst = max(worst, step.position_error)
        assert not plant.tau[[2, 4]].any()
    assert step.status is ftqp.StepStatus.OK and tied < 1e-6
    assert worst < (1e-4 if joint is None else 8e-3) and step.position_error < 1e-3
    if joint is not None:
        assert abs(plant.v[robot.joint(joint)]) < 1e-4
