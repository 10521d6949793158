"""Friction holds a joint that works, behind a position servo or on a torque arm: it is not called locked."""

import numpy as np
import pytest
from tests.going import started
from tests.servo_arm import TorqueArm

import ftqp
from ftqp.sim.plants.joint_servo import Gains, GainServo
from ftqp.sim.plants.plant import Arm

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


@pytest.mark.long
@pytest.mark.parametrize(("joint", "share", "sticks"), [(3, 0.65, 0.01), (3, 0.8, 0.02), (5, 0.5, 0.02)])
def test_joint_that_its_load_draws_down_at_the_start_has_not_shown_its_friction(joint, share, sticks):
    robot, rng = ftqp.robots.load("panda"), np.random.default_rng(3)
    weight = abs(Arm(robot).dynamics(robot.neutral, np.zeros(7))[1][joint])
    inertia = float(np.diag(robot.mass_matrix(robot.neutral))[joint])
    bandwidth = dict.fromkeys(robot.joints, 150.0)
    bandwidth[robot.joints[joint]] = float(np.sqrt(share * weight / (sticks * inertia)))
    gains = Gains(bandwidth=bandwidth, weight=False, takes_velocity=False)
    true = ftqp.TrueArm(coulomb={robot.joints[joint]: share * weight})
    plant = ftqp.MujocoPlant(robot, DT, GainServo(robot, "position", gains, DT / 4), true)
    plant.reset(robot.neutral, np.zeros(7))
    planner, target = ftqp.Planner(robot, DT), ftqp.Target(pose=robot.pose(robot.neutral))
    planner.reset(robot.neutral)
    way = ftqp.paths.Circle(robot.pose(robot.neutral), 0.1, duration=4.0, axes=("y", "z"))
    path = way.sample(DT * np.arange(round(4.0 / DT)))
    for pose, twist, acceleration in zip(path.pose, path.twist, path.acceleration, strict=True):
        target.at(pose, twist, acceleration)
        plant.advance(planner.step(plant.q + 2e-5 * rng.standard_normal(7), None, target))
    assert not planner.findings and planner.stopped_because is None
    assert np.linalg.norm(robot.pose(plant.q)[:3, 3] - path.pose[-1][:3, 3]) < 1e-3


@pytest.mark.long
def test_joint_of_a_torque_arm_that_the_friction_of_its_model_holds_is_not_called_locked():
    """A third of its torque limit holds it one way and then the other, while the arm goes round."""
    panda, dt, joint = ftqp.robots.load("panda"), 1e-3, 4
    dry = panda.limits.tau_max / 3.0 * (np.arange(7) == joint)
    robot = panda.with_friction(coulomb=dry)
    arm = TorqueArm(robot, robot.neutral, dt, friction=dry, sigma=2e-5)
    planner = started(robot, dt=dt, at=robot.neutral, drive="torque")
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.06, duration=3.0).sample(dt * np.arange(3001))
    targets = ftqp.Targets(path.pose, path.twist, path.acceleration)
    for k in range(3500):
        arm.command(planner.step(arm.measured(), None, targets.at(min(k, 3000))))
    assert not planner.findings and planner.stopped_because is None
