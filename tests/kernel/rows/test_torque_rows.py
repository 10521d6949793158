"""Torque limits and free-swinging joints as rows: what the command's torque, recomputed, says."""

import numpy as np
import pytest

import ftqp
from ftqp.kernel.entry.session import ArmSession

Q = np.array([0.1, -0.5, 0.2, -2.0, 0.3, 1.6, 0.4])


def torque(arm, q, v, a):
    """M a + h at (q, v)."""
    arm.dynamics(q, v)
    return arm.K.kinematics.M[:7, :7] @ a + arm.K.kinematics.h[:7]


def swinging(planner, ticks):
    """Closed loop round the start, the tip drawn to and fro: step and recomputed torque of every tick."""
    robot, q, v = planner.robot, Q.copy(), np.zeros(7)
    planner.reset(q, v)
    p = robot.pose(q)[:3, 3].copy()
    aim, arm = ftqp.Target(position=p), ArmSession(robot.chain.constants())
    for k in range(ticks):
        aim.position[:] = p + np.array([0.0, 0.15, 0.15]) * np.sin(np.array([0.0, 5.0, 3.0]) * k * planner.dt)
        step = planner.step(q, v, aim)
        yield step, torque(arm, q, v, step.a)
        q, v = step.q.copy(), step.v.copy()


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
def test_torque_limits_are_kept_and_bind(level):
    robot = ftqp.robots.load("panda").with_limits(tau_max=[4.0, 34.0, 8.0, 21.0, 3.0, 3.0, 2.0])
    planner = ftqp.Planner(robot, 0.002, level=level, emergency=None, task=ftqp.Task(rows="position"))
    binding = 0
    for step, tau in swinging(planner, 600):
        assert np.abs(step.tau - tau).max() < 1e-9
        assert step.torque_excess == 0.0
        assert np.all(np.abs(tau) <= robot.limits.tau_max + 1e-6)
        binding += bool(np.any(np.abs(tau) > robot.limits.tau_max - 1e-6))
    assert binding > 10


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("damping", [0.0, 0.4, 50.0])
@pytest.mark.parametrize("joint", [0, 4, 6])
def test_torque_of_a_free_swinging_joint_is_exactly_its_friction(level, damping, joint):
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, 0.002, level=level, emergency=None, task=ftqp.Task(rows="position"))
    planner.report(ftqp.FreeSwinging(joint, damping=damping))
    for step, tau in swinging(planner, 200):
        assert abs(tau[joint] + damping * step.v[joint]) < 1e-8
        assert step.tau[joint] == 0.0 and step.tau_brake[joint] == 0.0


@pytest.mark.parametrize("level", ["acceleration", "velocity"])
@pytest.mark.parametrize("own", [0.4, 50.0])
def test_free_swinging_joint_keeps_its_own_friction_beside_that_of_the_fault(level, own):
    """At the velocity after the step, so that no friction is too strong; that of the others before it."""
    bare = ftqp.robots.load("panda").with_limits(tau_max=np.inf)
    robot = bare.with_friction(viscous=own)
    planner = ftqp.Planner(robot, 0.002, level=level, emergency=None, task=ftqp.Task(rows="position"))
    planner.report(ftqp.FreeSwinging(6, damping=0.1))
    arm, q, v = ArmSession(bare.chain.constants()), Q.copy(), np.zeros(7)
    planner.reset(q, v)
    p = robot.pose(q)[:3, 3]
    for k in range(200):
        aim = ftqp.Target(position=p + np.array([0.0, 0.15, 0.15]) * np.sin(np.array([0.0, 0.01, 0.006]) * k))
        step = planner.step(q, v, aim)
        tau = torque(arm, q, v, step.a)
        assert abs(tau[6] + (0.1 + own) * step.v[6]) < 1e-8
        assert np.abs(step.tau[:6] - tau[:6] - own * v[:6]).max() < 1e-8
        q, v = step.q.copy(), step.v.copy()
    assert np.abs(v).max() > 0.05


def test_motors_that_turn_against_friction_keep_their_limits():
    robot = ftqp.robots.load("panda").with_limits(tau_max=[10.0, 40.0, 10.0, 24.0, 4.0, 4.0, 2.0])
    rough, arm = robot.with_friction(viscous=2.0), ArmSession(robot.chain.constants())
    planner = ftqp.Planner(rough, 0.002, emergency=None, task=ftqp.Task(rows="position"))
    q, v, binding = Q.copy(), np.zeros(7), 0
    planner.reset(q, v)
    p = robot.pose(q)[:3, 3]
    for k in range(600):
        aim = ftqp.Target(position=p + np.array([0.0, 0.15, 0.15]) * np.sin(np.array([0.0, 0.01, 0.006]) * k))
        step = planner.step(q, v, aim)
        motor = torque(arm, q, v, step.a) + 2.0 * v
        assert step.torque_excess == 0.0
        assert np.all(np.abs(motor) <= robot.limits.tau_max + 1e-6)
        binding += bool(np.any(np.abs(motor) > robot.limits.tau_max - 1e-6))
        q, v = step.q.copy(), step.v.copy()
    assert binding > 10
