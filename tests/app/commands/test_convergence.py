"""The command ``ftqp converge`` explains one case as the analysis finds it."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from tests.app.conftest import invoke

CASE = """
[robot]
name = "planar"
options = { lengths = [1.0, 1.0, 1.0], continuous = true }

[planner.task]
rows = ["x", "y"]

[start]
q = [-1.3846534, 0.7853982, 0.7465384]

[path]
kind = "point_to_point"
position = [1.5, 1.5, 0.0]
duration = 4.0
law = "constant"

[[faults]]
kind = "locked"
joint = "j2"
at = 0.0
announced = "never"
"""


@pytest.fixture
def case(tmp_path):
    file = tmp_path / "fig5.toml"
    file.write_text(CASE, encoding="utf-8")
    return file


asked = partial(invoke, "converge")


def facts_of(result):
    return json.loads(result.stdout)


def test_figure_5_of_the_paper_arrives_and_the_story_is_told_in_words(case, tmp_path):
    result = asked(case, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "correct: it arrives at the goal" in result.stdout
    assert "the goal is within reach of the other joints" in result.stdout
    facts = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert facts["kind"] == "correct" and facts["goal_within_reach"]
    np.testing.assert_allclose(np.rad2deg(facts["q"]), [-5.6173, 45.0, 66.1698], atol=0.01)
    np.testing.assert_allclose(np.rad2deg(facts["ranges"]["j1"]), [[-24.2952, 114.2952]], atol=1e-3)
    assert [rest["kind"] for rest in facts["rests"]] == ["saddle", "saddle"]
    assert Path(facts["figure"]).stat().st_size > 10_000


def test_an_arm_that_rests_elsewhere_ends_with_1(tmp_path):
    result = asked("planar3-unidentified", "--out", tmp_path / "out", "--json")
    assert result.exit_code == 1
    facts = facts_of(result)
    assert facts == json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert facts["kind"] == "erroneous" and not facts["goal_within_reach"]
    assert facts["error"] == pytest.approx(0.904434, abs=1e-4)
    assert facts["learned"]["error"] == pytest.approx(0.5687, abs=1e-3)
    assert facts["learned"]["theta"]["j1"] < 0.05


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (["faults="], "has no faults; ftqp converge explains"),
        (["faults.0.kind=free_swinging"], "swings freely, expected joints that lock"),
        (["start.q=[0.0, 0.0, 0.0]"], "singular"),
        (["path.position=[9.0, 0.0, 0.0]"], "out of reach"),
    ],
)
def test_what_cannot_be_explained_is_one_clear_sentence(case, tmp_path, changes, sentence):
    options = [part for change in changes for part in ("--set", change)]
    result = asked(case, *options, "--out", tmp_path / "out")
    assert result.exit_code == 2, result.output
    assert sentence in result.stderr.replace("\n", " ")
    assert not (tmp_path / "out").exists()
