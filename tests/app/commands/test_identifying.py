"""``ftqp identify`` finds from logs what an arm has beside its model; ``ftqp calibrate`` learns from runs."""

import json
import shutil
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.app.conftest import invoke
from tests.model.fitting.conftest import Truth, recorded

import ftqp
from ftqp.sim.torque_logs import write_torque_log

asked = partial(invoke, "identify")


@pytest.fixture(scope="module")
def file(panda: ftqp.Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a true Panda that carries 1.5 kg and has rotors of 0.1 kg m2."""
    n = panda.nv
    truth = Truth(
        np.full(n, 0.1), np.full(n, 0.3), np.full(n, 0.2), ftqp.Payload(1.5), np.zeros(n), np.zeros(n)
    )
    motion = ftqp.exciting_motion(panda, duration=8.0, dt=0.004)
    path = tmp_path_factory.mktemp("logs") / "log.csv"
    write_torque_log(path, panda.joints, recorded(panda, motion, truth))
    return path


def test_rotors_and_load_of_a_log_are_said_and_kept(file: Path, tmp_path: Path) -> None:
    urdf = tmp_path / "fitted.urdf"
    result = asked(file, "--robot", "panda", "-o", urdf, "--json")
    assert result.exit_code == 0, result.output
    facts: Any = json.loads(result.stdout)
    assert facts["rotors"]["panda_joint2"]["value"] == pytest.approx(0.1, abs=0.04)
    assert facts["load"]["mass"] == pytest.approx(1.5, rel=0.05)
    assert not facts["offsets"]["panda_joint1"]["shown"]
    again = ftqp.Robot.from_urdf(urdf)
    np.testing.assert_allclose(again.chain.armature, 0.1, atol=0.05)
    np.testing.assert_allclose(again.coulomb, 0.3, atol=0.05)


def test_a_person_reads_a_table_and_what_is_not_shown(file: Path) -> None:
    result = asked(file, "--robot", "panda")
    assert result.exit_code == 0, result.output
    assert "A load of 1." in result.output and "not shown" in result.output
    assert "the motion does not show the encoder offset of panda_joint1" in result.output
    assert "8 s of motion are little" in result.output


def test_a_motion_is_written_and_rehearsed(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason='needs the extra "sim"')
    motion, log = tmp_path / "motion.csv", tmp_path / "log.csv"
    result = asked(
        "--motion", "panda-mujoco-payload", "--seconds", "6", "-o", motion, "--rehearse", log, "--json"
    )
    assert result.exit_code == 0, result.output
    assert len(motion.read_text().splitlines()) == 6002
    result = asked(log, "--robot", "panda-mujoco-payload", "--only", "rotors,coulomb,load", "--json")
    facts: Any = json.loads(result.stdout)
    assert facts["load"]["mass"] == pytest.approx(0.5, rel=0.1)
    assert facts["coulomb"]["panda_joint2"]["value"] == pytest.approx(0.5, rel=0.1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "no log was given"),
        (("none.csv",), "does not say of which arm it is"),
        (("none.csv", "--robot", "pandas"), "'pandas'"),
        (("none.csv", "--robot", "panda"), "does not exist"),
        (("none.csv", "--robot", "panda", "--only", "rotor"), "'rotor'"),
        (("none.csv", "--robot", "panda", "-o", "found.txt"), "ends in .urdf"),
        (("none.csv", "--robot", "panda", "--rehearse", "log.csv"), "--rehearse goes with --motion"),
        (("--motion", "panda"), "expected a new .csv file"),
        (("--motion", "panda", "-o", "m.csv", "--rehearse", "l.csv"), "takes what is true of the arm from a"),
        (("log.csv", "--motion", "panda", "-o", "m.csv"), "writes a motion for an arm and reads no log"),
    ],
)
def test_what_does_not_go_together_is_refused(arguments: tuple[str, ...], message: str) -> None:
    result = asked(*arguments)
    assert result.exit_code == 2
    assert message in " ".join(result.output.split())


def test_a_run_without_torques_is_refused(tmp_path: Path) -> None:
    run = tmp_path / "run"
    given = ["--set", "faults=", "--set", "simulation.duration=0.5"]
    assert invoke("run", "--no-figures", "panda-circle", *given, "--out", run).exit_code in (0, 1)
    result = asked(run)
    assert result.exit_code == 2 and "keeps no torques of motors" in result.output


FRICTION = 0.3


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A run of a healthy arm with friction, its torques measured, and the same again."""
    folders = [tmp_path_factory.mktemp("runs") / name for name in ("healthy", "again")]
    settings = ["faults=", "sensors.torque_noise=0.1", "path.duration=12.5", "path.turns=3",
                "planner.dt=0.002", f"simulation.mujoco.coulomb={FRICTION}"]  # fmt: skip
    given = [part for one in settings for part in ("--set", one)]
    result = invoke("run", "--no-figures", "panda-undetected", *given, "--out", folders[0])
    assert result.exit_code == 0, result.output
    shutil.copytree(*folders)
    return folders


def test_a_run_keeps_torques_and_what_the_drive_asked_for(runs):
    log = ftqp.load_log(runs[0])
    assert log["tau_measured"].shape == log["tau_demand"].shape == (6251, 7)
    apart = (log["tau_measured"] - log["tau_demand"])[100:]
    assert apart.std() == pytest.approx(0.1, rel=0.1)
    assert log.units["tau_demand.panda_joint1"] == "N m"


def test_a_healthy_run_becomes_a_calibration_that_knows_friction(runs, tmp_path):
    file = tmp_path / "healthy.json"
    result = invoke("calibrate", *runs, "--out", file, "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert facts["noise"] == pytest.approx(1e-4, rel=0.1)
    found = ftqp.Calibration.load(file)
    assert found.coulomb[1] == pytest.approx(FRICTION, abs=0.25)
    assert sum(0.15 < f < 0.5 for f in found.coulomb) >= 5
    assert invoke("calibrate", *runs, "--out", file).exit_code == 2
