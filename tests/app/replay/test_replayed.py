"""A run records its QPs, and a recorded QP can be solved again and explained."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.app.conftest import SHORT, invoke

import ftqp
from ftqp.qp import Recorder, Recording
from ftqp.sim.plants.kinematic_plant import KinematicPlant

PROBLEMS = Path(__file__).resolve().parents[3] / "solvers" / "problems"


def answer(*arguments):
    """The JSON object of a replay."""
    result = invoke("replay", *arguments, "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    return facts


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """The recording of a run of 51 ticks in which j2 locks at tick 20."""
    folder = tmp_path_factory.mktemp("run")
    scenario = folder / "short.toml"
    scenario.write_text(SHORT)
    result = invoke(
        "run", "--no-figures", scenario, "--out", folder / "out", "--record-qps", folder / "out" / "qps.npz"
    )
    assert result.exit_code == 0, result.output
    return folder / "out" / "qps.npz"


def test_run_records_every_qp_and_says_where(file):
    recording = Recording.load(file)
    assert recording.tick.tolist() == list(range(51))
    summary = json.loads((file.parent / "summary.json").read_text())
    assert summary["recording"] == {"file": str(file), "qps": 51, "dropped": 0, "ticks": [0, 50]}
    assert summary["backend"] == recording.metadata["backend"] == "active_set"
    assert recording.variables == ("j1", "j2", "j3", "j4", "j5", "j6", "slack x", "slack y")


@pytest.mark.long
def test_run_keeps_the_ticks_that_the_scenario_asks_for(short, tmp_path):
    choices = ("recording.begin=0.1", "recording.end=0.31", "recording.every=4", "recording.limit=3")
    sets = [word for choice in choices for word in ("--set", choice)]
    result = invoke(
        "run", "--no-figures", short, *sets, "--out", tmp_path / "out", "--record-qps", tmp_path / "q.npz"
    )
    assert result.exit_code == 0, result.output
    assert Recording.load(tmp_path / "q.npz").tick.tolist() == [22, 26, 30]
    assert "3 older ones did not fit into memory" in result.stdout


@pytest.mark.parametrize(
    ("name", "window", "message"),
    [
        ("short.toml", (), "exists, and nothing is overwritten"),
        ("qps", (), "has to end in .npz"),
        ("short.toml/qps.npz", (), "is not a folder"),
        ("out.npz", (), "are in each other's way"),
        ("q.npz", ("begin=0.4", "end=0.2"), "ends at 0.2 s, before it begins at 0.4 s"),
        ("q.npz", ("begin=0.401", "end=0.402"), "recording: no tick"),
    ],
)
def test_a_recording_that_cannot_be_is_refused_before_the_run(short, tmp_path, name, window, message):
    sets = [word for one in window for word in ("--set", f"recording.{one}")]
    result = invoke(
        "run", "--no-figures", short, *sets, "--out", tmp_path / "out.npz", "--record-qps", tmp_path / name
    )
    assert result.exit_code == 2
    assert message in result.stderr
    assert not (tmp_path / "out.npz").exists()


def test_interrupted_run_keeps_what_it_has_recorded(short, tmp_path, monkeypatch):
    advance, calls = KinematicPlant.advance, []

    def interrupted(plant, step):
        calls.append(1)
        if len(calls) == 20:
            raise KeyboardInterrupt
        advance(plant, step)

    monkeypatch.setattr(KinematicPlant, "advance", interrupted)
    result = invoke(
        "run", "--no-figures", short, "--out", tmp_path / "out", "--record-qps", tmp_path / "q.npz", "--json"
    )
    assert result.exit_code == 130
    assert len(Recording.load(tmp_path / "q.npz")) == 20
    assert json.loads(result.stdout)["recording"]["ticks"] == [0, 19]


def test_replay_without_tick_tells_what_was_recorded(file):
    result = invoke("replay", file)
    assert result.exit_code == 0
    assert "51 QPs of 8 variables and 8 rows, ticks 0 to 50, 0 s to 0.5 s" in result.stdout
    assert answer(file)["claims"] == {"solved": 51}


def test_replay_names_the_locked_joint_and_its_multiplier(file):
    recording = Recording.load(file)
    facts = answer(file, "--tick", 45)
    rows = {row["name"]: row for row in facts["solution"]["variables"]}
    assert {name: row["active"] for name, row in rows.items()} == {
        **dict.fromkeys(("j1", "j3", "j4", "j5", "j6")),
        "j2": "fixed",
    }
    assert rows["j2"]["value"] == 0.0 and rows["j2"]["unit"] == "rad/s2"
    assert rows["j2"]["multiplier"] == pytest.approx(recording.z_box[45, 1])
    assert "Fixed: j2" in invoke("replay", file, "--tick", 45, "--backends", "daqp").stdout


def test_replay_tells_what_each_task_row_loses(file):
    recording = Recording.load(file)
    rows = answer(file, "--tick", 30)["solution"]["task"]
    lost = recording.A[30][:, :6] @ recording.x[30, :6] - recording.b[30]
    assert [row["name"] for row in rows] == ["x", "y"]
    np.testing.assert_allclose([row["lost"] for row in rows], lost, atol=1e-12)
    assert all(row["unit"] == "m/s2" for row in rows)


def test_replay_compares_the_backends_it_is_told(file):
    facts = answer(file, "--tick", 30, "--backend", "daqp", "--backends", "active_set, proxqp")
    assert [row["backend"] for row in facts["backends"]] == ["daqp", "active_set", "proxqp"]
    assert all(row["verdict"] == "agrees" and row["difference"] < 1e-6 for row in facts["backends"])
    assert facts["disagree"] == facts["gave_up"] == []


def test_a_backend_that_lies_is_named(file, tmp_path):
    """The recorded answer solves the QP, the profile stops far from it."""
    profile = tmp_path / "hasty.toml"
    profile.write_text('name = "osqp"\nmax_iterations = 1\n')
    result = invoke("replay", file, "--tick", 30, "--backend", profile, "--backends", "daqp", "--json")
    facts = json.loads(result.stdout)
    assert result.exit_code == 1
    assert facts["solution"]["status"] == "MAX_ITERATIONS"
    assert facts["gave_up"] == [str(profile)]


def test_replay_explains_why_a_qp_has_no_solution():
    facts = answer(PROBLEMS / "planar6-infeasible.npz", "--tick", 1510, "--backends", "active_set,proxqp")
    proof = facts["solution"]["certificate"]
    assert proof["rows"] == ["x", "y"] and proof["two_sided_rows"] == []
    assert proof["bounds"] == [f"j{i} (fixed at 0)" for i in range(1, 6)]
    assert facts["solution"]["residuals"] is None and facts["reference"] is None
    text = invoke("replay", PROBLEMS / "planar6-infeasible.npz", "--tick", 1510, "--backends", "daqp").stdout
    assert "exclude each other: the point closest" in text and "j5 (fixed at 0)" in text


def test_replay_gives_torques_in_newton_metres_at_both_levels():
    facts = answer(PROBLEMS / "panda-torque.npz", "--tick", 120, "--backends", "daqp")
    rows = {row["name"]: row for row in facts["solution"]["torques"]}
    elbow = rows["torque panda_joint4"]
    assert elbow["active"] == "upper" and elbow["value"] == pytest.approx(23.5) and elbow["unit"] == "N m"
    slow = answer(PROBLEMS / "panda-healthy-velocity.npz", "--tick", 1510, "--backends", "daqp")
    ends = {row["name"]: (row["lower"], row["upper"]) for row in slow["solution"]["torques"]}
    assert ends["torque panda_joint1"] == pytest.approx((-87.0, 87.0))
    assert slow["solution"]["variables"][0]["unit"] == "rad/s"


def test_a_recording_of_no_planner_is_explained_without_units(tmp_path):
    recorder = Recorder("daqp")
    ftqp.qp.solve(ftqp.QP(np.eye(2), [1.0, -3.0], C=[[1.0, 1.0]], u=[1.0], lb=[0.0, 0.0]), recorder)
    recorder.recording(dt=1.0).save(tmp_path / "q.npz")
    rows = answer(tmp_path / "q.npz", "--tick", 0, "--backends", "active_set")["solution"]
    assert [(row["name"], row["active"], row["unit"]) for row in rows["variables"]] == [
        ("x0", "lower", ""),
        ("x1", None, ""),
    ]
    assert rows["torques"][0] | {"name": "row0", "active": "upper", "value": 1.0} == rows["torques"][0]
    assert "Two-sided rows" in invoke("replay", tmp_path / "q.npz", "--tick", 0).stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--tick", "51"), "expected one of 0 to 50; the nearest recorded one is 50"),
        (("--tick", "-1"), "the nearest recorded one is 0"),
    ],
)
def test_wrong_choices_are_said_in_words(file, arguments, message):
    result = invoke("replay", file, *arguments, "--json")
    assert result.exit_code == 2
    assert message in result.stderr
    assert set(json.loads(result.stdout)) == {"error", "errors"}
