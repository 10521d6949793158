"""Computed torque around a reference."""

import numpy as np
import pinocchio
import pytest
from tests.ride import DT, START, circle, target_at
from tests.servo_arm import TorqueArm

import ftqp
from ftqp.control.planner.step_parts import Reference


def test_it_is_the_inverse_dynamics_of_the_corrected_acceleration():
    robot, rng = ftqp.robots.load("panda"), np.random.default_rng(3)
    q, v = START + 0.1 * rng.normal(size=7), 0.1 * rng.normal(size=7)
    reference = Reference(q + 1e-3 * rng.normal(size=7), v + 1e-2 * rng.normal(size=7), rng.normal(size=7))
    a = reference.a + 900.0 * (reference.q - q) + 60.0 * (reference.v - v)
    model, data = robot.model, robot.model.createData()
    expected = pinocchio.rnea(model, data, q, v, a)
    np.testing.assert_allclose(
        ftqp.ComputedTorque(robot, 30.0).torques(reference, q, v), expected, atol=1e-10
    )


@pytest.mark.long
def test_it_holds_a_torque_arm_to_a_planner_that_sends_positions():
    robot = ftqp.robots.load("panda")
    planner, arm = ftqp.Planner(robot, DT), TorqueArm(robot, START, DT, mass=0.2)
    law, path, worst = ftqp.ComputedTorque(robot, bandwidth=60.0), circle(robot, START, 0.05, 2.0), 0.0
    planner.reset(START)
    for k in range(2000):
        target = target_at(path, k * DT)
        step = planner.step(arm.q, None, target)
        worst = max(worst, np.linalg.norm(robot.pose(arm.q)[:3, 3] - target.position))
        sent = type("Sent", (), {"tau": law.torques(step.reference, arm.q, arm.v)})
        arm.command(sent)
    assert worst < 3e-3


def test_wrong_arguments_are_one_sentence():
    with pytest.raises(ftqp.InputError, match="computed torque needs inertia, which srs7 has not"):
        ftqp.ComputedTorque(ftqp.robots.load("srs7"))
    with pytest.raises(ftqp.InputError, match="bandwidth is 0"):
        ftqp.ComputedTorque(ftqp.robots.load("panda"), 0.0)
