"""Beside a controller that is wired well: a lock that nobody reports."""

import json
from pathlib import Path

from tests import scripts


def test_the_others_take_over_before_a_joint_that_does_not_follow_is_named(tmp_path: Path) -> None:
    given = ("--quick", "--json", "--out", str(tmp_path))
    rows = json.loads(scripts.told("studies/well_wired.py", *given))["rows"]
    own, reported, rival, _ = rows
    assert [row["controller"] for row in (own, rival)] == ["ftqp, not reported", "rates, not reported"]
    assert "found after" in own["said"] and own["speed"] < 1.0
    assert reported["after"] < own["after"] < 0.3 * rival["after"]
