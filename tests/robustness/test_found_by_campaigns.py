"""Scenarios in which a campaign once found a broken law, made smaller; each keeps its laws now."""

import pytest

from ftqp.app.campaign.judged_scenario import broken_laws
from ftqp.app.campaign.shown_trace import model_file, trace
from ftqp.app.scenario.setup import load
from ftqp.checker.checked_run import verdict

CIRCLE = """
path = {{ kind = "circle", duration = {0}, radius = {1} }}
faults = [{{ kind = "locked", joint = {2}, at = {3} }}]
simulation = {{ duration = 2.4 }}
robot = {{ name = "{4}" }}
planner = {{ level = "{5}", dt = {6}, scheme = "{7}", task = {{ mode = "scaled" }} }}
start = {{ q = {8} }}
"""
AT_THE_EDGE_OF_CALM = CIRCLE.format(
    0.8699736066319688, 0.02961755146142744, 3, 0.1266030602370072, "panda", "velocity", 0.01, "mvn",
    [-0.476501775, -0.315315497, 0.437455395, -2.12082182, 0.787851459, 1.438808852, 0.166627499],
)  # fmt: skip
IN_CALM = CIRCLE.format(
    1.1503443730551477, 0.011216971255442616, 3, 0.3659886619587085, "panda", "velocity", 0.01, "rmp",
    [-0.849837062, -0.392857725, 0.689004182, -2.189137305, 0.502208121, 1.635162226, 0.568881059],
)  # fmt: skip
OUT_OF_REACH = """
simulation = { duration = 4.0 }
robot = { name = "xarm7" }
[path]
kind = "line"
duration = 1.4105012491594688
beyond_reach = true
displacement = [0.2964713469, -0.2701926855, 0.9069192340]
[planner]
level = "velocity"
dt = 0.005
scheme = "rmp"
task = { mode = "scaled", rows = "position" }
emergency = "off"
[start]
q = [-0.124706856, -1.506625699, 2.194384978, 0.296464551, -1.347008483, 1.013296813, 2.145904066]
"""
A_JOINT_AT_ITS_SPEED_LIMIT = CIRCLE.format(
    0.944233831656498, 0.0494765860748823, 3, 0.09724961846177366, "xarm7", "acceleration", 0.002, "mvn",
    [-0.755115482, -0.903076749, -0.532634302, 1.239361894, -1.529564463, 1.201431170, 0.169020580],
)  # fmt: skip
TWO_JOINTS_AT_THEIR_SPEED_LIMITS = CIRCLE.format(
    0.6718842453795916, 0.12083404828954711, 5, 0.5174523765948834, "iiwa14", "acceleration", 0.005, "mvn",
    [-0.758870735, -0.028867107, -0.225991178, -1.024920154, 0.623851245, 1.166787750, -0.511520222],
)  # fmt: skip
HEALTHY = """
[path]
kind = "circle"
duration = 1.0
radius = 0.1
[simulation]
duration = 1.1
[robot]
name = "panda"
[planner]
scheme = "rmp"
task = { mode = "scaled" }
[start]
q = [-0.1, 0.5, 1.0, -1.0, -1.0, 2.0, 0.4]
"""
BESIDE_A_JOINT_THAT_LOCKS = """
[path]
kind = "circle"
duration = 1.02
radius = 0.106
[[faults]]
kind = "locked"
joint = 4
at = 0.9318
[simulation]
duration = 2.4
[robot]
name = "srs7"
[planner]
dt = 0.002
level = "velocity"
scheme = "rmp"
task = { mode = "scaled" }
[start]
q = [-0.1031, 0.4635, 1.0909, -1.3436, -1.3714, 1.5567, 0.411]
"""
SWINGS_FOR_SECONDS = """
[robot]
name = "xarm7"
[planner]
level = "acceleration"
scheme = "man"
dt = 0.002
emergency = "off"
task = { rows = "position", mode = "lexicographic" }
[start]
q = [1.334569, -1.49624, 0.630867, 1.198465, -0.940826, 2.766946, 0.358018]
[path]
kind = "line"
displacement = [0.143718, -0.447515, -0.007804]
duration = 0.966348
beyond_reach = true
[simulation]
duration = 20.0
"""
TOLD_LATE = """
[planner]
level = "velocity"
[path]
kind = "circle"
duration = 1.0
radius = 0.05
[[faults]]
kind = "locked"
joint = 3
at = 0.6
announced = 0.7
[simulation]
duration = 1.0
[robot]
name = "iiwa14"
"""
TORQUE_ARM_WITH_A_LOAD = """
path = { kind = "circle", duration = 5.998724053573279, radius = 0.040650697213422196 }
robot = { name = "panda" }
start = { q = [0.3989887, -0.7138474, -0.1177614, -2.1071613, -0.0878451, 1.6162512, 0.3595637] }
sensors = { position_noise = 0.0001, latency = 1 }
[planner]
dt = 0.001
noise = { q = 0.0001 }
task = { rows = "position" }
detector = {}
drive = "torque"
[simulation]
plant = "mujoco"
seed = 766988557
[simulation.mujoco]
payload = { mass = 2.29397898, com = [0.0, 0.0, 0.05] }
rotors = 0.13286447
mass_scale = 1.08485762
coulomb = 0.45317333
viscous = 0.55222259
jitter = 0.49164943
"""
STOPS_AT_A_LIMIT = {
    1019: """
[path]
kind = "circle"
duration = 0.714865489736179
radius = 0.06352150088745662
[[faults]]
kind = "degraded"
joint = 5
at = 0.5068336947085421
[simulation]
duration = 2.4
[robot]
name = "iiwa14"
[planner]
level = "velocity"
dt = 0.01
scheme = "rmp"
task = { mode = "slack" }
[start]
q = [
    -0.44346093663360225, 1.0377874827147409, 0.6209609934494691, -1.9167095880393619,
    -0.4573454061346773, 0.5162249690978317, -0.40176690731952236,
]
""",
    1535: """
[path]
kind = "circle"
duration = 0.6729647979898479
radius = 0.1891520377583736
[[faults]]
kind = "degraded"
joint = 3
at = 0.05296597296993658
[simulation]
duration = 2.4
[robot]
name = "iiwa14"
[planner]
level = "velocity"
dt = 0.002
scheme = "rmp"
task = { mode = "slack" }
[start]
q = [
    0.1558794565218774, 0.8010629182047861, -0.48351285508216096, -1.9527854214506735,
    -0.4308470609554757, 1.586660992466653, -0.5414798014544219,
]
""",
}


