"""The command ``ftqp calibrate`` learns from runs of a healthy arm, and refuses what is none."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from tests.app.conftest import invoke as asked

import ftqp

FRICTION = 0.3


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """A run of a healthy arm with friction, its torques measured, and the same again."""
    folders = [tmp_path_factory.mktemp("runs") / name for name in ("healthy", "again")]
    settings = ["faults=", "sensors.torque_noise=0.1", "path.duration=12.5", "path.turns=3",
                "planner.dt=0.002", f"simulation.mujoco.coulomb={FRICTION}"]  # fmt: skip
    given = [part for one in settings for part in ("--set", one)]
    result = asked("run", "--no-figures", "panda-undetected", *given, "--out", folders[0])
    assert result.exit_code == 0, result.output
    shutil.copytree(*folders)
    return folders


def test_a_run_keeps_torques_and_what_the_drive_asked_for(runs: list[Path]) -> None:
    log = ftqp.load_log(runs[0])
    assert log["tau_measured"].shape == log["tau_demand"].shape == (6251, 7)
    apart = (log["tau_measured"] - log["tau_demand"])[100:]
    assert apart.std() == pytest.approx(0.1, rel=0.1)
    assert log.units["tau_demand.panda_joint1"] == "N m"


def test_a_healthy_run_becomes_a_calibration_that_knows_friction(runs: list[Path], tmp_path: Path) -> None:
    file = tmp_path / "healthy.json"
    result = asked("calibrate", *runs, "--out", file, "--json")
    assert result.exit_code == 0, result.output
    facts: Any = json.loads(result.stdout)
    assert facts["noise"] == pytest.approx(1e-4, rel=0.1)
    found = ftqp.Calibration.load(file)
    assert found.coulomb[1] == pytest.approx(FRICTION, abs=0.25)
    assert sum(0.15 < f < 0.5 for f in found.coulomb) >= 5
    assert asked("calibrate", *runs, "--out", file).exit_code == 2
