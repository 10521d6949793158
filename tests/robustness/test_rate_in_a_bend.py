"""A rate that was set to the limit of the rate before went to and fro, and the joints jolted with it.

Found by ``ftqp campaign safety``, episode 800.
"""

import pytest

from ftqp.app.campaign.judged_scenario import broken_laws

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


@pytest.mark.parametrize("scenario", [HEALTHY, BESIDE_A_JOINT_THAT_LOCKS])
def test_no_joint_jolts_where_a_bend_limits_the_rate(scenario: str) -> None:
    assert not broken_laws(scenario), "before, 46 and 37 jolts at full acceleration in a row too many"
