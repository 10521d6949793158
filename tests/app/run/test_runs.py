"""Runs into folders, healthy motions, and the arm of a run from its log."""

import json

import numpy as np
import pytest
from tests.app.conftest import setup_of

import ftqp
from ftqp.app.commands.covering import healthy_motion, task_of
from ftqp.app.run import runs
from ftqp.app.run.recorded_robot import recorded_robot
from ftqp.app.scenario.setup import load
from ftqp.core.errors import FtqpError, InputError, ScenarioError
from ftqp.model import catalog
from ftqp.sim.log.log_rows import LogRows
from ftqp.sim.log.log_writer import log_files
from ftqp.sim.log.signals import columns


def setup(**tables):
    return setup_of(**{"planner": {"dt": 0.01}, "path": ROUND} | tables)


ROUND = {"kind": "circle", "radius": 0.02, "duration": 0.5}


def test_a_path_with_laps_is_repeated(tmp_path):
    slowly = ROUND | {"duration": 2.0}
    one = runs.run(setup(path=slowly), tmp_path / "one", drawn=False)
    four = runs.run(setup(path=slowly | {"laps": 4.0}), tmp_path / "four", drawn=False)
    assert (one.summary["steps"], four.summary["steps"]) == (201, 801)
    log = ftqp.load_log(tmp_path / "four")
    np.testing.assert_array_equal(log["target"][:200], ftqp.load_log(tmp_path / "one")["target"][:200])
    np.testing.assert_allclose(log["target"][600:800], log["target"][:200], atol=1e-12)
    assert four.summary["completed"]
    assert four.summary["max_position_error"] == pytest.approx(one.summary["max_position_error"], rel=0.1)
    np.testing.assert_array_equal(log["t"], np.arange(801) * 0.01)


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"path": ROUND | {"laps": 0.0}}, "greater than 0"),
        ({"path": ROUND | {"duration": 50.0, "laps": 1e308}}, "duration of the path"),
        ({"path": ROUND | {"laps": float("nan")}}, "finite number"),
        ({"path": ROUND | {"radius": 3.0, "laps": 2000.0}}, "out of reach"),
        ({"log": {"keep": 2}}, "part, their length, is not given"),
    ],
)
def test_laps_and_parts_that_cannot_be_are_refused(tables, said):
    with pytest.raises(ScenarioError) as caught:
        setup(**tables)
    assert said in str(caught.value)


def test_what_a_path_survives_is_asked_of_one_lap():
    with pytest.raises(ScenarioError, match=r"take path\.laps out"):
        task_of(setup(path=ROUND | {"laps": 2.0}))


def test_a_run_in_parts_sums_up_all_its_ticks(tmp_path):
    laps = {"path": ROUND | {"laps": 140.0}, "faults": [{"kind": "locked", "joint": 2, "at": 0.3}]}
    whole = runs.run(setup(**laps), tmp_path / "whole", drawn=False).summary
    parts = runs.run(setup(**laps, log={"part": 15.0, "keep": 2}), tmp_path / "parts", drawn=False).summary
    for facts in (whole, parts):
        del facts["folder"], facts["step_time_us"]
    sums = [facts.pop("rms_position_error") for facts in (parts, whole)]
    assert sums[0] == pytest.approx(sums[1], rel=1e-12)  # in blocks that end by the clock, too
    assert parts == whole
    assert len(log_files(tmp_path / "parts")) == 2 and ftqp.load_log(tmp_path / "parts")["t"][0] > 15.0
    scenario = (tmp_path / "parts" / "scenario.toml").read_text()
    assert "part = 15.0" in scenario and "keep = 2" in scenario


def test_two_runs_into_one_folder_do_not_meet(tmp_path, monkeypatch):
    first, second = setup(), setup()
    folder = runs.free_folder(tmp_path / "out", "x")
    assert runs.free_folder(tmp_path / "out", "x") == folder  # both have looked before either has made it
    facts = runs.run(first, folder, drawn=False).summary
    with pytest.raises(InputError, match="cannot be made: File exists"):
        runs.run(second, folder, drawn=False)
    assert (
        json.loads((folder / "summary.json").read_text())["steps"]
        == facts["steps"]
        == len(ftqp.load_log(folder))
    )


