"""``ftqp compare``: what is run, the files, the table that is printed, the exit code."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from tests.app.conftest import SHORT, heed_interrupts
from tests.app.conftest import invoke as command

import ftqp
from ftqp.app.compare import combinations as module
from ftqp.app.compare import comparison
from ftqp.app.compare.combinations import combinations
from ftqp.core.errors import FtqpError, MissingPackage, ScenarioError


@pytest.fixture
def without_daqp(monkeypatch: pytest.MonkeyPatch) -> None:
    """The package of one backend is missing."""
    real = module.qp_backend

    def fake(spec: Any) -> Any:
        if spec in ("daqp", {"name": "daqp"}):
            raise MissingPackage("backend 'daqp'", "daqp", "pip install daqp")
        return real(spec)

    monkeypatch.setattr(module, "qp_backend", fake)


def test_every_combination_is_run_once(short: Path) -> None:
    found = combinations([str(short)], backends="active_set,osqp", schemes="mvn, rmp")
    assert [(c.scheme, c.backend) for c in found] == [
        ("mvn", "active_set"), ("mvn", "osqp"), ("rmp", "active_set"), ("rmp", "osqp"),
    ]  # fmt: skip
    assert all(c.setup is not None and c.setup.planner.backend == c.backend for c in found)
    assert all(c.setup is not None and c.setup.planner.scheme.name == c.scheme for c in found)
    assert len({c.name for c in found}) == 4


def test_scenarios_keep_their_own_scheme_and_backend(short: Path) -> None:
    found = combinations([str(short), "planar6-square"], backends=None, schemes=None)
    assert [(c.scenario, c.scheme, c.backend) for c in found] == [
        ("short", "mvn", "active_set"),
        ("planar6-square", "dlsm", "active_set"),
    ]


def test_tables_and_profiles_are_taken_and_named(short: Path, tmp_path: Path) -> None:
    profile = tmp_path / "loose.toml"
    profile.write_text('name = "osqp"\ntolerance = 1e-6\n')
    found = combinations(
        [str(short)], backends=f"osqp,{profile}", schemes='{ name = "dlsm", alpha = 0.5 },mvn'
    )
    assert [c.scheme for c in found] == ["dlsm alpha=0.5"] * 2 + ["mvn"] * 2
    assert [c.backend for c in found] == ["osqp", "loose"] * 2
    assert not any(set(" ,:{}") & set(c.name) for c in found)


def test_scenarios_with_the_same_name_are_told_apart(short: Path, tmp_path: Path) -> None:
    other = tmp_path / "other" / "short.toml"
    other.parent.mkdir()
    other.write_text(short.read_text())
    found = combinations([str(short), str(other)], backends=None, schemes=None)
    assert len({c.scenario for c in found}) == 2
    assert len({c.name for c in found}) == 2


def test_every_wrong_name_is_told_at_once(short: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        combinations(
            [str(short), "panda-cirle"], ["planner.dt=0"], backends="dacqp,osqp,osqp,", schemes="mnv"
        )
    summary = "\n".join(caught.value.errors)
    for words in (
        "--schemes: 'mnv' is not a scheme (did you mean 'mvn'?)",
        "--backends: 'dacqp' is not a backend of ftqp (did you mean 'daqp'?)",
        "--backends: 'osqp' is there 2 times, expected once",
        "expected names separated by commas",
        "panda-cirle: panda-cirle is neither a file nor a bundled scenario",
        "short: planner.dt is 0",
    ):
        assert words in summary
    assert len(caught.value.errors) == 6


def test_a_backend_that_is_not_installed_says_why_and_the_rest_runs(short: Path, without_daqp: None) -> None:
    found = combinations([str(short)], backends="active_set,daqp", schemes=None)
    assert [c.setup is None for c in found] == [False, True]
    assert "pip install daqp" in found[1].reason
    with pytest.raises(ScenarioError, match="pip install daqp"):
        combinations([str(short)], backends="daqp", schemes=None)


def test_a_combination_that_the_planner_refuses_is_left_out() -> None:
    found = combinations(["zhang7-short"], backends=None, schemes="rmp,mke")
    assert [c.setup is None for c in found] == [False, True] and "needs inertia" in found[1].reason
    with pytest.raises(ScenarioError, match="needs inertia"):
        combinations(["zhang7-short"], backends=None, schemes="mke")


invoke = partial(command, "compare")


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Path]:
    """What a comparison printed, and its folder."""
    folder = tmp_path_factory.mktemp("compare")
    (folder / "short.toml").write_text(SHORT)
    out = folder / "out"
    return invoke(
        folder / "short.toml", "--backends", "active_set,osqp", "--no-figures", "--out", out, "--json"
    ), out


def test_json_is_one_object_with_a_summary_for_every_run(compared: tuple[Any, Path]) -> None:
    result, out = compared
    assert result.exit_code == 0, result.output
    runs = json.loads(result.stdout)["runs"]
    assert [run["backend"] for run in runs] == ["active_set", "osqp"]
    assert json.loads((out / "comparison.json").read_text()) == {"runs": runs}
    for run in runs:
        summary = json.loads((out / run["run"] / "summary.json").read_text())
        assert {key: run[key] for key in summary} == summary
        assert len(ftqp.load_log(out / run["run"])) == 51


def test_csv_has_a_line_for_every_run_in_si_units(compared: tuple[Any, Path]) -> None:
    result, out = compared
    lines = list(csv.DictReader((out / "comparison.csv").read_text().splitlines()))
    runs = json.loads(result.stdout)["runs"]
    assert [float(line["max_position_error"]) for line in lines] == [
        run["max_position_error"] for run in runs
    ]
    assert [float(line["step_time_us.p99"]) for line in lines] == [run["step_time_us"]["p99"] for run in runs]


def test_a_stopped_run_makes_the_exit_code_1(tmp_path: Path) -> None:
    result = invoke("--no-figures", "planar6-stop", "--schemes", "dlsm", "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert "stopped at 16.8" in result.stdout


def test_bad_input_exits_2_and_leaves_no_folder(short: Path, tmp_path: Path) -> None:
    result = invoke(short, "--schemes", "mvnn", "--backends", "dacqp", "--out", tmp_path / "out", "--json")
    assert result.exit_code == 2
    assert len(json.loads(result.stdout)["errors"]) == 2
    assert not (tmp_path / "out").exists()


def test_a_run_that_breaks_off_is_told_and_the_rest_runs(
    short: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = comparison.runs.run

    def full(setup: Any, folder: Path, **options: Any) -> Any:
        if setup.planner.scheme.name == "mvn":
            raise FtqpError("log cannot be written: disk full")
        return real(setup, folder, **options)

    monkeypatch.setattr(comparison.runs, "run", full)
    result = invoke("--no-figures", short, "--schemes", "mvn,rmp", "--out", tmp_path / "out", "--json")
    first, second = json.loads(result.stdout)["runs"]
    assert result.exit_code == 1
    assert (first["ran"], first["reason"]) == (False, "log cannot be written: disk full")
    assert second["completed"] is True


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for another process")
def test_ctrl_c_keeps_finished_runs_and_shows_what_there_is(short: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    long = tmp_path / "long.toml"
    long.write_text(short.read_text() + "\n[simulation]\nduration = 20000.0\n")
    process = subprocess.Popen(
        [sys.executable, "-m", "ftqp", "compare", "--no-figures", str(short), str(long), "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heed_interrupts if os.name != "nt" else None,
    )
    log = out / "long-mvn-active_set" / "log.npy"
    for _ in range(1200):
        time.sleep(0.1)
        if process.poll() is not None or (log.exists() and log.stat().st_size > 500_000):
            break
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=60)
    assert process.returncode == 130, stderr
    assert "Traceback" not in stderr
    first, second = json.loads((out / "comparison.json").read_text())["runs"]
    assert first["completed"] is True
    assert second["interrupted"] is True
    assert second["steps"] == len(ftqp.load_log(log.parent))
    assert "interrupted at" in stdout
    assert (out / "short-mvn-active_set" / "summary.json").exists()


def row(label: str = "a", scenario: str = "s", **facts: Any) -> dict[str, Any]:
    """A run that went well, as far as ``facts`` do not say otherwise."""
    return {
        "run": f"{scenario}-{label}",
        "label": {"scenario": scenario, "scheme": "mvn", "backend": label},
        "ran": True,
        "reason": None,
        "robot": "planar6",
        "level": "acceleration",
        "dt": 0.01,
        "steps": 51,
        "completed": True,
        "interrupted": False,
        "stopped_at": None,
        "status_counts": {"OK": 51},
        "max_position_error": 2e-6,
        "rms_position_error": 1e-6,
        "max_limit_violation": {"q": 0.0, "v": 0.0, "a": 0.0, "tau": 0.0},
        "max_failed_joint_motion": {"j2": 0.0},
        "qp": {"iterations_median": 1.0, "iterations_max": 2.0},
        "step_time_us": {"p50": 5.0, "p99": 9.0},
        "faults": [],
    } | facts


def cells(rows: list[dict[str, Any]]) -> dict[str, tuple[str, ...]]:
    """The whole table by heading."""
    table = comparison.table_of(rows, comparison.reasons(rows))
    return {
        head.replace("/\n", "/").replace("\n", " "): tuple(line[at] for line in table.rows)
        for at, head in enumerate(table.heads)
    }


def test_the_best_completed_run_is_marked_by_a_sign() -> None:
    table = cells(
        [row("a"), row("b", max_position_error=1e-6), row("c", max_position_error=5e-7, completed=False)]
    )
    assert table["max error [mm]"] == ("0.002", "0.001*", "0.0005")


def test_exceeded_limits_stopping_and_counts_are_told() -> None:
    bad = row(
        "b",
        completed=False,
        stopped_at=16.83,
        status_counts={"OK": 1, "RELAXED": 12, "FALLBACK": 3},
        max_limit_violation={"q": 0.0, "v": 1e-10, "a": 0.012, "tau": 3.0},
        max_failed_joint_motion={"j1": 0.0, "j2": 0.25},
    )
    table = cells([row(), bad])
    assert table["result"] == ("completed", "stopped at 16.83 s")
    assert table["limits"] == ("kept", "a by 0.012, tau by 3")
    assert table["relaxed/scaled/fallback"] == ("0/0/0", "12/0/3")
    assert table["failed joint moved [rad]"] == ("0", "0.25")


def test_a_run_that_could_not_be_made_has_the_number_of_its_reason(tmp_path: Path) -> None:
    absent = {key: row("b")[key] for key in ("run", "label")} | {"ran": False, "reason": "no gurobi"}
    rows = [row(), absent | {"completed": False}]
    assert cells(rows)["result"] == ("completed", "not run (1)")
    assert cells(rows)["max error [mm]"] == ("0.002", "-")
    made = comparison.Comparison(folder=tmp_path, rows=tuple(rows), interrupted=False, failed=False)
    assert "(1) no gurobi" in made.summary()
