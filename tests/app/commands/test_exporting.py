"""``ftqp export`` on real runs: with sensors, on a moving base, with a sliding joint, cut short."""

import json
import os
import sys

import numpy as np
import pytest
from scipy.io import loadmat
from tests.app.conftest import invoke

import ftqp
from ftqp.core.extras import remedy_for_extra
from ftqp.model import catalog

pytest.importorskip("rosbags", reason='needs the extra "ros": pip install -e ".[ros]"')

FORMATS = {"csv": "log.csv", "npz": "log.npz", "mat": "log.mat", "mcap": "bag", "trajectory": "trajectory"}
SHORT = {
    "panda-detected": ["--set", "simulation.duration=0.06", "--set", "faults="],
    "iiwa-moving-base-locked": ["--set", "simulation.duration=0.06", "--set", "faults="],
}
SLIDING = """
[robot]
urdf = "slide.urdf"
tip = "{tip}"
[path]
kind = "hold"
duration = 0.05
[planner.task]
rows = ["x", "y"]
"""


def ftqp_command(*arguments):
    result = invoke(*arguments)
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture(scope="module", params=SHORT)
def run(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "run"
    code, _, errors = ftqp_command(
        "run", "--no-figures", request.param, *SHORT[request.param], "--out", folder
    )
    assert code in (0, 1), errors
    return folder


@pytest.mark.parametrize("form", FORMATS)
def test_run_is_written_beside_its_log_or_where_it_is_wanted(run, tmp_path, form):
    code, out, errors = ftqp_command("export", run, "--format", form, "--json")
    assert code == 0, errors
    facts = json.loads(out)
    assert facts["file"] == str(run / FORMATS[form]) and facts["bytes"] > 1000
    assert facts["ticks"] == len(ftqp.load_log(run))
    code, _, errors = ftqp_command("export", run / "log.npy", "--format", form)
    assert code == 2 and "exists, and nothing is overwritten" in errors
    code, out, _ = ftqp_command("export", run / "log.npy", "--format", form, "-o", tmp_path / "new")
    assert code == 0 and str(tmp_path / "new") in out


def test_robot_of_the_catalog_is_written_as_urdf(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert ftqp_command("export", "iiwa14", "--format", "urdf")[0] == 0
    again, robot = ftqp.Robot.from_urdf(tmp_path / "iiwa14.urdf"), catalog.load("iiwa14")
    np.testing.assert_allclose(again.pose(robot.neutral), robot.pose(robot.neutral), atol=1e-12)
    code, _, errors = ftqp_command("export", "iiwa14", "--format", "urdf")
    assert code == 2 and "nothing is overwritten" in errors


def test_sliding_joint_is_written(tmp_path):
    table = [[0.0, 0.3, 0.1, 1.6], [0.0, 0.2, 0.0, -1.6], [0.2, 0.0, 0.4, 0.0]]
    robot = ftqp.Robot.from_dh(table, prismatic=[1], limits={"v_max": 1.0})
    (tmp_path / "slide.urdf").write_text(robot.to_urdf())
    (tmp_path / "slide.toml").write_text(SLIDING.format(tip=robot.tip))
    code, _, errors = ftqp_command("run", "--no-figures", tmp_path / "slide.toml", "--out", tmp_path / "run")
    assert code == 0, errors
    for form in FORMATS:
        assert ftqp_command("export", tmp_path / "run", "--format", form)[0] == 0
    found = loadmat(tmp_path / "run" / "log.mat", simplify_cells=True)
    np.testing.assert_array_equal(found["q"], ftqp.load_log(tmp_path / "run")["q"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("panda", "--format", "csv"), "panda is a robot, no run"),
        (("pandaa", "--format", "urdf"), "did you mean 'panda'"),
        (("nowhere/run", "--format", "csv"), "`ftqp run SCENARIO --out FOLDER` makes a run"),
        ((".", "--format", "csv"), "does not exist; expected a log.npy"),
    ],
)
def test_what_cannot_be_exported_is_said(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, out, errors = ftqp_command("export", *arguments)
    assert code == 2 and message in errors and out == ""
    assert os.listdir(tmp_path) == []


def test_trajectory_that_ends_in_motion_is_noted(tmp_path):
    arguments = ["--set", "simulation.duration=0.5", "--set", "faults="]
    ftqp_command("run", "--no-figures", "panda-circle", *arguments, "--out", tmp_path / "run")
    code, out, _ = ftqp_command("export", tmp_path / "run", "--format", "trajectory", "--json")
    facts = json.loads(out)
    assert code == 0 and facts["last_speed"] > 1e-4
    assert "allow_nonzero_velocity_at_trajectory_end" in facts["notes"][0]


def test_without_rosbags_the_extra_is_named(run, tmp_path, monkeypatch):
    for name in list(sys.modules):
        if name.startswith(("ftqp.sim.export", "rosbags")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "rosbags.interfaces", None)
    code, _, errors = ftqp_command("export", run, "--format", "mcap", "-o", tmp_path / "bag")
    assert code == 2
    needs = "a ROS 2 bag needs the package 'rosbags', which is not installed"
    assert f"{needs}; {remedy_for_extra('ros')}" in errors
    assert os.listdir(tmp_path) == []
