"""Beside a controller that is wired well: a lock that nobody reports."""

import json
from pathlib import Path

import pytest
from tests import scripts

from ftqp.app.scenario.setup import load
from ftqp.sim.rival import strayed


def test_the_others_take_over_before_a_joint_that_does_not_follow_is_named(tmp_path: Path) -> None:
    given = ("--quick", "--json", "--out", str(tmp_path))
    rows = json.loads(scripts.told("studies/well_wired.py", *given))["rows"]
    own, reported, rival, _ = rows
    assert [row["controller"] for row in (own, rival)] == ["ftqp, not reported", "rates, not reported"]
    assert "found after" in own["said"] and own["speed"] < 1.0
    assert reported["after"] < own["after"] < 0.3 * rival["after"]


@pytest.mark.parametrize("joint", ["panda_joint4", "panda_joint6"])
def test_nobody_waits_for_the_name_of_a_joint_that_does_not_follow(joint: str) -> None:
    """Six joints cannot keep this task for a while; that the lock is not reported costs a little more."""
    most = {}
    for announced in ("", "never"):
        setup = load("panda-unannounced", [f"faults.0.joint={joint}", f"faults.0.announced={announced}"])
        result = setup.simulation(log="memory").run()
        assert result.final_status.name != "STOPPED" and joint in setup.planner.faults
        most[announced] = strayed(result.log).max()
    assert most["never"] < 1.15 * most[""]
