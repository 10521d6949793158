"""Paths that waited in mode ``scaled`` went to and fro, and the joints jolted with them at full acceleration.

Found by ``ftqp campaign safety``, whose other episodes of the kind are drawn with `--set
'vary."planner.task.mode"=["scaled"]'`, and by ``ftqp campaign out-of-reach``.
"""

import pytest

from ftqp.app.campaign.judged_scenario import broken_laws

CIRCLE = """
path = {{ kind = "circle", duration = {0}, radius = {1} }}
faults = [{{ kind = "locked", joint = {2}, at = {3} }}]
simulation = {{ duration = 2.4 }}
robot = {{ name = "{4}" }}
planner = {{ level = "{5}", dt = {6}, scheme = "{7}", task = {{ mode = "scaled" }} }}
start = {{ q = {8} }}
"""
AT_THE_EDGE_OF_CALM = CIRCLE.format(
    0.8699736066319688,
    0.02961755146142744,
    3,
    0.1266030602370072,
    "panda",
    "velocity",
    0.01,
    "mvn",
    [-0.476501775, -0.315315497, 0.437455395, -2.12082182, 0.787851459, 1.438808852, 0.166627499],
)
IN_CALM = CIRCLE.format(
    1.1503443730551477,
    0.011216971255442616,
    3,
    0.3659886619587085,
    "panda",
    "velocity",
    0.01,
    "rmp",
    [-0.849837062, -0.392857725, 0.689004182, -2.189137305, 0.502208121, 1.635162226, 0.568881059],
)
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
    0.944233831656498,
    0.0494765860748823,
    3,
    0.09724961846177366,
    "xarm7",
    "acceleration",
    0.002,
    "mvn",
    [-0.755115482, -0.903076749, -0.532634302, 1.239361894, -1.529564463, 1.201431170, 0.169020580],
)
TWO_JOINTS_AT_THEIR_SPEED_LIMITS = CIRCLE.format(
    0.6718842453795916,
    0.12083404828954711,
    5,
    0.5174523765948834,
    "iiwa14",
    "acceleration",
    0.005,
    "mvn",
    [-0.758870735, -0.028867107, -0.225991178, -1.024920154, 0.623851245, 1.166787750, -0.511520222],
)


@pytest.mark.parametrize("scenario", [AT_THE_EDGE_OF_CALM, IN_CALM, OUT_OF_REACH])
def test_no_joint_jolts_where_a_path_waits_near_a_singularity(scenario: str) -> None:
    assert not broken_laws(scenario), "before, 4, 15 and 5 jolts at full acceleration in a row too many"


@pytest.mark.parametrize("scenario", [A_JOINT_AT_ITS_SPEED_LIMIT, TWO_JOINTS_AT_THEIR_SPEED_LIMITS])
def test_no_joint_jolts_where_others_run_at_their_speed_limits(scenario: str) -> None:
    assert not broken_laws(scenario), "before, 2 jolts each at full acceleration in a row too many"
