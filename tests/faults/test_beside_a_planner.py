"""A detector beside a planner that learns its arm: what the arm has beside its model is no fault."""

import numpy as np
import pytest
from tests.ride import circle, target_at
from tests.servo_arm import TorqueArm

import ftqp

DT, NOISE = 1e-3, 1e-4


def shown(robot, seconds, axes, fault=None, at=0.5, **truth):
    """The planner after so long on a circle, with an arm whose truth is other than its model."""
    rng = np.random.default_rng(1)
    plant = ftqp.MujocoPlant(robot, DT, ftqp.JointServo(robot, "torque"), ftqp.TrueArm(**truth))
    planner = ftqp.Planner(robot, DT, drive="torque", noise=ftqp.Noise(q=NOISE), detector=ftqp.Detector())
    plant.reset(robot.neutral, np.zeros(robot.nv))
    planner.reset(robot.neutral)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.1, duration=4.0, axes=axes)
    way, target = path.sample(DT * np.arange(round(seconds / DT))), ftqp.Target(pose=path.start)
    for k in range(len(way.pose)):
        if fault is not None and k == round(at / DT):
            plant.fail(fault)
        target.at(way.pose[k], way.twist[k], way.acceleration[k])
        step = planner.step(plant.q + NOISE * rng.standard_normal(robot.nv), None, target)
        if planner.findings:
            break
        plant.advance(step)
    return planner


@pytest.fixture(scope="module")
def rubbing(robot):
    return {"rotors": 0.1, "coulomb": {name: 3.0 if i < 4 else 0.75 for i, name in enumerate(robot.joints)}}


@pytest.mark.parametrize("axes", [("y", "z"), ("x", "y"), ("x", "z")], ids=str)
def test_a_joint_that_works_is_not_named_for_friction_and_rotors_that_nobody_told_of(robot, rubbing, axes):
    assert shown(robot, 1.0, axes, **rubbing).findings == ()


def test_a_joint_of_such_an_arm_that_locks_is_named(robot, rubbing):
    planner = shown(robot, 1.2, ("x", "y"), ftqp.Locked(3), **rubbing)
    assert [(one.joint, "locked" in one.kinds) for one in planner.findings] == [("panda_joint4", True)]


@pytest.mark.parametrize("joint", [0, 2])
def test_soft_joint_that_stops_on_its_way_is_named_whatever_friction_it_may_have(joint):
    """Its motor is not pushed as far as friction might hold: the arm went on until it stopped 0.16 m away."""
    robot, task = ftqp.robots.load("iiwa14"), ftqp.Task(rows="position")
    noise, detector = ftqp.Noise(q=NOISE), ftqp.Detector()
    planner = ftqp.Planner(robot, DT, drive="torque", noise=noise, task=task, detector=detector)
    true = robot.with_rotors(robot.chain.armature + 0.1)
    arm = TorqueArm(true, robot.neutral, DT, mass=0.9, friction=0.3, sigma=NOISE)
    planner.reset(arm.q.copy())
    path = circle(robot, robot.neutral, 0.08)
    for k in range(2000):
        arm.braked[joint] = k >= 1500
        arm.command(planner.step(arm.measured(), None, target_at(path, DT * k)))
    named = [(one.joint, "locked" in one.kinds) for one in planner.findings]
    assert named == [(robot.joints[joint], True)]
