"""Friction of a joint behind a position servo that nobody described: it sticks, turns round, and works."""

import numpy as np
import pytest

import ftqp
from ftqp.sim.plants.joint_servo import Gains, GainServo

DT, JOINT, BANDWIDTH, STICKS = 2e-3, 5, 60.0, 0.012
pytest.importorskip("mujoco")


@pytest.mark.long
def test_joint_that_sticks_and_turns_round_is_not_called_locked_and_shows_its_friction():
    robot = ftqp.robots.load("panda")
    inertia = float(np.diag(robot.mass_matrix(robot.neutral))[JOINT])
    stuck = {robot.joints[JOINT]: STICKS * inertia * BANDWIDTH**2}  # holds the servo off by STICKS rad
    servo = GainServo(robot, "position", Gains(bandwidth=BANDWIDTH), DT / 4)
    plant = ftqp.MujocoPlant(robot, DT, servo, ftqp.TrueArm(coulomb=stuck))
    plant.reset(robot.neutral, np.zeros(7))
    planner, rng = ftqp.Planner(robot, DT), np.random.default_rng(3)
    planner.reset(robot.neutral)
    for way in (0.3, -0.3, 0.25, -0.25):
        goal = robot.neutral.copy()
        goal[JOINT] += way
        goto = ftqp.GoTo(planner, q=goal)
        for _ in range(round(3.0 / DT)):
            plant.advance(goto.step(plant.q + 2e-5 * rng.standard_normal(7), None))
    assert not planner.findings and planner.stopped_because is None
    assert abs(plant.q[JOINT] - goal[JOINT]) < 2e-3
    friction = planner.known.K.monitor.theta[JOINT, 2]
    assert friction == pytest.approx(STICKS, rel=0.35)
