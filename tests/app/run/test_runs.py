"""Runs into folders: long ones in parts, two at once, on full disks, with clocks that are set back."""

import json
import os
import re
import subprocess
import sys
import time
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ftqp
from ftqp.app.commands.study_folder import study_folder
from ftqp.app.run import runs
from ftqp.app.run.healthy_motion import task_of
from ftqp.app.scenario.document import Document
from ftqp.app.scenario.setup import Setup, resolve, validated
from ftqp.core import clock
from ftqp.core.errors import FtqpError, InputError, ScenarioError
from ftqp.sim.log.log_writer import log_files


def setup(**tables: Any) -> Setup:
    content: dict[str, Any] = {
        "robot": {"name": "panda"},
        "planner": {"dt": 0.01},
        "path": {"kind": "circle", "radius": 0.02, "duration": 0.5},
    }
    found = Document(name="test", origin="test", folder=Path.cwd(), content=content | tables)
    return resolve(found, validated(found))


ROUND = {"kind": "circle", "radius": 0.02, "duration": 0.5}


def test_a_path_with_laps_is_repeated(tmp_path: Path) -> None:
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
def test_laps_and_parts_that_cannot_be_are_refused(tables: dict[str, Any], said: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        setup(**tables)
    assert said in str(caught.value)


def test_what_a_path_survives_is_asked_of_one_lap() -> None:
    with pytest.raises(ScenarioError, match=r"take path\.laps out"):
        task_of(setup(path=ROUND | {"laps": 2.0}))


def test_a_run_in_parts_sums_up_all_its_ticks(tmp_path: Path) -> None:
    laps = {"path": ROUND | {"laps": 140.0}, "faults": [{"kind": "locked", "joint": 2, "at": 0.3}]}
    whole = runs.run(setup(**laps), tmp_path / "whole", drawn=False).summary
    parts = runs.run(setup(**laps, log={"part": 15.0, "keep": 2}), tmp_path / "parts", drawn=False).summary
    for facts in (whole, parts):
        del facts["folder"], facts["step_time_us"]
    assert parts == whole
    assert len(log_files(tmp_path / "parts")) == 2 and ftqp.load_log(tmp_path / "parts")["t"][0] > 15.0
    scenario = (tmp_path / "parts" / "scenario.toml").read_text()
    assert "part = 15.0" in scenario and "keep = 2" in scenario


def test_figures_of_a_long_run_show_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    drawn: list[Any] = []
    monkeypatch.setattr(runs, "DRAWN", 20_000)
    monkeypatch.setattr(runs, "_figures", lambda log, folder: drawn.append(log) or ())
    runs.run(setup(path=ROUND | {"laps": 2.0}), tmp_path / "run")
    assert 10 < len(drawn[0]) < 40 and drawn[0]["t"][-1] == 1.0
    assert "the figures show the last" in capsys.readouterr().err


def test_two_runs_into_one_folder_do_not_meet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = setup(), setup()
    folder = runs.free_folder(tmp_path / "out", "x")
    assert runs.free_folder(tmp_path / "out", "x") == folder  # both have looked before either has made it
    facts = runs.run(first, folder, drawn=False).summary
    with pytest.raises(InputError, match="exists, and nothing is overwritten; name another one by --out"):
        runs.run(second, folder, drawn=False)
    assert (
        json.loads((folder / "summary.json").read_text())["steps"]
        == facts["steps"]
        == len(ftqp.load_log(folder))
    )


@pytest.mark.parametrize("name", ["x" * 300, f"{'x' * 300}/y"])
def test_name_that_is_too_long_for_a_folder_is_refused(tmp_path: Path, name: str) -> None:
    for find in (runs.free_folder, study_folder):
        with pytest.raises(InputError, match="cannot be made: File name too long"):
            find(tmp_path / name, "x")
    assert not runs.holds(tmp_path / name, "results.sqlite")


@pytest.mark.parametrize("name", ["x" * 248, "\u00fc" * 200])
def test_folder_that_is_named_after_a_long_name_has_its_beginning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = runs.free_folder(None, name)
    folder.mkdir(parents=True)
    assert re.sub(r"-\d{8}-\d{6}-\d{6}$", "", folder.name) in name and folder.name.startswith(name[:100])


@pytest.mark.parametrize("back", [0.0, 3600.0])
def test_a_clock_that_is_set_back_names_no_folder_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, back: float
) -> None:
    times = [1e9, 1e9 - back, 1e9]

    class Clock(datetime):
        @classmethod
        def now(cls, tz: Any = None) -> datetime:
            return datetime.fromtimestamp(times.pop(0))

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(runs, "datetime", Clock)
    found = []
    for _ in range(3):
        found.append(runs.free_folder(None, "x"))
        found[-1].mkdir(parents=True)
    assert len(set(found)) == 3
    assert found[2].name == f"{found[0].name}-{3 if back == 0.0 else 2}"


def test_a_clock_that_is_set_back_changes_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    as_ever = runs.run(setup(), tmp_path / "one", drawn=False).summary
    times = iter(range(10**6, 0, -1))
    monkeypatch.setattr(time, "time", lambda: float(next(times)))
    monkeypatch.setattr(time, "time_ns", lambda: 10**9 * next(times))
    back = runs.run(setup(), tmp_path / "two", drawn=False).summary
    for facts in (as_ever, back):
        del facts["folder"], facts["step_time_us"]
    assert back == as_ever
    assert clock.now.__module__ == "ftqp.core.clock" and clock.now() <= clock.now()


def test_a_disk_that_is_full_in_the_middle_keeps_what_was_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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


@pytest.mark.skipif(os.name == "nt" or not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root")
@pytest.mark.slow
def test_a_file_system_that_is_full_is_said_in_a_sentence(tmp_path: Path) -> None:
    """A real one of 2 MB; where it cannot be mounted there is nothing to be tried."""
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(tmp_path)], check=False
    ).returncode:
        pytest.skip("no file system can be mounted here")
    try:
        ran = subprocess.run(
            [sys.executable, "-m", "ftqp", "run", "panda-circle", "--out", str(tmp_path / "out"), "--json"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert ran.returncode == 2 and "Traceback" not in ran.stderr
        assert "No space left on device" in json.loads(ran.stdout)["error"]
        assert len(ftqp.load_log(tmp_path / "out")) > 0
    finally:
        subprocess.run(["umount", str(tmp_path)], check=False)
