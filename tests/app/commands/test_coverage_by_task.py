"""``ftqp coverage`` of a scenario with several tips."""

import json

import pytest
from typer.testing import CliRunner

from ftqp.app.commands.cli import app

SCENARIO = """
[robot]
name = "dual_panda"
[path]
kind = "line"
displacement = [0.0, 0.0, 0.05]
duration = 1.0
[[tasks]]
kind = "relative"
frame = "right_hand"
to = "left_hand"
level = 0
name = "grip"
[[tasks]]
kind = "posture"
name = "rest"
weight = 0.001
"""


@pytest.fixture
def file(tmp_path):
    file = tmp_path / "two.toml"
    file.write_text(SCENARIO, encoding="utf-8")
    return file


def test_the_way_of_a_named_task_is_looked_at(file, tmp_path):
    common = ["coverage", str(file), "--stride", "100", "--json", "--out"]
    one = CliRunner().invoke(app, [*common, str(tmp_path / "left")])
    other = CliRunner().invoke(app, [*common, str(tmp_path / "right"), "--task", "grip"])
    left, right = (json.loads(done.stdout) for done in (one, other))
    assert list(left["per_joint"]) == [f"left_joint{k}" for k in range(1, 8)]
    assert list(right["per_joint"]) == [f"right_joint{k}" for k in range(1, 8)]
    assert "the way of grip in the scenario" in right["motion"]
    assert (tmp_path / "right" / "report.html").exists()


@pytest.mark.parametrize(
    ("name", "message"),
    [("gripp", "there is no task 'gripp'"), ("rest", "leads no frame along a path")],
)
def test_a_task_without_a_way_is_refused_in_a_sentence(file, tmp_path, name, message):
    done = CliRunner().invoke(app, ["coverage", str(file), "--task", name, "--out", str(tmp_path / "out")])
    assert done.exit_code == 2 and message in done.output
