"""The command line: exit codes, what goes to stdout and what to stderr, files that are whole or not there."""

import json
import os
import re
import signal
import subprocess
import sys
import time

import pytest
from tests.app.conftest import SHORT, heed_interrupts, invoke

import ftqp
from ftqp.app.commands.demo import FINDS, OWN_REPORTED, RIVAL_NEVER, RIVAL_REPORTED
from ftqp.core.extras import remedy_for_extra

COMMANDS = (
    "demo", "run", "compare", "replay", "check", "inspect", "converge", "workspace", "robots", "backends",
    "schemes", "report",
)  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_every_command_has_an_example(command):
    result = invoke(command, "--help")
    assert result.exit_code == 0
    assert f"Example: ftqp {command}" in result.stdout


def test_version_is_that_of_the_package():
    assert invoke("--version").stdout == f"ftqp {ftqp.__version__}\n"


@pytest.mark.parametrize("arguments", [("fly",), ("run",), ("run", "panda-circle", "--sett", "a=1")])
def test_wrong_usage_exits_2(arguments):
    assert invoke(*arguments).exit_code == 2


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """What a run of the short scenario said, and its folder."""
    folder = tmp_path_factory.mktemp("ran")
    (folder / "short.toml").write_text(SHORT, encoding="utf-8")
    result = invoke("run", folder / "short.toml", "--out", folder / "deep" / "out")
    assert result.exit_code == 0, result.output
    return result, folder / "deep" / "out"


def test_run_writes_log_summary_and_resolved_scenario(ran):
    result, out = ran
    assert {"log.npy", "scenario.toml", "summary.json"} <= {file.name for file in out.iterdir()}
    assert len(ftqp.load_log(out)["t"]) == 51
    assert len(list((out / "figures").glob("*.png"))) >= 3
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["scenario"], summary["robot"], summary["steps"]) == ("short", "planar6", 51)
    assert summary["max_failed_joint_motion"] == {"j2": 0.0}
    assert "every joint limit was kept" in result.stdout
    assert str(out) in result.stdout


