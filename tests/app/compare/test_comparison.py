"""``ftqp compare``: the runs, the files, what is printed, the exit code."""

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
from tests.app.conftest import SHORT
from tests.app.conftest import invoke as command

import ftqp
from ftqp.app.compare import comparison
from ftqp.core.errors import FtqpError

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


def test_markdown_has_the_table(compared: tuple[Any, Path]) -> None:
    text = (compared[1] / "comparison.md").read_text()
    assert "## short, scheme mvn" in text
    assert "- j2 locks at 0.2 s; reported at once" in text


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


def _heed_interrupts() -> None:
    """Ctrl-C means something to the child even if the tests run in the background, where shells ignore it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


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
        preexec_fn=_heed_interrupts if os.name != "nt" else None,
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
