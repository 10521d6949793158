"""Tasks on their time grids."""

import numpy as np
import pytest

from ftqp.analysis.survival.task_path import robot_digest, task_errors, task_path
from ftqp.control.paths import Line
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_exp, transform
from ftqp.model import catalog

PANDA = catalog.load("panda")
Q0 = PANDA.neutral
LINE = Line(PANDA.pose(Q0), (0.0, 0.1, 0.0), duration=2.0)


def test_samples_are_those_of_the_path() -> None:
    task = task_path(PANDA, LINE, dt=0.05, q0=Q0)
    assert task.N == 40 and task.m == 6 and task.redundancy == 1
    assert np.allclose(task.goals, LINE.sample(task.t).pose)
    assert np.isclose(task.t[-1], LINE.duration)
    assert task_path(PANDA, LINE).N == 400


def test_coarser_grids_keep_both_ends_and_have_a_digest_of_their_own() -> None:
    task = task_path(PANDA, LINE, dt=0.05)
    for coarse in (task.every(4), task.coarse(10)):
        assert coarse.N == 10 and np.isclose(coarse.dt, 0.2)
        assert (coarse.goals[0] == task.goals[0]).all() and (coarse.goals[-1] == task.goals[-1]).all()
        assert coarse.digest != task.digest
    assert task.coarse(7).N >= 7
    with pytest.raises(InputError, match="stride is 3, expected a divisor of N = 40"):
        task.every(3)


def test_digest_tells_arms_tools_limits_rows_and_paths_apart() -> None:
    same = task_path(PANDA, LINE, dt=0.05).digest
    assert same == task_path(catalog.load("panda"), LINE.sample(np.arange(41) * 0.05).pose, dt=0.05).digest
    others = [
        task_path(PANDA, LINE, dt=0.05, rows="position"),
        task_path(PANDA, LINE, dt=0.05, rows="position_axis"),
        task_path(PANDA, LINE, dt=0.1),
        task_path(PANDA.with_tip(transform(np.eye(3), np.array([0.0, 0.0, 0.1]))), LINE, dt=0.05),
        task_path(PANDA.with_limits(q_max=PANDA.limits.q_max - 0.1), LINE, dt=0.05),
        task_path(PANDA, Line(PANDA.pose(Q0), (0.0, 0.11, 0.0), duration=2.0), dt=0.05),
    ]
    assert len({same, *(task.digest for task in others)}) == len(others) + 1
    assert robot_digest(PANDA) == robot_digest(catalog.load("panda")) != robot_digest(others[3].robot)


def test_points_keep_the_orientation_of_the_start() -> None:
    points = PANDA.pose(Q0)[:3, 3] + np.linspace(0.0, 0.1, 11)[:, None] * np.array([1.0, 0.0, 0.0])
    task = task_path(PANDA, points, dt=0.1, q0=Q0)
    assert np.allclose(task.goals[:, :3, :3], PANDA.pose(Q0)[:3, :3]) and np.allclose(
        task.goals[:, :3, 3], points
    )
    with pytest.raises(InputError, match="give poses"):
        task_path(PANDA, points, dt=0.1)


def test_axis_errors_ignore_the_turn_about_the_tool() -> None:
    goal = PANDA.pose(Q0)
    spun = goal @ transform(rotation_exp(np.array([0.0, 0.0, 0.7])), np.zeros(3))
    tilted = goal @ transform(rotation_exp(np.array([0.2, 0.0, 0.0])), np.zeros(3))
    task = task_path(PANDA, LINE, rows="position_axis")
    off = task_errors(task.rows, True, np.stack([goal, goal]), np.stack([spun, tilted]))
    assert np.allclose(off, [[0.0] * 5, [0.0, 0.0, 0.0, -0.2, 0.0]], atol=1e-12)
