"""The commands ``ftqp coverage`` and ``ftqp plan`` say what the analysis finds, also as JSON and page."""

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from tests.app.conftest import invoke as asked

import ftqp
from ftqp.app.commands import covering
from ftqp.app.commands.covering import healthy_motion
from ftqp.app.scenario.setup import load

LINE = "planar3-line"
COARSE = ("--waypoints", "40", "--spacing", "0.1")
FEW = ("--stride", "40")


def facts_of(result):
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_the_coverage_of_a_scenario_is_that_of_its_healthy_motion_and_the_page_says_the_same(tmp_path):
    facts = facts_of(asked("coverage", LINE, "--out", tmp_path / "out", "--json", "--bound", "3"))
    setup = load(LINE, ["faults="])
    task, q = healthy_motion(setup)
    rep = ftqp.analysis.coverage(setup.robot, task, q)
    assert facts["coverage"] == pytest.approx(rep.coverage) and rep.coverage < 0.8
    assert facts["per_joint"] == pytest.approx(rep.per_joint)
    assert facts["structural"] == []
    assert facts["pairs"] == rep.status.size
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["coverage"] == facts["coverage"]
    assert all(Path(file).stat().st_size > 5000 for file in facts["figures"])
    text = Path(facts["page"]).read_text(encoding="utf-8")
    assert f"{100.0 * facts['coverage']:.1f} % are survived" in text
    for joint, share in facts["per_joint"].items():
        assert f'<td>{joint}</td><td class="number">{100.0 * share:.1f}</td>' in text
    assert "http" not in text and text.count("data:image/png;base64,") == 2
    assert len(facts["upper_bound"]) == 3


def test_a_structural_joint_is_named_as_such(tmp_path):
    result = asked("coverage", "iiwa-x-line", "--stride", "25", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "iiwa_joint_4 can never be done without" in " ".join(result.output.split())


def test_failure_rates_give_a_probability(tmp_path):
    facts = facts_of(
        asked("coverage", LINE, "--mtbf", "j1=1000,j2=2000", *FEW, "--out", tmp_path / "a", "--json")
    )
    mission = facts["mission"]
    assert 0.0 < mission["without"] < mission["low"] <= mission["likely"] <= mission["high"] < 1.0
    rate = (1 / 1000 + 1 / 2000) / 3600.0
    assert mission["without"] == pytest.approx(np.exp(-10.0 * rate), abs=1e-12)


def test_a_plan_is_written_told_and_verified_again(tmp_path):
    file = tmp_path / "line.npz"
    planned = facts_of(
        asked("plan", LINE, "-o", file, "--report", tmp_path / "plan", "--json", *COARSE, "--seed", 3)
    )
    assert planned["coverage"] == 1.0 and planned["structural"] == [] and not planned["moved"]
    assert planned["settings"]["seed"] == 3
    plan = ftqp.analysis.load_plan(file)
    assert planned["start"] == plan.q[0].tolist()
    again = facts_of(asked("coverage", LINE, "--plan", file, "--out", tmp_path / "out", "--json"))
    assert again["coverage"] == planned["coverage"]
    assert again["motion"] == "the plan by dp"
    assert (tmp_path / "plan" / "report.html").exists()


def test_a_plan_may_begin_where_the_scenario_does(tmp_path):
    file = tmp_path / "line.npz"
    facts = facts_of(asked("plan", LINE, "-o", file, "--start", "given", "--json", *COARSE))
    np.testing.assert_allclose(facts["start"], load(LINE).q, atol=1e-6)
    assert 0.75 < facts["coverage"] < 1.0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("coverage", LINE, "--lock", "slowly"), "expected 'instant' or 'ramp'"),
        (("coverage", LINE, "--mtbf", "often"), "joint=hours"),
        (("coverage", LINE, "--plan", "none.npz"), "does not exist"),
        (("coverage", "iiwa-moving-base-locked"), "a base that moves"),
        (("coverage", LINE, "--resume"), "name it by --out"),
        (("coverage", "zhang7-short", "--fault", "free_swinging"), "no masses"),
        (("plan", LINE, "-o", "p.npz", "--mtbf", "j1=0"), "mtbf of 'j1' is 0"),
        (("coverage", LINE, "--jobs", "2", "--dask", "tcp://here:1"), "leave one of them out"),
        (("plan", LINE, "-o", "plan.txt"), "has to end in .npz"),
        (("plan", LINE, "-o", "p.npz", "--method", "magic"), "magic"),
        (("plan", LINE, "-o", "p.npz", "--optimise", "yaw", "--start", "given"), "leave --start out"),
        (("plan", "planar6-square", "-o", "p.npz", "--method", "spline"), "joints to spare"),
    ],
)
def test_bad_input_is_said_in_a_sentence_and_leaves_nothing(arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = asked(*arguments)
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())
    assert not list(tmp_path.glob("*.npz"))


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
    given = ("--stride", "100", "--json", "--out", tmp_path / "right", "--task", "grip")
    right = facts_of(asked("coverage", file, *given))
    assert list(right["per_joint"]) == [f"right_joint{k}" for k in range(1, 8)]
    assert "the way of grip in the scenario" in right["motion"]
    assert (tmp_path / "right" / "report.html").exists()


EVERY = ("--stride", "20")


def text(result):
    return " ".join(result.output.split())


def rows(folder):
    with closing(sqlite3.connect(folder / "results.sqlite")) as file, file:
        names = "item, failure, t, status, last_sample, position, rotation, margin, hurry"
        return file.execute(f"SELECT {names} FROM results ORDER BY item").fetchall()


def test_interrupted_coverage_goes_on_to_the_same_rows(tmp_path, monkeypatch):
    whole = asked("coverage", LINE, *EVERY, "--out", tmp_path / "whole", "--json")
    assert whole.exit_code == 0, whole.output
    out = tmp_path / "out"
    own, calls = covering.pair_rows, []

    def once(*given):
        calls.append(given)
        if len(calls) > 2:
            raise KeyboardInterrupt
        return own(*given)

    with monkeypatch.context() as interrupted:
        interrupted.setattr(covering, "pair_rows", once)
        broken = asked("coverage", LINE, *EVERY, "--out", out)
    assert broken.exit_code == 130 and f"--out {out} --resume goes on from there" in text(broken)
    assert 0 < len(rows(out)) < len(rows(tmp_path / "whole"))
    refused = asked("coverage", LINE, *EVERY, "--out", out)
    assert refused.exit_code == 2 and "go on by --resume" in text(refused)
    other = asked("coverage", LINE, "--stride", "10", "--out", out, "--resume")
    assert other.exit_code == 2
    assert "holds results of another study ('stride = 20' there, 'stride = 10' here)" in text(other)
    with monkeypatch.context() as newer:
        newer.setattr(covering, "__version__", "99.0")
        later = asked("coverage", LINE, *EVERY, "--out", out, "--resume")
    assert later.exit_code == 2 and "was made by ftqp" in text(later)
    done = asked("coverage", LINE, *EVERY, "--out", out, "--resume", "--json")
    assert done.exit_code == 0, done.output
    assert rows(out) == rows(tmp_path / "whole")
    facts = [json.loads(result.stdout) for result in (whole, done)]
    assert facts[0]["coverage"] == facts[1]["coverage"] and Path(facts[1]["page"]).exists()


def test_plan_that_cannot_be_made_leaves_nothing(tmp_path):
    result = asked("plan", LINE, *COARSE, "--set", "path.duration=0.5", "-o", tmp_path / "plan.npz")
    assert result.exit_code == 2 and not list(tmp_path.iterdir())
