"""A joint that a stop brings to rest exactly at the end of its range, but for rounding, stays inside it.

Found by ``ftqp campaign safety``, episodes 1019 and 1535: rounding put the joint 4e-16 rad outside, its
interval was opened as for a joint that is outside, and the stop, whose deceleration may not fall suddenly,
went on.
"""

import pytest

from ftqp.app.campaign.shown_trace import model_file, trace
from ftqp.app.scenario.setup import load
from ftqp.checker.checked_run import verdict

EPISODES = {
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
    -0.44346093663360225,
    1.0377874827147409,
    0.6209609934494691,
    -1.9167095880393619,
    -0.4573454061346773,
    0.5162249690978317,
    -0.40176690731952236,
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
    0.1558794565218774,
    0.8010629182047861,
    -0.48351285508216096,
    -1.9527854214506735,
    -0.4308470609554757,
    1.586660992466653,
    -0.5414798014544219,
]
""",
}


@pytest.mark.parametrize("number", EPISODES)
def test_stop_that_ends_at_a_limit_keeps_it(number, tmp_path):
    (tmp_path / "episode.toml").write_text(EPISODES[number])
    setup = load(tmp_path / "episode.toml")
    log = setup.simulation(log="memory").run().log
    seen = verdict(model_file(setup), trace(setup, log))
    assert "STOPPED" in trace(setup, log).status
    assert not seen.breaches, [str(breach) for breach in seen.breaches]
