"""Kinds of tasks and constraints of one's own are checked when one is made, as scenarios check them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import ftqp
from ftqp.control.task.own_task import OwnConstraint, OwnTask
from ftqp.core.setting import REQUIRED, setting


@dataclass(frozen=True, slots=True)
class Reach(OwnTask):
    frame: str = setting(REQUIRED, "a frame of the model")
    radius: float = setting(0.1, "how far from the base", unit="m", least=0.0, kw_only=True)
    side: str = setting("left", "on which side", choices=("left", "right"), kw_only=True)
    corner: tuple[float, ...] = setting((0.0, 1.0), "where", above=-0.5, most=1.0, kw_only=True)
    turns: int = setting(1, "how many turns", least=1, kw_only=True)
    reach: float = setting(np.inf, "how far", above=0.0, infinite=True, kw_only=True)

    @property
    def count(self):
        return 1

    def filling(self, robot):
        return lambda state, J, b: None


@dataclass(frozen=True, slots=True, kw_only=True)
class Slow(OwnConstraint):
    speed: float = setting(0.1, "its largest speed", unit="rad/s", above=0.0)

    @property
    def count(self):
        return 1

    def filling(self, robot):
        return lambda state, C, l, u: None


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"radius": -1}, "radius of Reach is -1, expected a finite number >= 0 m"),
        ({"radius": float("nan")}, "radius of Reach is nan, expected a finite number >= 0 m"),
        ({"radius": "x"}, "radius of Reach is 'x', expected a number in m"),
        ({"side": "lefd"}, r"side of Reach is 'lefd' \(did you mean 'left'"),
        ({"corner": (0.0, -0.6)}, "corner of Reach is -0.6, expected a number greater than -0.5"),
        ({"corner": (0.0, 1.5)}, "corner of Reach is 1.5, expected a number at most 1"),
        ({"turns": 0.5}, "turns is 0.5, expected a whole number >= 1"),
        ({"reach": 0.0}, "reach of Reach is 0, expected a finite number > 0"),
        ({"weight": -1.0}, "weight of Reach is -1, expected >= 0"),
    ],
)
def test_settings_of_ones_own_are_refused_as_they_say(wrong, sentence):
    Reach("panda_joint4")
    with pytest.raises(ftqp.InputError, match=sentence):
        Reach("panda_joint4", **wrong)


def test_settings_of_constraints_are_refused_as_they_say():
    Slow()
    with pytest.raises(ftqp.InputError, match="speed of Slow is -1, expected a finite number > 0 rad/s"):
        Slow(speed=-1.0)


@pytest.mark.parametrize("over", [OwnTask, OwnConstraint])
@pytest.mark.parametrize("count", [0, "2", True, 9, None])
def test_a_kind_whose_count_is_none_is_one_sentence(over, count):
    kind = dataclass(frozen=True, slots=True, kw_only=True)(
        type("Mine", (over,), {"count": count, "filling": lambda self, robot: None})
    )
    with pytest.raises(ftqp.InputError, match=r"count of Mine is .*, expected a whole number of rows, 1 to"):
        kind()


@pytest.mark.parametrize("over", [OwnTask, OwnConstraint])
def test_a_kind_that_lacks_count_or_filling_is_one_sentence(over):
    made = dataclass(frozen=True, slots=True, kw_only=True)
    without_filling = made(type("Mine", (over,), {"count": 1}))
    without_count = made(type("Mine", (over,), {"filling": lambda self, robot: None}))
    with pytest.raises(ftqp.InputError, match="Mine has no filling, expected a method filling"):
        without_filling()
    with pytest.raises(ftqp.InputError, match="Mine has no count, expected a property"):
        without_count()


def test_the_example_of_contributing_is_whole_and_does_what_it_says():
    text = (Path(__file__).parents[3] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    code = text.split("## Add a kind of task")[1].split("```python\n")[1].split("```")[0]
    found = {"__name__": "reach"}
    exec(code, found)
    reach, panda = found["ReachTask"], ftqp.robots.load("panda")
    with pytest.raises(ftqp.InputError, match="radius of ReachTask is 0"):
        reach(frame="panda_joint4", radius=0.0)
    task = reach(frame="panda_joint4", radius=0.2, level=2)
    planner = ftqp.Planner(panda, tasks=[ftqp.Task("position"), task])
    q, target = panda.neutral, ftqp.Target(pose=panda.pose(panda.neutral))
    planner.reset(q)
    before = task.error(panda, q)
    for _ in range(1000):
        step = planner.step(q, None, target)
        q = step.q.copy()
    decay = (1.0 + 2.0) * np.exp(-2.0)  # of kp = 4 and kv = 4 in 1 s, from rest
    assert step.tasks["ReachTask"].error[0] == pytest.approx(decay * before, rel=0.05)
