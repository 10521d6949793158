"""``ftqp connect`` lets a simulated arm make its first motion, says what it showed, and writes it down."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from tests.app.conftest import invoke, setup_of

import ftqp
from ftqp.sim.plants.joint_servo import BANDWIDTH

asked = partial(invoke, "connect")
SERVO = """
[robot]
name = "planar6"

[planner]
dt = 0.005
drive = { kind = "position", takes_velocity = false }

[path]
kind = "line"
displacement = [0.01, 0.0, 0.0]
duration = 0.5

[simulation]
plant = "servo"

[simulation.servo]
time_constant = 0.04
takes_velocity = false

[sensors]
position_noise = 5e-5
"""
BRAKE = """
[[faults]]
kind = "locked"
joint = "j2"
at = 0.0
announced = "never"
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """An arm behind servos with a lag of 40 ms."""
    file = tmp_path / "servo.toml"
    file.write_text(SERVO, encoding="utf-8")
    return file


def test_an_arm_without_a_scenario_is_connected_and_its_file_is_a_planner_s_prior(tmp_path: Path) -> None:
    file = tmp_path / "arm.json"
    result = asked("planar6", "-o", file, "--json")
    assert result.exit_code == 0, result.output
    facts: Any = json.loads(result.stdout)
    assert facts["fault"] is None and facts["file"] == str(file)
    for joint in facts["joints"].values():
        lag, error = joint["lag"]
        assert abs(lag - 2.0 / BANDWIDTH) < 3.0 * error < 0.1
    robot = ftqp.robots.load("planar6")
    known = ftqp.Planner(robot, drive=ftqp.Drive(known=file, takes_velocity=False)).drive.known
    assert isinstance(known, ftqp.LearnedServos) and known.joints == robot.joints
    planner = setup_of(
        tmp_path, robot={"name": "planar6"}, planner={"drive": {"kind": "position", "known": "arm.json"}},
        path={"kind": "line", "displacement": [0.01, 0.0, 0.0], "duration": 0.5},
    ).planner  # fmt: skip
    assert isinstance(planner.drive.known, ftqp.LearnedServos)


def test_a_person_reads_a_table_what_it_means_and_what_is_missing(scenario: Path) -> None:
    result = asked(scenario)
    assert result.exit_code == 0, result.output
    words = " ".join(result.output.split())
    assert "what was learned of its servos" in words and "lock at 0.1 rad/s [ms]" in words
    assert "Nothing shows of a joint that rests." in words
    assert "The noise of positions was not stated: ftqp.Noise(q=" in words
    assert "lag by" not in words  # the drive is said to take no velocities


def test_a_drive_that_is_stated_wrongly_is_said(scenario: Path) -> None:
    result = asked(scenario, "--set", "planner.drive.bandwidth=500")
    assert "a bandwidth of 500 rad/s" in " ".join(result.output.split())
    result = asked(scenario, "--set", "planner.drive.takes_velocity=true")
    assert "send step.v, too, or say ftqp.Drive(takes_velocity=False)" in " ".join(result.output.split())


def test_a_failure_at_the_first_ends_it_and_nothing_is_written(scenario: Path, tmp_path: Path) -> None:
    scenario.write_text(SERVO + BRAKE, encoding="utf-8")
    file = tmp_path / "arm.json"
    result = asked(scenario, "-o", file)
    assert result.exit_code == 1, result.output
    assert "ended early: j2" in result.output and f"{file} is not written" in " ".join(result.output.split())
    assert not file.exists()


def test_an_arm_that_follows_to_the_last_bit_teaches_nothing(tmp_path: Path) -> None:
    file = tmp_path / "arm.json"
    result = asked("planar3-line", "-o", file)
    assert result.exit_code == 2 and not file.exists()
    assert "The samples were the commands to the last bit" in " ".join(result.output.split())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("pandas",), "'pandas'"),
        (("planar6", "-o", "none/arm.json"), "is no folder; make it first"),
        (("planar6", "--seconds", "1"), "seconds is 1, expected at least"),
        (("planar6", "--set", "a=1"), "is a robot, no scenario"),
        (("panda-circle", "--set", "planner.drive=velocity"), "drive is 'velocity', expected 'position'"),
    ],
)
def test_what_does_not_go_together_is_refused(arguments: tuple[str, ...], message: str) -> None:
    result = asked(*arguments)
    assert result.exit_code == 2
    assert message in " ".join(result.output.split())
