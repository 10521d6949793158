"""What a planner says of the posture from which it begins."""

import logging

import numpy as np
import pytest

import ftqp


@pytest.fixture
def said(caplog):
    """The warnings of ftqp since the last call."""
    caplog.set_level(logging.WARNING, "ftqp")

    def messages():
        found = [record.getMessage() for record in caplog.records]
        caplog.clear()
        return found

    return messages


def test_singular_start_is_said_with_the_remedy(said):
    robot = ftqp.robots.load("iiwa14")
    ftqp.Planner(robot).reset(np.zeros(7))
    (message,) = said()
    assert message.startswith("iiwa14: the start is near a singularity of the task (sigma_min is ")
    assert message.endswith(
        "so directions of it may give way; start from another posture, such as robot.neutral"
    )


def test_rows_of_the_task_decide_what_is_singular(said):
    """The wrist of the PUMA aligned: attitude is lost, position is not."""
    robot = ftqp.robots.load("puma560")
    q = np.array([0.0, 0.8, -3.0, 0.0, 0.0, 0.0])
    ftqp.Planner(robot).reset(q)
    assert "near a singularity" in said()[0]
    ftqp.Planner(robot, task=ftqp.Task(rows="position")).reset(q)
    assert said() == []


def test_start_beyond_the_range_is_said_and_degrees_are_guessed(panda, said):
    planner = ftqp.Planner(panda)
    planner.reset(panda.neutral)
    q = panda.neutral.copy()
    q[1] = 2.0
    planner.reset(q)
    assert "the start is beyond the range of panda_joint2 2 (-1.763 to 1.763)" in said()[0]
    planner.reset(np.degrees(panda.neutral))
    assert "are these degrees?" in said()[0]


def test_weight_that_a_motor_cannot_hold_is_said(panda, said):
    weak = panda.with_limits(tau_max=[87.0, 87.0, 87.0, 10.0, 12.0, 12.0, 12.0])
    ftqp.Planner(weak).reset(panda.neutral)
    (message,) = said()
    assert "panda_joint4 needs " in message
    assert "beyond its limit of 10 N m, so the arm may sink" in message


def test_missing_redundancy_is_said_of_the_joints_that_work(panda, said):
    planner = ftqp.Planner(panda)
    planner.report(ftqp.Locked(2))
    planner.reset(panda.neutral)
    assert said() == [
        "panda: 6 joints that work for 6 task rows leave no redundancy, so a joint that fails costs a "
        "direction; follow fewer rows, Task(rows=...), if the work allows it"
    ]


def test_the_same_start_is_said_once_and_several_reasons_are_one_warning(said):
    robot = ftqp.robots.load("puma560")
    planner = ftqp.Planner(robot, level="velocity")
    planner.reset(np.zeros(6))
    planner.reset(np.zeros(6))
    (message,) = said()
    assert "near a singularity" in message and "leave no redundancy" in message and "\n" not in message
    planner.reset(robot.neutral)
    (message,) = said()
    assert "near a singularity" not in message
