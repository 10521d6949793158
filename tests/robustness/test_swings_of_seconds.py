"""Where nothing more can be gained, greatest manipulability kept an arm going to and fro for ever.

Found by ``ftqp campaign out-of-reach``, episode 3683 of seed 2026, made smaller.
"""

from ftqp.app.campaign.judged_scenario import broken_laws

SCENARIO = """
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


def test_an_arm_that_swings_slowly_comes_to_rest_too():
    assert "rest" not in broken_laws(SCENARIO, calm=5.0)
