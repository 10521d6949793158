"""Runs of ticks in compiled code moved a locked joint whose lock was told late, by 3e-9 rad a tick.

Found by ``ftqp campaign wide``, episode 722 of seed 2028, made smaller.
"""

from ftqp.app.campaign.judged_scenario import broken_laws

SCENARIO = """
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


def test_a_joint_that_its_brake_holds_does_not_move_when_the_planner_hears_of_it():
    assert "failed" not in broken_laws(SCENARIO, calm=5.0)
