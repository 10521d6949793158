"""``ftqp build`` refuses what it cannot build in a sentence, and leaves nothing behind."""

import re

import pytest
from tests.app.conftest import invoke

from ftqp.app.deployment.built_folder import TEXTS
from ftqp.kernel.building.deployed import exported

PROMISED = {
    "size", "open", "reset", "step", "report", "withdraw", "stop", "resume", "speed", "carry", "q", "v", "a",
    "tau", "status", "error", "status_name", "detect", "watch", "follow", "progress", "begin",
    "tip", "joints", "drive", "dt", "open_for", "brakes", "stop_reason", "stop_reason_name",
    "aim", "aim_joints", "believed", "brake", "clearance", "has", "move", "task_error", "tasks", "things",
    "tool", "weight", "go_to", "go", "arrived",
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
        (["panda-circle", "--with", "path", "-o", "new"], "scaled"),
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
        (
            ["modular11-locked", "--set", "planner.backend=daqp", "-o", "new"],
            "expected the backend 'active_set'",
        ),
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
