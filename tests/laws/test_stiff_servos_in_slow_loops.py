"""Servos that are faster than the loop above them: they go there at once and wait, faster than was asked."""

import numpy as np
import pytest

import ftqp
from ftqp.sim.plants.joint_servo import Gains, GainServo

DT, BANDWIDTH, JITTER, FAST = 0.01, 300.0, 0.5, 1.02
pytest.importorskip("mujoco")


def test_joint_of_a_stiff_servo_keeps_its_speed_limit_between_commands_that_come_late():
    robot = ftqp.robots.load("panda").with_limits(v_max=np.full(7, 0.4))
    servo = GainServo(robot, "position", Gains(bandwidth=BANDWIDTH, damping=0.6), DT / 20)
    plant = ftqp.MujocoPlant(robot, DT, servo, ftqp.TrueArm(jitter=JITTER), substeps=20, seed=1)
    plant.reset(robot.neutral, np.zeros(7))
    planner, rng = ftqp.Planner(robot, DT), np.random.default_rng(3)
    planner.reset(robot.neutral)
    goal = robot.neutral + np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    goto, fastest = ftqp.GoTo(planner, q=goal), np.zeros(7)
    for _ in range(round(6.0 / DT)):
        plant.advance(goto.step(plant.q + 2e-5 * rng.standard_normal(7), None))
        fastest = np.maximum(fastest, np.abs(plant.v) / robot.limits.v_max)
    assert np.abs(plant.q - goal).max() < 2e-3 and not planner.findings
    assert fastest.max() < FAST
