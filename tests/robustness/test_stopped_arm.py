"""An arm that is said to have stopped has stopped, whatever is learnt of its joints afterwards."""

import numpy as np

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
