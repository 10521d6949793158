"""Arms that once crept, sank or swung where they should rest."""

import numpy as np
import pytest
from tests.going import closed_loop

import ftqp

DT = 2e-3
SWINGS = 5
"""The joint that swings."""


def swinging_and_stopped(robot, level):
    """A planner that has stopped an arm, a joint of which then swings, and the state of that arm."""
    planner = ftqp.Planner(robot, DT, level=level, emergency=None)
    q, v = robot.neutral.copy(), np.zeros(robot.nv)
    planner.reset(q, v)
    planner.stop()
    target = ftqp.Target(pose=robot.pose(q))
    assert planner.step(q, v, target).status is ftqp.StepStatus.STOPPED
    planner.report(ftqp.FreeSwinging(SWINGS))
    for _ in range(60):
        step = planner.step(q, v, target)
        faster = np.abs(step.reference.v / robot.limits.v_max)
        faster[SWINGS] = 0.0
        assert step.status is not ftqp.StepStatus.STOPPED or faster.max() < 5e-3
        q, v = step.reference.q.copy(), step.reference.v.copy()
    assert abs(v[SWINGS]) > 0.1
    return planner, q, v, target


def test_arm_that_catches_a_joint_that_failed_after_the_stop_is_not_said_to_rest(level):
    swinging_and_stopped(ftqp.robots.load("panda"), level)


def test_stop_of_a_joint_outside_its_range_keeps_an_acceleration_limit_that_was_just_lowered():
    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, emergency=None)
    q, v = robot.neutral.copy(), np.zeros(robot.nv)
    q[SWINGS], v[SWINGS] = robot.limits.q_max[SWINGS] + 0.1, 2.0
    planner.reset(q, v)
    planner.stop()
    target = ftqp.Target(pose=robot.pose(robot.neutral))
    for tick in range(60):
        if tick == 40:
            planner.report(ftqp.Degraded(SWINGS, acceleration=0.5))
        step = planner.step(q, v, target)
        q, v = step.reference.q.copy(), step.reference.v.copy()
        share = 1.0 if tick < 40 else 0.5
        assert abs(step.a[SWINGS]) <= share * robot.limits.a_max[SWINGS] * (1.0 + 1e-9)


def test_joint_that_is_mended_while_it_swings_is_braked_under_the_status_stopping(level):
    robot = ftqp.robots.load("panda")
    planner, q, v, target = swinging_and_stopped(robot, level)
    planner.withdraw(SWINGS)
    for _ in range(400):
        step = planner.step(q, v, target)
        q, v = step.reference.q.copy(), step.reference.v.copy()
        moves = np.abs(v / robot.limits.v_max).max() > 5e-3
        assert step.status is (ftqp.StepStatus.STOPPING if moves else step.status)
    assert step.status is ftqp.StepStatus.STOPPED and not moves


@pytest.mark.parametrize("burden", [ftqp.Degraded(1, torque=0.05), ftqp.Payload(mass=22.0)])
def test_arm_that_cannot_carry_its_load_comes_to_rest(level, burden):
    """To lessen an excess of torque that nothing removes, healthy joints swung at their limits for ever."""
    robot = ftqp.robots.load("xarm7")
    rng = np.random.default_rng(0)
    span = robot.limits.q_max - robot.limits.q_min
    q = np.clip(robot.neutral + rng.uniform(-0.15, 0.15, 7) * span, robot.limits.q_min, robot.limits.q_max)
    planner = ftqp.Planner(robot, DT, level=level)
    planner.reset(q)
    if isinstance(burden, ftqp.Payload):
        planner.carry(burden)
    else:
        planner.report(burden)
    pose = robot.pose(q).copy()
    pose[:3, 3] += 0.1 * rng.normal(size=3)
    target = ftqp.Target(pose=pose)
    *_, step = closed_loop(planner, target, 200, q, reset=False)
    planner.stop()
    *_, step = closed_loop(planner, target, round(6.0 / DT), step.q, reset=False)
    assert step.status is ftqp.StepStatus.STOPPED
    rest = closed_loop(planner, target, 500, step.q, reset=False)
    assert max(np.abs(step.v).max() for step in rest) < 1e-12


def speeds(planner, q, pose, seconds, *, dead=None):
    """The largest share of its velocity limit that a joint has in each tick; ``dead`` does not move."""
    target = ftqp.Target(pose=pose)
    q, v = np.array(q), np.zeros(len(q))
    planner.reset(q)
    fastest = np.zeros(round(seconds / planner.dt))
    for k in range(len(fastest)):
        step = planner.step(q, v, target)
        moved, v = step.q.copy(), step.v.copy()
        if dead is not None:
            moved[dead], v[dead] = q[dead], 0.0
        q = moved
        fastest[k] = np.abs(v / planner.robot.limits.v_max).max()
    return fastest


def beside(robot, way):
    pose = robot.pose(robot.neutral).copy()
    pose[:3, 3] += way
    return pose


def test_torque_norm_lets_the_self_motion_of_an_arm_that_has_arrived_come_to_rest():
    robot = ftqp.robots.load("xarm7")
    task = ftqp.Task(rows="position")
    planner = ftqp.Planner(robot, DT, level="acceleration", scheme="dlsm", task=task)
    pose = beside(robot, (0.05, 0.25, 0.1))
    moving = speeds(planner, robot.neutral, pose, 6.0)
    assert moving[round(1.5 / DT) : round(2.0 / DT)].max() > 0.05, "this case is to have a self-motion"
    assert moving[round(5.0 / DT) :].max() < 1e-3


def test_an_unseen_lock_does_not_keep_an_arm_swinging_that_never_stops_of_its_own_accord():
    robot = ftqp.robots.load("xarm7")
    planner = ftqp.Planner(robot, 0.005, level="acceleration", emergency=None)
    moving = speeds(planner, robot.neutral, beside(robot, (0.05, -0.1, 0.05)), 12.0, dead=6)
    assert moving[round(10.0 / 0.005) :].max() < 0.01


def test_a_slow_arm_on_a_long_way_does_not_swing():
    robot = ftqp.robots.load("planar6")
    task = ftqp.Task(rows="position")
    planner = ftqp.Planner(robot, DT, level="velocity", task=task, emergency=None)
    moving = speeds(planner, robot.neutral, beside(robot, (-1.8, -1.9, 0.0)), 4.0)
    K = planner.session().K
    assert moving[round(3.0 / DT) :].max() > 0.5 and K.settling.stood > 3.5
    assert K.settling.gradient_suppressed == 0
