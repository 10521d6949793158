"""The section of a report on a campaign: what is in its folder is on the page; a broken folder is refused."""

import json

import pytest
from tests.app.conftest import invoke

from ftqp.app.campaign.campaign_summary import summary
from ftqp.app.campaign.episode_study import COLUMNS

COUNTS = ("false_alarms", "unannounced", "showed", "found", "right_kind", "wrong_joint")
NONE = dict.fromkeys(("episode", *COLUMNS))


def episode(number):
    bad = number % 10 == 7
    return NONE | {
        "episode": number,
        "drawn": json.dumps({"robot.name": ["panda", "<planar>"][number % 2], "faults.0.at": 0.01 * number}),
        "outcome": "broken" if bad else "sound",
        "ticks": 100,
        "largest_ok_error": 1e-6 * (number + 1),
        "law_honesty": 0.5 if bad else 0.0,
        "sentences": "honesty from tick 3 on, 1 ticks: OK was claimed <wrongly>: 0.5" if bad else "",
        "healthy_time": 360.0,
        **dict.fromkeys(COUNTS, 1),
        "delay": 0.1,
        "found_as": "locked",
    }


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "c"
    made.mkdir()
    facts = summary("mine", [episode(number) for number in range(60)])
    facts |= {"crashed": {"63": "the worker died"}, "seconds": 12.0, "folder": str(made)}
    (made / "summary.json").write_text(json.dumps(facts))
    return made


def report(*arguments):
    result = invoke("report", *arguments)
    return result.exit_code, result.stderr


def test_page_says_what_was_broken_where_and_how_it_runs_alone(folder, tmp_path):
    code, errors = report(folder, "-o", tmp_path / "page.html")
    assert code == 0, errors
    page = (tmp_path / "page.html").read_text()
    assert "Campaign c" in page and "60 random episodes, 6000 steps" in page
    assert "episode 57: honesty" in page and "--replay N" in page
    assert "episode 63 was given up: the worker died each time" in page
    assert "&lt;wrongly&gt;" in page and "<planar>" not in page.replace("&lt;planar&gt;", "")
    assert "http://" not in page and "https://" not in page
    assert "3.8 % to 21 %" in page  # 6 of 60, Clopper and Pearson
    assert "false alarms an hour" in page
