"""``ftqp doctor`` and ``ftqp build``: what is wrong is said with its remedy, and nothing is left behind."""

import json
import re

import pytest
from tests.app.conftest import invoke

from ftqp.app.commands import doctor
from ftqp.app.deployment.built_folder import TEXTS
from ftqp.kernel.building.deployed import exported
from ftqp.kernel.compiled import library


def found():
    result = invoke("doctor", "--json")
    facts = json.loads(result.stdout)
    return result.exit_code, facts, {one["name"]: one for one in facts["checks"]}


def test_this_installation_is_sound():
    code, facts, checks = found()
    assert code == 0 and facts["sound"]
    assert checks["kernel"]["found"].startswith("built for ") and checks["trial"]["state"] == "ok"
    assert "numpy" in checks["needs"]["found"]


def test_a_person_reads_a_line_for_each():
    result = invoke("doctor")
    assert "this installation is sound" in result.stdout and "WRONG" not in result.stdout


def test_an_extra_that_is_missing_is_no_fault_and_its_remedy_is_said(monkeypatch):
    known = doctor.version_of
    monkeypatch.setattr(doctor, "version_of", lambda name: None if name == "mujoco" else known(name))
    code, facts, checks = found()
    assert code == 0 and facts["sound"] and checks["[sim]"]["state"] == "missing"
    assert checks["[sim]"]["remedy"].startswith("for physics: pip install")


def test_a_dependency_that_is_missing_is_a_fault(monkeypatch):
    known = doctor.version_of
    monkeypatch.setattr(doctor, "version_of", lambda name: None if name == "osqp" else known(name))
    code, facts, checks = found()
    assert code == 1 and not facts["sound"] and checks["needs"]["found"] == "without osqp"


def test_a_kernel_that_is_not_built_is_a_fault_with_a_remedy(monkeypatch, tmp_path):
    monkeypatch.setattr(doctor, "BUILT", tmp_path)
    code, _, checks = found()
    assert code == 1 and checks["kernel"]["found"].startswith("plain Python: ")
    assert checks["kernel"]["remedy"]
    monkeypatch.setattr(library, "PLAIN", True)
    assert "NUMBA_DISABLE_JIT" in found()[2]["kernel"]["found"]


PROMISED = {
    "size", "open", "reset", "step", "report", "withdraw", "stop", "resume", "speed", "carry", "q", "v", "a",
    "tau", "status", "error", "status_name", "detect", "watch", "follow", "progress", "begin",
    "tip", "joints", "drive", "dt", "open_for", "brakes", "stop_reason", "stop_reason_name",
    "aim", "aim_joints", "believed", "brake", "clearance", "has", "move", "task_error", "tasks", "things",
    "tool", "weight", "go_to", "go_round", "go_to_pose", "go", "arrived", "seek", "find", "search_size",
    "ways_size", "ways_out", "try", "go_out",
}  # fmt: skip


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (["pnada", "-o", "new"], "'pnada' is not a robot, scenario or file of ftqp .did you mean 'panda'"),
        (["panda", "-o", "/proc/x3"], "/proc/x3 cannot be made: .*; give a place that is writable with -o"),
        (["panda", "--page", "/proc/x3.html"], "/proc/x3.html cannot be made: .* with --page"),
        (["panda", "-o", "here"], "folder here is there already"),
        (["panda", "-o", "no/such"], "folder .*no is missing"),
        (["panda", "--set", "planner.dt=0.01", "-o", "new"], "panda is a robot, no scenario"),
        (["iiwa-moving-base-locked", "-o", "new"], "has a base that moves"),
        (
            ["panda", "--with", "paths", "-o", "new"],
            "'paths' is not a part of ftqp build .*; it has detector, path",
        ),
        (["panda", "--with", "path", "-o", "new"], "panda is a robot and has no path"),
        (["panda-circle", "--with", "path", "-o", "new"], "give --set planner.task.mode=scaled"),
        (["panda", "--tip", "panda_hand", "-o", "new"], "panda is a robot of the catalog, which has its tip"),
        (
            ["panda-circle", "--tip", "tool0", "-o", "new"],
            "panda-circle is a scenario, whose .* leave --tip out",
        ),
        (["arm.urdf", "--tip", "tool0", "-o", "new"], "'arm.urdf' does not exist"),
        (["panda"], "nothing to make: give a folder with -o, or a file with --page"),
        (["panda", "--page", "new.html", "--target", "host"], "--page is for browsers, got --target host"),
        (["panda", "--page", "here"], "file here is there already"),
        (["panda", "--page", "no/such.html"], "folder .*no is missing"),
    ],
)
def test_what_cannot_be_built_is_a_sentence_and_leaves_nothing(given, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here").mkdir()
    done = invoke("build", *given)
    assert done.exit_code == 2
    assert [path.name for path in tmp_path.iterdir()] == ["here"]
    assert re.search(sentence, done.output.replace("\n", " ")), done.output


def test_the_header_declares_what_is_promised_and_nothing_else():
    assert exported(TEXTS / "ftqp.h") == sorted(f"ftqp_{name}" for name in PROMISED)
