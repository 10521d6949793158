"""The motion of a scenario while nothing fails, on the time grid of its task."""

import numpy as np
import pytest

from ftqp.app.run.healthy_motion import healthy_motion, task_of
from ftqp.app.scenario.setup import load
from ftqp.core.errors import ScenarioError


@pytest.mark.parametrize("overrides", [[], ["planner.task.mode=scaled"]])
def test_the_joints_are_on_the_path_at_every_sample(overrides: list[str]) -> None:
    setup = load("planar3-line", overrides)
    task, q = healthy_motion(setup)
    assert task.N == 400 and q.shape == (401, 3)
    assert task.t[-1] == pytest.approx(setup.path.duration)
    tips = np.stack([setup.robot.pose(row)[:2, 3] for row in q])
    assert np.abs(tips - task.goals[:, :2, 3]).max() < 2e-3


def test_a_base_that_moves_has_no_task_on_a_time_grid() -> None:
    with pytest.raises(ScenarioError, match="a base that moves"):
        task_of(load("iiwa-moving-base-locked"))


def test_an_arm_that_does_not_get_there_healthy_is_told() -> None:
    with pytest.raises(ScenarioError, match="even while nothing fails"):
        healthy_motion(load("planar3-line", ["faults=", "path.duration=0.3"]))
