"""The report of backends under fire says what was counted, and who was left out why."""

import json
from typing import Any

import backends_under_fire as fire
import pytest

from ftqp.app.campaign.episode_study import load_campaign

ROW = {
    "said": {"OK": 900, "FALLBACK": 30, "STOPPED": 70},
    "broken": [[3, "joint1: speed beyond its limit"]],
    "raised": [],
    "refused": 1,
    "fallbacks": [[7, 20], [3, 10]],
    "p50": 12.0,
    "p99": 80.0,
    "worst": 950.4,
}


def test_the_table_says_shares_of_all_ticks_and_of_those_in_motion() -> None:
    made = fire.table({"osqp": ROW}, {"nosuch": "is not installed"}, 5)
    assert made.rows[0][:7] == ["osqp", "4", "1000", "3.000", "3.226", "1", "0"]
    assert made.rows[1][0] == "nosuch" and made.rows[1][-1] == "is not installed"
    assert len(made.headings) == len(made.rows[0]) == len(made.rows[1])


def test_the_campaign_draws_every_backend_and_otherwise_the_same_episodes() -> None:
    campaign = load_campaign("backends")
    names = {campaign.drawn(k)[1]["planner.backend"] for k in range(60)}
    assert names == set(campaign.tables.vary["planner.backend"])


@pytest.mark.slow
def test_the_script_writes_a_report_and_leaves_out_who_is_not_there(tmp_path: Any, capsys: Any) -> None:
    arguments = ["--episodes", "2", "--backends", "active_set,nosuch", "--out", str(tmp_path), "--json"]
    assert fire.main(arguments) == 1
    result = json.loads(capsys.readouterr().out)
    assert result["rows"]["active_set"]["said"] and "installed" in result["left_out"]["nosuch"]
    assert "Backends under fire" in (tmp_path / "backends_under_fire-quick.md").read_text()