def test_a_disk_that_is_full_in_the_middle_keeps_what_was_written(tmp_path, monkeypatch):
    resource = pytest.importorskip("resource", reason="needs a system that limits the size of files")
    made = setup(path=ROUND | {"laps": 400.0})
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2_400_000, before[1]))
    try:
        with pytest.raises(FtqpError, match=r"cannot be written: .*too large"):
            runs.run(made, tmp_path / "out", drawn=False)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    log = ftqp.load_log(tmp_path / "out")
    assert len(log) and log.metadata["state"] in ("failed", "running")
    assert not (tmp_path / "out" / "summary.json").exists()


@pytest.mark.parametrize("overrides", [[], ["planner.task.mode=scaled"]])
def test_the_joints_are_on_the_path_at_every_sample(overrides):
    setup = load("planar3-line", overrides)
    task, q = healthy_motion(setup)
    assert task.N == 400 and q.shape == (401, 3)
    assert task.t[-1] == pytest.approx(setup.path.duration)
    tips = np.stack([setup.robot.pose(row)[:2, 3] for row in q])
    assert np.abs(tips - task.goals[:, :2, 3]).max() < 2e-3


def test_an_arm_that_does_not_get_there_healthy_is_told():
    with pytest.raises(ScenarioError, match="even while nothing fails"):
        healthy_motion(load("planar3-line", ["faults=", "path.duration=0.3"]))


ARM = catalog.load("planar", count=3)


def rows(arm=ARM, base=None, **metadata):
    """The rows of a log whose first one is the arm at its neutral posture, on a base at ``base``."""
    signals = list(columns(ARM.joints, np.zeros(3, dtype=bool), "acceleration"))
    row = dict.fromkeys((column.name for column in signals), 0.0)
    row |= {f"q.{joint}": value for joint, value in zip(ARM.joints, arm.neutral, strict=True)}
    tip = arm.pose(arm.neutral)[:3, 3] + (0.0 if base is None else base)
    row |= {f"tip.{axis}": value for axis, value in zip("xyz", tip, strict=True)}
    if base is not None:
        from ftqp.sim.log.signals import base_columns

        signals += base_columns(("x",))
        row |= {column.name: 0.0 for column in base_columns(("x",))}
        row |= {f"base.{axis}": value for axis, value in zip("xyz", base, strict=True)}
    table = np.array([[row[column.name] for column in signals]])
    about = {"robot": "planar(3)", "joints": list(ARM.joints)} | metadata
    return LogRows(
        path=None, columns=tuple(signals), metadata=about, count=1, read=lambda first: iter([table[first:]])
    )


SCENARIO = '[robot]\nname = "planar"\noptions = {{ count = {} }}\n[later]\nunknown = 1\n'


@pytest.mark.parametrize("base", [None, np.array([0.3, -2.0, 1.0])])
@pytest.mark.parametrize("about", [{}, {"resolved": SCENARIO.format(3)}])
def test_arm_comes_from_the_scenario_or_the_catalog(about, base):
    robot, why = recorded_robot(rows(base=base, **about))
    assert why == "" and robot is not None and robot.joints == ARM.joints


@pytest.mark.parametrize(
    ("about", "message"),
    [
        ({"resolved": SCENARIO.format(4)}, "has others"),
        ({"resolved": "[robot]\nurdf = '/nowhere/x.urdf'\ntip = 'x'\n"}, "cannot be made"),
        ({"resolved": "[robot]\nname = 'panda'\nurdf = 'x'\n"}, "cannot be made"),
        ({"resolved": "[robot"}, "cannot be made"),
        ({"resolved": "robot = 3"}, "cannot be made"),
        ({"robot": "my arm"}, "does not say which arm"),
        ({"robot": None}, "does not say which arm"),
    ],
)
def test_run_of_an_unknown_arm_says_why(about, message):
    robot, why = recorded_robot(rows(**about))
    assert robot is None and message in why


def test_arm_that_has_changed_since_is_not_that_of_the_run():
    longer = catalog.load("planar", lengths=(0.4, 0.4, 0.4))
    robot, why = recorded_robot(rows(longer))
    assert robot is None and "has changed since the run" in why
