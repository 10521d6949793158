"""The planner goes on after a failure, in closed loop."""

import numpy as np
import pytest

import ftqp
from ftqp.analysis.survival.continuing import track
from ftqp.analysis.survival.coverage import coverage
from ftqp.analysis.survival.task_path import task_path
from ftqp.core.errors import InputError
from ftqp.kernel.layout.enums import Survival
from ftqp.model import catalog

Q0 = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])


@pytest.mark.slow
def test_free_joints_of_a_panda_lose_a_pose_except_where_nothing_pulls_at_them() -> None:
    panda = catalog.load("panda")
    task = task_path(panda, ftqp.paths.Line(panda.pose(Q0), (0.0, 0.25, 0.0), duration=4.0), dt=0.05)
    q = track(task, Q0, 0.3)
    found = coverage(panda, task, q, fault="free_swinging", joints=[0, 1, 3], stride=36)
    assert found.post == "planner" and found.status.shape == (3, 3)
    assert found.status[0, 2] == Survival.SURVIVED and (found.status[1:] == Survival.ERROR).all()
    position, _ = found.best_effort()
    assert (position[1:] == found.position[1:]).all() and found.position[1:].min() > 2e-3
    with pytest.raises(InputError, match="run the planner"):
        found.continue_after(0, 3.6)


@pytest.mark.slow
@pytest.mark.parametrize("theta", [0.0, 0.6])
def test_planner_does_what_was_predicted_in_every_clear_case(theta: float) -> None:
    panda = catalog.load("panda")
    start = np.diag([1.0, -1.0, -1.0, 1.0])
    start[:3, 3] = 0.45, -0.2, 0.35
    task = task_path(panda, ftqp.paths.Line(start, (0.0, 0.4, 0.0), duration=6.0), dt=0.025)
    q = track(task, Q0, theta)
    predicted = coverage(panda, task, q, lock="ramp", stride=16)
    executed = coverage(panda, task, q, lock="ramp", stride=16, post="planner")
    clear = ~predicted.borderline()
    assert (predicted.survived == executed.survived)[clear].all()
    assert clear.mean() > 0.8 and 0 < predicted.survived[clear].sum() < clear.sum()
    assert executed.position[predicted.survived & clear].max() < 2e-3


def test_arm_without_masses_is_refused() -> None:
    arm = catalog.load("zhang7")
    task = task_path(arm, ftqp.paths.Line(arm.pose(arm.neutral), (0.5, 0.0, 0.0), duration=4.0), dt=0.1)
    with pytest.raises(InputError, match="zhang7 has no masses"):
        coverage(arm, task, track(task, arm.neutral), fault="free_swinging")
