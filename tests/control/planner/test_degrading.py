"""Rows that are given up where the task stays infeasible, and taken back."""

import logging

import numpy as np
import pytest

import ftqp

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
        planner = ftqp.Planner(narrow, DT, task=ftqp.Task(**{"degrade": ALL} | task), emergency=None)
        planner.reset(q)
        return planner

    return made


def run(planner, target, seconds):
    q, v = planner.robot.neutral.copy(), np.zeros(7)
    kept = []
    for _ in range(round(seconds / DT)):
        step = planner.step(q, v, target)
        kept.append(step.rows)
        q, v = step.q.copy(), step.v.copy()
    return step, kept


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


@pytest.mark.parametrize("lock", [False, True])
def test_nothing_is_given_up_unless_it_is_asked_for(unable, lock):
    for degrade, rows in ((None, 6), (ALL, 5)):
        planner = unable(degrade=degrade)
        assert planner.given_up is None
        if lock:
            planner.report(ftqp.Locked(6))
        step, _ = run(planner, twisted(planner.robot, 1.2), 1.5)
        assert len(step.rows) == rows
        assert rows == 6 or planner.given_up.startswith("the rotation about the tool axis is given up")


def test_a_task_whose_rows_all_count_gives_up_none(unable):
    planner = unable(degrade=())
    step, _ = run(planner, twisted(planner.robot, 1.2), 1.0)
    assert len(step.rows) == 6 and step.status is ftqp.StepStatus.RELAXED


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
    q, v = planner.robot.neutral.copy(), np.zeros(7)
    away = np.linspace(0.0, 1.0, 3000)
    turn = np.concatenate([away, np.ones(500), away[::-1], np.zeros(1000)])
    rows, speeds = [], []
    with caplog.at_level(logging.WARNING, "ftqp"):
        for angle_now in turn:
            step = planner.step(q, v, twisted(planner.robot, angle_now))
            rows.append(len(step.rows))
            q, v = step.q.copy(), step.v.copy()
            speeds.append(np.abs(v).max())
    assert min(rows) == 5 and rows[-1] == 6
    assert step.status is ftqp.StepStatus.OK and step.rotation_error < 1e-3
    assert caplog.messages[-1] == "the whole task can be held again: all its rows are back"
    assert caplog.messages[:-1] == ["the task stays infeasible: the rotation about the tool axis is given up"]
    assert max(speeds[-500:]) < 0.05


def test_a_target_that_jumps_within_reach_costs_no_rows(panda):
    planner = ftqp.Planner(panda, DT)
    planner.reset(panda.neutral)
    q, v, kept = panda.neutral.copy(), np.zeros(7), set()
    pose = panda.pose(q)
    pose[:3, 3] -= [0.15, 0.1, 0.1]
    for _ in range(2000):
        step = planner.step(q, v, ftqp.Target(pose=pose))
        kept.add(len(step.rows))
        q, v = step.q.copy(), step.v.copy()
    assert kept <= {0, 6} and step.status is ftqp.StepStatus.OK  # none is told of an arm that lags


def test_reset_asks_for_the_whole_task_again(unable):
    planner = unable(degrade=("pose", "position"))
    step, _ = run(planner, twisted(planner.robot, 1.2), 1.0)
    assert len(step.rows) == 3
    planner.reset(planner.robot.neutral)
    assert len(planner.task_rows) == 6


def test_a_batch_gives_up_the_same_rows(unable):
    planner = unable()
    goal = twisted(planner.robot, 1.2)
    step, _ = run(planner, goal, 1.0)
    targets = ftqp.Targets(np.repeat(goal.pose[None], 500, axis=0))
    batch = ftqp.batch.rollout(planner, planner.robot.neutral, targets=targets, threads=1)
    np.testing.assert_allclose(batch.q[0], step.q, atol=1e-9)


def angle(robot, q, goal):
    """How far the tip is turned from a target."""
    cosine = 0.5 * (np.trace(robot.pose(q)[:3, :3].T @ goal.pose[:3, :3]) - 1.0)
    return np.arccos(np.clip(cosine, -1.0, 1.0))
