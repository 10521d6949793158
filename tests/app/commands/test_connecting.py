"""``ftqp connect`` lets a simulated arm make its first motion, says what it showed, and writes it down."""

import json
from functools import partial

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
def scenario(tmp_path):
    """An arm behind servos with a lag of 40 ms."""
    file = tmp_path / "servo.toml"
    file.write_text(SERVO, encoding="utf-8")
    return file


def test_an_arm_without_a_scenario_is_connected_and_its_file_is_a_planner_s_prior(tmp_path):
    file = tmp_path / "arm.json"
    result = asked("planar6", "-o", file, "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
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


ARM = """<mujoco><worldbody><body>
<joint name="a" axis="0 0 1" limited="true" range="-2 2"/><geom size="0.1" mass="1"/>
<body name="hand" pos="0.4 0 0">
<joint name="b" axis="0 1 0" limited="true" range="-2 2"/><geom size="0.1"/></body>
</body></worldbody></mujoco>"""


def test_an_mjcf_with_set_and_a_scenario_without_a_path_are_connected(tmp_path):
    model, toml = tmp_path / "arm.xml", tmp_path / "arm.toml"
    model.write_text(ARM, encoding="utf-8")
    result = asked(model, "--tip", "hand")
    assert result.exit_code == 2
    assert "braking needs one: --set robot.limits.v_max=..., or limits =" in " ".join(result.output.split())
    given = ("--tip", "hand", "--set", "robot.limits.v_max=2.0", "--set", "planner.dt=0.004", "--json")
    toml.write_text('[robot]\nmjcf = "arm.xml"\ntip = "hand"\nlimits = { v_max = 2.0 }\n', encoding="utf-8")
    for result in (asked(model, *given), asked(toml, "--json")):
        assert result.exit_code == 0, result.output
        lags = [joint["lag"] for joint in json.loads(result.stdout)["joints"].values()]
        assert len(lags) == 2 and all(abs(lag - 2.0 / BANDWIDTH) < 3.0 * error < 0.1 for lag, error in lags)


@pytest.mark.long
def test_two_arms_on_one_base_are_connected_and_take_the_time_that_their_joints_need():
    result = asked("dual_panda", "--json")
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert len(facts["joints"]) == 14 and facts["fault"] is None
    for joint in facts["joints"].values():
        assert abs(joint["lag"][0] - 2.0 / BANDWIDTH) < 3.0 * joint["lag"][1] < 0.05
        assert joint["droop"][1] < 1e-3  # an arm carries its own masses, and not the other's


def test_a_person_reads_a_table_what_it_means_and_what_is_missing(scenario):
    result = asked(scenario)
    assert result.exit_code == 0, result.output
    words = " ".join(result.output.split())
    assert "estimates of its servos" in words and "lock after [ms]" in words and "sag [mrad]" in words
    assert "Nothing shows of one that rests." in words
    assert "The noise of positions was not stated: ftqp.Noise(q=" in words
    assert "The lag of" not in words  # the drive is said to take no velocities


def test_a_drive_that_is_stated_wrongly_is_said(scenario):
    result = asked(scenario, "--set", "planner.drive.bandwidth=500")
    assert "a bandwidth of 500 rad/s" in " ".join(result.output.split())
    result = asked(scenario, "--set", "planner.drive.takes_velocity=true")
    assert "send step.v, too, or say ftqp.Drive(takes_velocity=False)" in " ".join(result.output.split())


def test_a_plant_whose_servos_take_other_than_the_drive_says_is_noted(scenario):
    assert "not that of the plant" not in invoke("check", scenario).output
    for command in ("check", "connect"):
        result = invoke(command, scenario, "--set", "simulation.servo.takes_velocity=true")
        words = " ".join(result.output.split())
        assert result.exit_code == 0 and "takes_velocity is False, and that of simulation.servo True" in words


def test_a_failure_at_the_first_ends_it_and_nothing_is_written(scenario, tmp_path):
    scenario.write_text(SERVO + BRAKE, encoding="utf-8")
    file = tmp_path / "arm.json"
    result = asked(scenario, "-o", file)
    assert result.exit_code == 1, result.output
    assert "--set faults=[] leaves that out" in result.output
    assert "ended early: j2" in result.output and f"{file} is not written" in " ".join(result.output.split())
    assert not file.exists()


def test_an_arm_that_follows_to_the_last_bit_teaches_nothing(tmp_path):
    file = tmp_path / "arm.json"
    result = asked("planar3-line", "-o", file)
    assert result.exit_code == 2 and not file.exists()
    assert "The samples were the commands to the last bit" in " ".join(result.output.split())
    result = asked("planar3-line")
    assert result.exit_code == 0 and "simulation.plant=servo" in " ".join(result.output.split())


def test_joints_that_hardly_moved_or_moved_too_slowly_are_said_together(tmp_path):
    file = tmp_path / "arm.json"
    result = asked("canadarm2", "-o", file)
    words = " ".join(result.output.split())
    assert result.exit_code == 2 and not file.exists()
    assert "is not written, because no joint moved enough" in words
    assert "wrist_yaw, wrist_roll, which hardly moved" in " ".join(asked("canadarm2").output.split())
    result = asked("canadarm2", "--seconds", "30")
    assert "wrist_roll, which moved too slowly to tell lag from friction" in " ".join(result.output.split())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("pandas",), "'pandas'"),
        (("planar6", "-o", "none/arm.json"), "is no folder; make it first"),
        (("planar6", "--seconds", "1"), "seconds is 1, expected at least"),
        (("planar6", "--set", "a=1"), "a is not a key of a scenario"),
        (("panda-circle", "--set", "planner.drive=velocity"), "drive is 'velocity', expected 'position'"),
    ],
)
def test_what_does_not_go_together_is_refused(arguments, message):
    result = asked(*arguments)
    assert result.exit_code == 2
    assert message in " ".join(result.output.split())
