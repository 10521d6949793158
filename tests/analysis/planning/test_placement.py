"""Where to put a task."""

import numpy as np
import pytest

from ftqp.analysis.planning import planned as placement
from ftqp.analysis.planning.plan_case import PlanCase, PlanSettings
from ftqp.analysis.planning.planned import plan
from ftqp.analysis.survival.task_path import task_path
from ftqp.control.paths import Line
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_z
from ftqp.model import catalog

ARM = catalog.load("planar", lengths=(1, 1, 1), continuous=True)
NEAR = np.eye(4)
NEAR[:2, 3] = 0.2, 0.2
TASK = task_path(ARM, Line(NEAR, (0.0, 2.0, 0.0), duration=40.0), dt=2.0, rows="position")
FEW = PlanSettings(waypoints=20, spacing=0.2, stride=1)


@pytest.fixture(autouse=True)
def short(monkeypatch):
    monkeypatch.setattr(placement, "WAYPOINTS", 10)
    monkeypatch.setattr(placement, "SPACING", 0.2)
    monkeypatch.setattr(placement, "SPREAD", 8)
    monkeypatch.setattr(placement, "REFINED", 6)


def test_base_moves_to_where_more_is_survived_and_the_path_the_other_way() -> None:
    here, there = (plan(ARM, TASK, settings=FEW, optimise=freedoms) for freedoms in ((), ("base",)))
    assert there.coverage > here.coverage + 0.05
    moved = there.settings["moved"]
    assert set(moved) == {"base_x", "base_y"} and max(map(abs, moved.values())) <= 0.25
    assert np.allclose(there.goals[:, 0, 3], TASK.goals[:, 0, 3] - moved["base_x"])
    assert np.allclose(there.goals[:, 1, 3], TASK.goals[:, 1, 3] - moved["base_y"])


@pytest.mark.slow
def test_yaw_turns_the_tool_about_its_own_axis() -> None:
    arm = catalog.load("panda")
    start = np.diag([1.0, -1.0, -1.0, 1.0])
    start[:3, 3] = 0.45, 0.0, 0.35
    task = task_path(arm, Line(start, (0.0, 0.05, 0.0), duration=2.0), dt=0.2)
    moved, how = placement.better_placed(PlanCase(task=task, weights=np.ones(7), settings=FEW), ("yaw",))
    turned = task.goals[:, :3, :3] @ rotation_z(how["moved"]["yaw"])
    assert np.allclose(moved.goals[:, :3, :3], turned) and np.allclose(
        moved.goals[:, :3, 3], task.goals[:, :3, 3]
    )


def test_interrupted_search_keeps_the_best_placement_so_far() -> None:
    seen = []

    def interrupt(done: int, total: int, what: str) -> None:
        seen.append(done)
        if done == 3:
            raise KeyboardInterrupt

    moved, how = placement.better_placed(
        PlanCase(task=TASK, weights=np.ones(3), settings=FEW, notify=interrupt), ("base",)
    )
    assert seen == [1, 2, 3] and set(how["moved"]) == {"base_x", "base_y"}
    assert np.allclose(moved.goals[:, 0, 3], TASK.goals[:, 0, 3] - how["moved"]["base_x"])


def test_path_that_no_placement_can_be_followed_from_is_refused() -> None:
    far = NEAR.copy()
    far[0, 3] = 5.0
    task = task_path(ARM, Line(far, (0.0, 1.0, 0.0), duration=10.0), dt=0.5, rows="position")
    with pytest.raises(InputError, match="no placement of the path is found"):
        plan(ARM, task, settings=FEW, optimise=("base",))
