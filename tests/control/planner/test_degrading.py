"""What is given up when a task cannot be done: with faults, in order, and back."""

import logging
import pickle

import numpy as np
import pytest
from tests.arm_at import arm_at
from tests.going import closed_loop, started, targets_along

import ftqp
from ftqp.core.pose import rotation_x, transform

DT = 2e-3
ALL = ("pose", "position_axis", "position")


def twisted(robot, angle):
    """The pose of the tip at the neutral posture, turned about its own z."""
    pose = robot.pose(robot.neutral)
    c, s = np.cos(angle), np.sin(angle)
    pose[:3, :3] = pose[:3, :3] @ [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    return ftqp.Target(pose=pose)


@pytest.fixture
def unable(panda):
    """A Panda that cannot turn its tool, as its last joint is locked and its range is narrow; its planner."""

    def made(**task):
        limits = panda.limits
        q = panda.neutral
        narrow = panda.with_limits(
            q_min=np.maximum(limits.q_min, q - 0.3), q_max=np.minimum(limits.q_max, q + 0.3)
        )
        planner = started(narrow, DT, task=ftqp.Task(**{"degrade": ALL} | task), emergency=None, at=q)
        return planner

    return made


def run(planner, target, seconds):
    steps = [(step, step.rows) for step in closed_loop(planner, target, round(seconds / DT))]
    return steps[-1][0], [rows for _, rows in steps]


@pytest.mark.parametrize("mode", ["slack", "hard", "lexicographic"])
def test_rotation_about_the_tool_axis_is_given_up_first(unable, caplog, mode):
    planner = unable(mode=mode)
    with caplog.at_level(logging.WARNING, "ftqp"):
        step, kept = run(planner, twisted(planner.robot, 1.2), 2.0)
    first = next(k for k, rows in enumerate(kept) if len(rows) == 5)
    assert first * DT >= 0.2 and len(kept[0]) == 6
    assert step.position_error < 1e-3 and len(step.rows) == 5
    assert caplog.messages == ["the task stays infeasible: the rotation about the tool axis is given up"]
    assert step.status is ftqp.StepStatus.RELAXED  # what is kept is met, and is less than what was asked for


def test_the_tip_stays_as_near_as_it_can_to_what_is_given_up(unable):
    planner = unable(degrade=("pose", "position"))
    goal = twisted(planner.robot, 1.2)
    step, kept = run(planner, goal, 2.0)
    whole = unable(degrade=())
    other, _ = run(whole, goal, 2.0)
    assert len(kept[-1]) == 3 and step.position_error < 1e-3 < other.position_error
    assert angle(planner.robot, step.q, goal) < angle(planner.robot, other.q, goal) + 0.05


def test_rows_are_taken_back_when_they_can_be_held_again(unable, caplog):
    planner = unable()
    away = np.linspace(0.0, 1.0, 3000)
    turn = np.concatenate([away, np.ones(500), away[::-1], np.zeros(1000)])
    rows, speeds = [], []
    with caplog.at_level(logging.WARNING, "ftqp"):
        for step in closed_loop(planner, lambda k: twisted(planner.robot, turn[k]), len(turn)):
            rows.append(len(step.rows))
            speeds.append(np.abs(step.v).max())
    assert min(rows) == 5 and rows[-1] == 6
    assert step.status is ftqp.StepStatus.OK and step.rotation_error < 1e-3
    assert caplog.messages[-1] == "the whole task can be held again: all its rows are back"
    assert caplog.messages[:-1] == ["the task stays infeasible: the rotation about the tool axis is given up"]
    assert max(speeds[-500:]) < 0.05


def test_a_target_that_jumps_within_reach_costs_no_rows(panda):
    pose = panda.pose(panda.neutral)
    pose[:3, 3] -= [0.15, 0.1, 0.1]
    for step in closed_loop(ftqp.Planner(panda, DT), ftqp.Target(pose=pose), 2000):
        assert len(step.rows) in (0, 6)  # none is told of an arm that lags
    assert step.status is ftqp.StepStatus.OK


def test_reset_asks_for_the_whole_task_again(unable):
    planner = unable(degrade=("pose", "position"))
    step, _ = run(planner, twisted(planner.robot, 1.2), 1.0)
    assert len(step.rows) == 3
    planner.reset(planner.robot.neutral)
    assert len(planner.task_rows) == 6


def angle(robot, q, goal):
    """How far the tip is turned from a target."""
    cosine = 0.5 * (np.trace(robot.pose(q)[:3, :3].T @ goal.pose[:3, :3]) - 1.0)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def test_joint_degraded_below_its_speed_brakes_with_no_more_than_it_has_left(panda, level):
    target = ftqp.Target(pose=panda.pose(panda.neutral))
    planner = ftqp.Planner(panda, DT, level=level, emergency=None)
    planner.report(ftqp.Degraded(0, velocity=0.1, acceleration=0.2))
    v0 = np.zeros(7)
    v0[0] = 0.9 * panda.limits.v_max[0]
    left, speed = 0.2 * panda.limits.a_max[0], v0[0]
    slow = 0.1 * panda.limits.v_max[0]
    for step in closed_loop(planner, target, 800, v=v0):
        assert abs(step.a[0]) <= left * (1.0 + 1e-9)
        if speed > slow + left * DT:
            assert step.a[0] == pytest.approx(-left, rel=1e-9)
        speed = step.v[0]
    assert abs(speed) <= slow + 1e-12


def test_arm_with_every_joint_locked_from_the_start_stops(panda, level, home):
    planner = ftqp.Planner(panda, DT, level=level)
    for joint in range(7):
        planner.report(ftqp.Locked(joint))
    target = ftqp.Target(pose=home)

    def leaving(k):
        target.position[:] = home[:3, 3] + [1e-3 * k, 0.0, 0.0]
        return target

    *_, last = closed_loop(planner, leaving, 80)
    assert last.status is ftqp.StepStatus.STOPPED


def test_joint_that_failed_outside_its_limits_blocks_nothing(panda, level):
    q = panda.neutral.copy()
    q[4] = panda.limits.q_max[4] + 0.05
    home = panda.pose(q)
    targets = targets_along(ftqp.paths.Line(home, [0.0, 0.05, 0.0], duration=1.0), 500, DT)
    planner = ftqp.Planner(panda, DT, level=level)
    planner.report(ftqp.Locked(4))
    steps = [s.copy() for s in closed_loop(planner, targets.at, 500, q=q)]
    assert {s.status for s in steps} == {ftqp.StepStatus.RELAXED}
    assert all(s.outside == ("panda_joint5",) and not s.certificate.unreached for s in steps)
    assert all(s.q[4] == q[4] for s in steps) and steps[-1].position_error < 1e-3


@pytest.mark.parametrize(
    "fault", [ftqp.Locked(3), ftqp.Degraded(3, velocity=0.5), ftqp.FreeSwinging(3, 1.0)], ids=str
)
def test_fault_may_be_reported_before_reset_and_survives_it(panda, home, fault):
    planner = ftqp.Planner(panda, DT)
    planner.report(fault)
    planner.reset(panda.neutral)
    planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home))
    planner.reset(panda.neutral)
    assert planner.faults == {"panda_joint4": fault}


