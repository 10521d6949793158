"""The table of campaigns counts what summaries say, and refuses what is none."""

import json
from functools import partial

import pytest
from tests.scripts import ran

told = partial(ran, "studies/campaigns_table.py")
LAWS = (
    "finite", "speed", "acceleration", "position", "braking", "torque",
    "failed", "honesty", "tracking", "inside", "obedience", "chatter", "rest",
)  # fmt: skip


@pytest.fixture
def campaign(tmp_path):
    facts = {
        "campaign": "mine", "episodes": 103, "sound": 97, "broken": 2, "raised": 1, "refused": 3,
        "steps": 5000,
        "laws": dict.fromkeys(LAWS, 0) | {"braking": 1, "honesty": 2, "rest": 1, "chatter": 2}, "crashed": {},
        "said": {"OK": 4000, "STOPPED": 1000},
        "by_key": {
            "planner.backend": {
                "daqp": {"episodes": 50, "ticks": 2000, "fallbacks": 5},
                "osqp": {"episodes": 53, "ticks": 3000, "fallbacks": 0},
            }
        },
        "examples": [{"episode": 7, "outcome": "broken", "sentences": "braking from tick 3 on\nand more"}],
    }  # fmt: skip
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "summary.json").write_text(json.dumps(facts))
    (folder / "campaign.toml").write_text("[campaign]\nseed = 12\n")
    return folder


def test_counts_bound_and_command_of_a_campaign_are_told(campaign, tmp_path):
    done = told(campaign, "--commit", "1a2b3c4", "--json", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    (row,) = json.loads(done.stdout)["rows"]
    counted = [
        row[key]
        for key in ("episodes", "steps", "limits", "claims", "rest", "chatter", "tracking", "exceptions")
    ]
    assert counted == [100, 5000, 1, 2, 1, 2, 0, 1]
    assert row["at_most"] == pytest.approx(0.0852, abs=1e-4)  # tables of Clopper and Pearson: 3 of 100
    report = (tmp_path / "out" / "campaigns_table.md").read_text()
    assert "`ftqp campaign mine --episodes 103` at 1a2b3c4, seed 12" in report
    assert "OK 80.00 %" in report and "episode 7: braking from tick 3 on\n" in report
    assert "| `daqp` | 50 | 2,000 | 0.25 % |\n| `osqp` | 53 | 3,000 | 0.00 % |" in report
