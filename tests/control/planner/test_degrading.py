"""Rows that are given up where the task stays infeasible."""

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
        planner = ftqp.Planner(narrow, DT, task=ftqp.Task(**task), emergency=None)
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


def test_rotation_about_the_tool_axis_is_given_up_first(unable, caplog):
    planner = unable(degrade=ALL)
    with caplog.at_level(logging.WARNING, "ftqp"):
        step, kept = run(planner, twisted(planner.robot, 1.2), 2.0)
    first = next(k for k, rows in enumerate(kept) if len(rows) == 5)
    assert first * DT >= 0.2 and len(kept[0]) == 6
    assert step.position_error < 1e-3 and len(step.rows) == 5
    assert caplog.messages == ["the task stays infeasible: the rotation about the tool axis is given up"]
    assert step.status is ftqp.StepStatus.RELAXED  # what is kept is met, and is less than what was asked for


def test_nothing_is_given_up_unless_it_is_asked_for(unable):
    planner = unable()
    step, _ = run(planner, twisted(planner.robot, 1.2), 1.0)
    assert len(step.rows) == 6 and step.status is ftqp.StepStatus.RELAXED


def test_reset_asks_for_the_whole_task_again(unable):
    planner = unable(degrade=("pose", "position"))
    step, _ = run(planner, twisted(planner.robot, 1.2), 1.0)
    assert len(step.rows) == 3
    planner.reset(planner.robot.neutral)
    assert len(planner.task_rows) == 6