@pytest.fixture(scope="module")
def turner():
    lengths = (0.3, 0.3, 0.3)
    return ftqp.robots.load("planar", lengths=lengths, continuous=True).with_limits(v_max=1.0, a_max=5.0)


@pytest.mark.parametrize("angles", [[0.3, 0.5, -0.4], [3.1, -0.5, -3.1]])
def test_configuration_and_angles_of_continuous_joints_give_the_same_command(turner, angles, level):
    assert turner.nq == 6 and turner.nv == 3
    q = np.array(angles)
    target = ftqp.Target(position=turner.pose(q)[:3, 3], twist=[0.05, 0.02, 0.0])
    commands = []
    for given in (q, turner.configuration(q)):
        planner = started(turner, DT, level=level, at=given)
        commands.append(planner.step(given, np.zeros(3), target).copy())
    np.testing.assert_allclose(commands[0].a, commands[1].a, atol=1e-10)
    np.testing.assert_allclose(commands[0].q, commands[1].q, atol=1e-12)


def test_continuous_joint_turns_past_half_a_turn_without_a_jump(turner, level):
    planner = ftqp.Planner(turner, DT, level=level, scheme="rmp", posture=[3.6, 0.5, 0.3], emergency=None)
    q = np.array([3.0, 0.5, 0.3])
    planner.reset(q)
    where = turner.pose([3.6, 0.5, 0.3])[:3, 3]
    passed = [q[0]]
    for _ in range(2000):
        q = planner.step(turner.configuration(q), None, ftqp.Target(position=where)).q.copy()
        passed.append(q[0])
    assert np.abs(np.diff(passed)).max() <= 1.0 * DT + 1e-12
    assert passed[-1] > np.pi + 0.2


