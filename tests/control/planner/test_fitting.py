"""Loads and tools that are changed while the planner drives the arm."""

import logging
import pickle

import numpy as np
import pytest
from tests.arm_at import arm_at

import ftqp
from ftqp.core.pose import rotation_x, transform

LOAD = ftqp.Payload(1.5, com=(0.0, 0.02, 0.08), inertia=np.diag([0.01, 0.01, 0.005]))
PLACE = transform(rotation_x(0.3), np.array([0.0, 0.05, 0.1]))
DT = 2e-3


def started(robot, **settings):
    planner = ftqp.Planner(robot, DT, **settings)
    planner.reset(robot.neutral)
    return planner


def moved(planner, ticks, q=None, v=None):
    """A closed loop towards a point 10 cm aside of neutral, under way already: q, v and every step."""
    robot = planner.robot
    goal = np.array(robot.pose(robot.neutral))
    goal[1, 3] += 0.1
    q = robot.neutral.copy() if q is None else q
    v, steps = np.zeros(robot.nv) if v is None else v, []
    for _ in range(ticks):
        steps.append(planner.step(q, v, ftqp.Target(pose=goal)).copy())
        q, v = steps[-1].q, steps[-1].v
    return q, v, steps


def test_load_taken_up_is_the_load_that_the_robot_was_made_with(panda):
    taken, made = started(panda), started(panda.with_payload(LOAD))
    taken.carry(LOAD)
    for one, other in zip(moved(taken, 60)[2], moved(made, 60)[2], strict=True):
        np.testing.assert_allclose(one.q, other.q, rtol=0.0, atol=1e-12)  # who adds the masses up rounds
        np.testing.assert_allclose(one.tau, other.tau, rtol=0.0, atol=1e-9)
    assert taken.payload is LOAD
    assert taken.robot.chain.mass.sum() == pytest.approx(panda.chain.mass.sum() + 1.5)


@pytest.mark.parametrize("torque_limits", [True, False], ids=["limited", "unlimited"])
def test_steps_of_before_tell_torques_of_the_arm_that_they_were_made_for(panda, level, torque_limits):
    planner = started(panda, level=level, torque_limits=torque_limits)
    q, v, (*_, kept) = moved(planner, 5)
    at = arm_at(panda, *moved(started(panda, level=level, torque_limits=torque_limits), 4)[:2])
    live = planner.step(q, v, ftqp.Target(pose=panda.pose(panda.neutral)))
    expected = arm_at(panda, q, v)
    planner.carry(LOAD)
    late = live.copy()
    planner.tool(PLACE)
    np.testing.assert_allclose(kept.tau, at.M @ kept.a + at.h, atol=1e-9)
    for step in (live, late, pickle.loads(pickle.dumps(late))):
        np.testing.assert_allclose(step.tau, expected.M @ step.a + expected.h, atol=1e-9)
    q, v = live.q.copy(), live.v.copy()
    live = planner.step(q, v, ftqp.Target(pose=planner.robot.pose(q)))
    loaded = arm_at(panda.with_payload(LOAD), q, v)
    np.testing.assert_allclose(live.tau, loaded.M @ live.a + loaded.h, atol=1e-9)


def test_tool_is_the_point_that_is_led_and_the_load_stays_where_it_is(panda):
    planner = started(panda)
    planner.carry(LOAD)
    planner.tool(PLACE)
    np.testing.assert_allclose(
        planner.robot.pose(panda.neutral), panda.pose(panda.neutral) @ PLACE, atol=1e-12
    )
    np.testing.assert_allclose(
        arm_at(planner.robot, panda.neutral).M, arm_at(panda.with_payload(LOAD), panda.neutral).M, atol=1e-12
    )
    step = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=panda.pose(panda.neutral) @ PLACE))
    assert step.position_error < 1e-12
    planner.tool(None)
    step = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=panda.pose(panda.neutral)))
    assert step.position_error < 1e-12


def test_load_that_is_too_heavy_is_said_once_and_the_arm_goes_on_within_its_limits(panda, caplog):
    planner = started(panda, emergency=None)
    with caplog.at_level(logging.WARNING, "ftqp"):
        planner.carry(ftqp.Payload(30.0, com=(0.0, 0.0, 0.1)))
    (record,) = caplog.records
    assert record.getMessage() == (
        "panda: panda_joint6 needs 28.2 N m to hold the arm at rest here, beyond its limit of 12 N m, so the "
        "arm may sink; choose another posture, or correct the payload, the masses or "
        "robot.with_limits(tau_max=...)"
    )
    _, _, steps = moved(planner, 300)
    assert all(step.status is not ftqp.StepStatus.OK for step in steps)
    for step in steps:
        assert np.isfinite(step.q).all()
        assert np.all(np.abs(step.v) <= panda.limits.v_max + 1e-9)
        assert np.all(np.abs(step.a) <= panda.limits.a_max + 1e-9)
