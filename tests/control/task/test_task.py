"""Tasks as they are declared, also of kinds of one's own."""

from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
import pytest
from tests.going import closed_loop

import ftqp
from ftqp.control.task import bounds, schemes
from ftqp.control.task.bounds import Jin, OneStep, Viability
from ftqp.control.task.own_task import OwnTask
from ftqp.control.task.task import DEFAULT_GAINS, Task, checked_gains, row_indices
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, setting
from ftqp.kernel.layout import enums as codes


@pytest.mark.parametrize(
    ("rows", "indices"),
    [
        ("pose", (0, 1, 2, 3, 4, 5)),
        ("position", (0, 1, 2)),
        ("position_axis", (0, 1, 2, 3, 4)),
        (("rz", "x"), (0, 5)),
        (["z"], (2,)),
    ],
)
def test_row_sets_become_sorted_components(rows, indices):
    assert row_indices(rows) == indices


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"rows": "positon"}, r"task rows 'positon' are unknown \(did you mean 'position'\?\); expected"),
        ({"rows": ("x", "w")}, "task row 'w' is unknown; rows are x, y, z, rx, ry, rz"),
        ({"rows": ("x", "x")}, r"task rows are \('x', 'x'\), expected at least one row and none twice"),
        ({"priority": "position_first", "mode": "hard"}, "priority 'position_first' does not go with mode"),
        ({"kv": np.nan}, "kv is nan, expected a finite number >= 0"),
        ({"slack": 2.0}, r"slack is 2, expected a share in \[1e-12, 1\]"),
        ({"axis": (0.0, 0.0, 0.0)}, "axis is zero, expected the direction of the tool"),
        ({"axis": (0.0, 1.0)}, r"axis has shape \(2,\), expected \(3,\)"),
    ],
)
def test_wrong_task_is_refused_with_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        Task(**given)


def test_acceleration_feedback_is_critically_damped_unless_told():
    assert Task(kp=25.0).gains("acceleration") == (25.0, 10.0)
    assert Task(kp=25.0, kv=3.0).gains("acceleration") == (25.0, 3.0)
    kp, kv = DEFAULT_GAINS["acceleration"]
    assert kv == 2.0 * kp**0.5


@pytest.mark.parametrize(("level", "given"), [("acceleration", {"kv": 200.0}), ("velocity", {"kp": 200.0})])
def test_gains_at_the_edge_of_stability_are_refused_and_below_it_pass(level, given):
    name = next(iter(given))
    with pytest.raises(InputError, match=rf"{name} is 200, but with dt = 0.01 s .* expected {name} < 200"):
        checked_gains(Task(**given), level, 0.01)
    checked_gains(Task(**given), level, 0.0099)


def test_every_conversion_is_known_by_name_by_its_table_and_as_itself():
    assert bounds.names() == ("viability", "jin", "one_step")
    for name, kind, code in zip(
        bounds.names(), (Viability, Jin, OneStep), (codes.VIABILITY, codes.JIN, codes.ONE_STEP), strict=True
    ):
        assert bounds.by_name(name) == kind() and kind.code == code
    assert bounds.by_name({"name": "jin", "gamma_p": 5.0, "margin": 0.0}) == Jin(gamma_p=5.0, margin=0.0)
    mine = Jin(gamma_v=3.0)
    assert bounds.by_name(mine) is mine


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ("viable", r"'viable' is not a bound conversion \(did you mean 'viability'\?\); there are"),
        ({"name": "jin", "gamma_p": 0.0}, "gamma_p is 0, expected a finite number > 0"),
        ({"name": "jin", "upsilon": np.inf}, "upsilon is inf, expected a finite number > 0"),
    ],
)
def test_wrong_conversion_is_refused_with_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        bounds.by_name(given)


def test_mixed_scheme_is_the_weighted_sum_at_both_levels(level):
    mixed = 2.0 * schemes.mke() + schemes.rmp() * 3.0
    expected = 2.0 * np.array(astuple(schemes.mke().at(level))) + 3.0 * np.array(
        astuple(schemes.rmp().at(level))
    )
    np.testing.assert_allclose(astuple(mixed.at(level)), expected, rtol=1e-15)
    assert mixed.name == "2 mke + 3 rmp"


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


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"radius": -1}, "radius of Reach is -1, expected a finite number >= 0 m"),
        ({"radius": float("nan")}, "radius of Reach is nan, expected a finite number >= 0 m"),
        ({"side": "lefd"}, r"side of Reach is 'lefd' \(did you mean 'left'"),
    ],
)
def test_settings_of_ones_own_are_refused_as_they_say(wrong, sentence):
    Reach("panda_joint4")
    with pytest.raises(ftqp.InputError, match=sentence):
        Reach("panda_joint4", **wrong)


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
    planner.reset(panda.neutral)
    before = task.error(panda, panda.neutral)
    *_, step = closed_loop(planner, ftqp.Target(pose=panda.pose(panda.neutral)), 1000)
    decay = (1.0 + 2.0) * np.exp(-2.0)  # of kp = 4 and kv = 4 in 1 s, from rest
    assert step.tasks["ReachTask"].error[0] == pytest.approx(decay * before, rel=0.05)