def test_run_without_matplotlib_says_so_and_goes_on(short, tmp_path):
    code = "import sys; sys.modules['matplotlib'] = None; from ftqp.app.commands.cli import main; main()"
    result = subprocess.run(
        [sys.executable, "-c", code, "run", str(short), "--out", str(tmp_path / "out")],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert remedy_for_extra("viz") in result.stderr
    assert not (tmp_path / "out" / "figures").exists()


def test_resolved_scenario_of_a_run_gives_the_same_run_and_json_is_one_object_and_nothing_else(ran, tmp_path):
    again = tmp_path / "again"
    result = invoke("run", "--no-figures", ran[1] / "scenario.toml", "--out", again, "--json")
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["completed"] is True and not (again / "figures").exists()
    assert (ftqp.load_log(again)["q"] == ftqp.load_log(ran[1])["q"]).all()


def test_error_with_json_is_one_object_that_lists_all_errors(short):
    result = invoke("run", short, "--set", "planner.dt=0", "--set", "planner.level=x", "--json")
    assert result.exit_code == 2
    assert [line.partition(" ")[0] for line in json.loads(result.stdout)["errors"]] == [
        "planner.dt",
        "planner.level",
    ]
    assert "planner.dt is 0" in result.stderr


def test_a_task_that_is_not_completed_exits_1(tmp_path):
    result = invoke("run", "--no-figures", "planar6-stop", "--out", tmp_path / "out", "--json")
    summary = json.loads(result.stdout)
    assert result.exit_code == 1
    assert summary["completed"] is False
    assert summary["final_status"] == "STOPPED"
    assert 16.0 < summary["stopped_at"] < 17.2


def test_an_existing_folder_is_left_alone(short, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "mine.txt").write_text("mine")
    result = invoke("run", short, "--out", out)
    assert result.exit_code == 2
    assert "nothing is overwritten" in result.stderr
    assert [file.name for file in out.iterdir()] == ["mine.txt"]


def test_default_folder_is_named_by_scenario_and_time(short, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        assert invoke("run", "--no-figures", short).exit_code == 0
    names = [folder.name for folder in (tmp_path / "runs").iterdir()]
    assert len(names) == 2
    assert all(name.startswith("short-") for name in names)


def test_backend_or_its_profile_and_scheme_replace_those_of_the_scenario(short, tmp_path):
    profile = tmp_path / "mine.toml"
    profile.write_text('name = "osqp"\ntolerance = 1e-9\n')
    for given, expected in (("daqp", "daqp"), (profile, "osqp")):
        chosen = ("--backend", given, "--scheme", "rmp", "--out", tmp_path / expected)
        result = invoke("run", "--no-figures", short, *chosen, "--json")
        summary = json.loads(result.stdout)
        assert (summary["backend"], summary["scheme"]) == (expected, "rmp")


def test_a_fault_that_never_happens_is_a_warning_before_and_said_after(short, tmp_path):
    late = short.read_text(encoding="utf-8").replace("at = 0.2", "at = 30")
    short.write_text(late, encoding="utf-8")
    checked = invoke("check", short)
    assert checked.exit_code == 0 and "warning: the fault of j2 at 30 s comes too late" in checked.stderr
    ran = invoke("run", "--no-figures", short, "--out", tmp_path / "out")
    assert "j2 locks at 30 s only, behind the end of the run" in ran.stdout


def test_keys_of_a_scenario_come_with_default_and_unit():
    rows = {row["key"]: row for row in json.loads(invoke("check", "--keys", "--json").stdout)["keys"]}
    assert rows["planner.dt"] == {
        "key": "planner.dt",
        "default": "0.001",
        "unit": "s",
        "meaning": "the sampling period, > 0 and at most 1",
    }
    assert rows["path(circle).radius"]["default"] == "needed"
    assert all(row["meaning"] for row in rows.values())


def test_backends_tell_licence_and_state():
    rows = {row["name"]: row for row in json.loads(invoke("backends", "--json").stdout)["backends"]}
    assert rows["active_set"]["state"] == "ready"
    assert "GPL" in rows["quadprog"]["licence"]


def _rows(out):
    """How many rows a log keeps whatever happens to its run: a file grows before they are committed."""
    try:
        return len(ftqp.load_log(out))
    except ftqp.FtqpError:
        return 0


def _started(short, out):
    """A run that lasts, once its log has rows."""
    run = subprocess.Popen(
        [
            *(sys.executable, "-m", "ftqp", "run", str(short), "--json"),
            *("--out", str(out), "--set", "simulation.duration=20000.0"),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heed_interrupts if os.name != "nt" else None,
    )
    for _ in range(1200):
        time.sleep(0.1)
        if run.poll() is not None:
            break
        if _rows(out) > 1000:
            return run
    stdout, stderr = run.communicate()
    raise AssertionError(f"the run ended early or never began: {stdout}{stderr}")


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for another process")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_ctrl_c_and_sigterm_leave_complete_files(short, tmp_path, number, code):
    run = _started(short, tmp_path / "out")
    run.send_signal(number)
    stdout, stderr = run.communicate(timeout=60)
    assert run.returncode == code, stderr
    assert "Traceback" not in stderr
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert json.loads(stdout) == summary
    assert summary["interrupted"] is True
    assert summary["completed"] is False
    log = ftqp.load_log(tmp_path / "out")
    assert len(log) == summary["steps"]
    assert log.metadata["state"] == "interrupted"


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_a_killed_run_leaves_a_readable_log(short, tmp_path):
    run = _started(short, tmp_path / "out")
    run.kill()
    run.communicate(timeout=60)
    log = ftqp.load_log(tmp_path / "out")
    assert len(log) > 1000
    assert log.metadata["state"] == "running"
    assert not (tmp_path / "out" / "summary.json").exists()


ASKED = """
import sys
from ftqp.__main__ import main
from ftqp.kernel.compiled.library import Kernel
from ftqp.kernel.entry.table import PARTS

load, there = Kernel.load, {entry.name for entry in PARTS[sys.argv.pop(1)]}

def noted(self, entry):
    if entry.name not in there:
        sys.stderr.write(f"not built first: {entry.name}\\n")
    return load(self, entry)

Kernel.load = noted
main()
"""
"""The command line, which names what it asks of the kernel beside the part that ``make demo`` waits for."""


def told(part, *arguments):
    """What the demo tells, with no more of the kernel than that part."""
    result = subprocess.run(
        [sys.executable, "-P", "-c", ASKED, part, "demo", *arguments],
        capture_output=True, text=True, timeout=300, check=False, env=os.environ | {"COLUMNS": "200"},
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert "not built first" not in result.stderr, result.stderr
    return result.stdout


def test_demo_tells_of_the_brake(tmp_path):
    said = told("first", "brake", "--out", str(tmp_path / "out"))
    for words in (
        "panda_joint3",
        "every joint limit was kept",
        "the detector named it after",
        "completed",
        "damped resolved rates, not reported",
        "less than ftqp",
        "rivals.png",
        "ftqp report",
        str(tmp_path / "out"),
    ):
        assert words in said
    assert (tmp_path / "out" / "figures" / "rivals.png").stat().st_size > 20_000
    assert ftqp.load_log(tmp_path / "out").metadata["faults"][0]["announced"] is None
    assert ftqp.load_log(tmp_path / "out" / "reported").metadata["faults"][0]["announced"] == 2.2
    rows = re.findall(r"^(\w[\w, ]+?) +([\d.]+ [mu]m) +([\d.]+ [mu]m) +([\d.]+ [mu]m)$", said, re.M)
    assert [name for name, *_ in rows] == [FINDS, OWN_REPORTED, RIVAL_NEVER, RIVAL_REPORTED]


@pytest.mark.slow
def test_demo_goes_on_with_a_box_and_a_goal(tmp_path):
    said = told("demo", "box", "goal", "--out", str(tmp_path / "out"))
    assert "stays 20 mm from it, as asked" in said and "and run into it" in said
    ends = re.findall(r"([\d.]+ [mu]m) and ([\d.]+) degrees off", said)
    assert len(ends) == 2 and float(ends[0][1]) < 0.1 and float(ends[1][1]) > 30.0
    assert "detects it (panda_joint1)" in said
    assert said.rstrip().endswith("ftqp view")
    assert ftqp.load_log(tmp_path / "out" / "box").metadata["faults"][0]["announced"] is None


def test_a_part_that_the_demo_does_not_have_is_refused(tmp_path):
    refused = invoke("demo", "breaks", "--out", tmp_path / "out")
    assert refused.exit_code == 2
    assert "'breaks' is no part of the demo; it has brake, box, goal" in refused.stderr
    assert not (tmp_path / "out").exists()


def test_checked_scenario_is_the_start_of_an_own_one(tmp_path):
    """``ftqp check NAME > my.toml`` is a scenario that resolves to itself and runs."""
    mine, checked = tmp_path / "my.toml", invoke("check", "panda-circle")
    assert checked.exit_code == 0
    mine.write_text(checked.stdout, encoding="utf-8")
    assert invoke("check", mine).stdout == checked.stdout
    ran = invoke(
        "run", "--no-figures", mine, "--set", "simulation.duration=0.3", "--out", tmp_path / "out", "--json"
    )
    assert json.loads(ran.stdout)["steps"] > 1
