"""``ftqp inspect`` of robots with several tips, and of joints that follow others."""

import json

from tests.telescope import telescope
from typer.testing import CliRunner

from ftqp.app.commands.cli import app


def inspected(*arguments):
    """What it prints, as JSON."""
    done = CliRunner().invoke(app, ["inspect", *arguments, "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_what_a_lock_leaves_is_of_the_tip_that_the_joint_moves(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = inspected("dual_panda")
    left = {joint["name"]: joint["left_when_locked"]["pose"] for joint in found["joints"]}
    assert abs(left["left_joint4"] - left["right_joint4"]) < 0.05 and left["right_joint4"] < 0.8
    assert found["by_tip"]["right_hand"]["joints"] == [f"right_joint{k}" for k in range(1, 8)]


def test_who_mimics_whom_is_said_and_only_motors_count_as_joints_to_spare(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "telescope.urdf"
    file.write_text(telescope(), encoding="utf-8")
    found = inspected(str(file), "--tip", "tool")
    assert found["mimics"]["lift2"] == {"joint": "lift", "ratio": 0.5, "offset": 0.02}
    assert found["redundancy"] == {"pose": 0, "position": 3}
    said = CliRunner().invoke(app, ["inspect", str(file), "--tip", "tool"]).output
    assert "elbow mimics shoulder: q = -0.7 q + 0.3." in said and "no redundancy" in said
