"""How ftqp is called in each way: whose arrays it gets, and which target."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from steps.own import driven

import ftqp

START = np.zeros(2)
POSES = np.tile(np.eye(4), (5, 1, 1))
POSES[:, 0, 3] = np.arange(5)
TWISTS = np.outer(np.arange(5), np.ones(6))


class Planner:
    """It moves by one a step, notes what it is given, and always gives the same arrays back."""

    def __init__(self) -> None:
        self.given: list[tuple[Any, Any, Any, float, float]] = []
        self.out = SimpleNamespace(q=np.zeros(2), v=np.zeros(2), status=SimpleNamespace(name="OK"))

    def step(self, q: Any, v: Any, target: Any) -> Any:
        row = target.packed if target.packed.ndim == 1 else target.packed[target.row]
        one = ftqp.Target(pose=np.eye(4))
        one.packed[:] = row
        self.given.append((q, v, target, float(one.pose[0, 3]), float(one.twist[0])))
        self.out.q[:] = q + 1.0
        return self.out


@pytest.mark.parametrize("way", ["best", "readme", "paced"])
@pytest.mark.parametrize("twists", [None, TWISTS])
def test_the_arm_goes_on_and_step_k_gets_target_k(way: str, twists: Any) -> None:
    planner = Planner()
    arm = driven(planner, way, START, POSES, twists, None if twists is None else 0.0 * TWISTS)
    before = float(arm.q()[0])
    for k in (1, 2, 3):
        arm.step(k)
        arm.between()
    assert [given[3] for given in planner.given[1:]] == [1.0, 2.0, 3.0]
    assert [given[4] for given in planner.given[1:]] == ([0.0] * 3 if twists is None else [1.0, 2.0, 3.0])
    assert arm.q()[0] >= before + 2.0 and arm.status() == "OK"


def test_best_gives_the_planners_own_arrays_back() -> None:
    planner = Planner()
    arm = driven(planner, "best", START, POSES)
    arm.step(1)
    assert planner.given[1][0] is planner.out.q and planner.given[1][1] is planner.out.v