LOAD = ftqp.Payload(1.5, com=(0.0, 0.02, 0.08), inertia=np.diag([0.01, 0.01, 0.005]))
PLACE = transform(rotation_x(0.3), np.array([0.0, 0.05, 0.1]))


def moved(planner, ticks, q=None, v=None):
    """A closed loop towards a point 10 cm aside of neutral, under way already: q, v and every step."""
    goal = np.array(planner.robot.pose(planner.robot.neutral))
    goal[1, 3] += 0.1
    steps = [step.copy() for step in closed_loop(planner, ftqp.Target(pose=goal), ticks, q, v, reset=False)]
    return steps[-1].q, steps[-1].v, steps


def test_load_taken_up_is_the_load_that_the_robot_was_made_with(panda):
    taken, made = started(panda, DT), started(panda.with_payload(LOAD), DT)
    taken.carry(LOAD)
    for one, other in zip(moved(taken, 60)[2], moved(made, 60)[2], strict=True):
        np.testing.assert_allclose(one.q, other.q, rtol=0.0, atol=1e-12)  # who adds the masses up rounds
        np.testing.assert_allclose(one.tau, other.tau, rtol=0.0, atol=1e-9)
    assert taken.payload is LOAD
    assert taken.robot.chain.mass.sum() == pytest.approx(panda.chain.mass.sum() + 1.5)


@pytest.mark.parametrize("torque_limits", [True, False], ids=["limited", "unlimited"])
def test_steps_of_before_tell_torques_of_the_arm_that_they_were_made_for(panda, level, torque_limits):
    planner = started(panda, DT, level=level, torque_limits=torque_limits)
    q, v, (*_, kept) = moved(planner, 5)
    at = arm_at(panda, *moved(started(panda, DT, level=level, torque_limits=torque_limits), 4)[:2])
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
    planner = started(panda, DT)
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
    planner = started(panda, DT, emergency=None)
    with caplog.at_level(logging.WARNING, "ftqp"):
        planner.carry(ftqp.Payload(30.0, com=(0.0, 0.0, 0.1)))
    (record,) = caplog.records
    assert record.getMessage() == (
        "panda: panda_joint6 needs 28.2 N m to hold the arm still here, beyond its limit of 12 N m, so the "
        "arm may sink; choose another posture, or correct the payload, the masses or "
        "robot.with_limits(tau_max=...)"
    )
    _, _, steps = moved(planner, 300)
    assert all(step.status is not ftqp.StepStatus.OK for step in steps)
    for step in steps:
        assert np.isfinite(step.q).all()
        assert np.all(np.abs(step.v) <= panda.limits.v_max + 1e-9)
        assert np.all(np.abs(step.a) <= panda.limits.a_max + 1e-9)