@pytest.mark.parametrize("scenario", [AT_THE_EDGE_OF_CALM, IN_CALM, OUT_OF_REACH])
def test_no_joint_jolts_where_a_path_waits_near_a_singularity(scenario: str) -> None:
    """Paths that waited in mode ``scaled`` went to and fro, and the joints with them at full acceleration."""
    assert not broken_laws(scenario), "before, 4, 15 and 5 jolts at full acceleration in a row too many"


@pytest.mark.parametrize("scenario", [A_JOINT_AT_ITS_SPEED_LIMIT, TWO_JOINTS_AT_THEIR_SPEED_LIMITS])
def test_no_joint_jolts_where_others_run_at_their_speed_limits(scenario: str) -> None:
    assert not broken_laws(scenario), "before, 2 jolts each at full acceleration in a row too many"


@pytest.mark.parametrize("scenario", [HEALTHY, BESIDE_A_JOINT_THAT_LOCKS])
def test_no_joint_jolts_where_a_bend_limits_the_rate(scenario: str) -> None:
    """A rate that was set to the limit of the rate before went to and fro: episode 800 of ``safety``."""
    assert not broken_laws(scenario), "before, 46 and 37 jolts at full acceleration in a row too many"


def test_an_arm_that_swings_slowly_comes_to_rest_too() -> None:
    """Greatest manipulability kept it going for ever: episode 3683 of ``out-of-reach``, seed 2026."""
    assert "rest" not in broken_laws(SWINGS_FOR_SECONDS, calm=5.0)


def test_a_joint_that_its_brake_holds_does_not_move_when_the_planner_hears_of_it() -> None:
    """Runs of ticks in compiled code moved it by 3e-9 rad a tick: episode 722 of ``wide``, seed 2028."""
    assert "failed" not in broken_laws(TOLD_LATE, calm=5.0)


def test_wrist_that_falls_under_a_load_and_comes_back_is_no_runaway_and_does_not_chatter() -> None:
    """Rotors and a load that nobody told of: it was shaken and called a runaway (``detection``)."""
    assert broken_laws(TORQUE_ARM_WITH_A_LOAD, judged="in physics") == {}


@pytest.mark.parametrize("number", STOPS_AT_A_LIMIT)
def test_stop_that_ends_at_a_limit_keeps_it(number, tmp_path) -> None:
    """Rounding put the joint 4e-16 rad outside, and its interval was opened: these episodes of ``safety``."""
    (tmp_path / "episode.toml").write_text(STOPS_AT_A_LIMIT[number])
    setup = load(tmp_path / "episode.toml")
    log = setup.simulation(log="memory").run().log
    seen = verdict(model_file(setup), trace(setup, log))
    assert "STOPPED" in trace(setup, log).status
    assert not seen.breaches, [str(breach) for breach in seen.breaches]
