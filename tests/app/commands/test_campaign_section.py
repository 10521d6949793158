"""The section of a report on a campaign: what is in its folder is on the page; a broken folder is refused."""

import json

import pytest
from tests.app.conftest import invoke

from ftqp.app.campaign.campaign_summary import summary
from ftqp.app.campaign.episode_study import COLUMNS
from ftqp.app.study.results_file import ResultsFile

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
    rows = [episode(number) for number in range(60)]
    made = tmp_path / "c"
    about = {"name": "mine", "command": "ftqp campaign mine.toml --set campaign.seed=2"}
    with ResultsFile(made, kind="campaign", key="x", columns=COLUMNS, about=about) as results:
        values = [tuple(row[name] for name in COLUMNS) for row in rows]
        results.write([row["episode"] for row in rows], values, 1.0, "here")
    (made / "summary.json").write_text(json.dumps(summary("mine", rows)))
    (made / "campaign.toml").write_text("[campaign]\nepisodes = 60\n")
    return made


def report(*arguments):
    result = invoke("report", *arguments)
    return result.exit_code, result.stderr


def test_page_says_what_was_broken_where_and_by_which_command_it_runs_alone(folder, tmp_path):
    code, errors = report(folder, "-o", tmp_path / "page.html")
    assert code == 0, errors
    page = (tmp_path / "page.html").read_text()
    assert "Campaign c" in page and "60 random episodes, 6000 steps" in page
    assert "ftqp campaign mine.toml --set campaign.seed=2 --replay 57" in page
    assert "given up" not in page and "not finished" not in page
    assert "&lt;wrongly&gt;" in page and "<planar>" not in page.replace("&lt;planar&gt;", "")
    assert page.count("<figure>") == 2 and "http://" not in page and "https://" not in page
    assert "3.8 % to 21 %" in page  # 6 of 60, Clopper and Pearson
    assert "false alarms an hour" in page


def test_page_is_made_of_the_rows_and_says_what_is_missing_and_what_was_given_up(folder, tmp_path):
    with ResultsFile(folder, kind="campaign", key="x", columns=COLUMNS) as results:
        results.crash([63], "the worker died")
        results.write([60], [tuple(episode(60)[name] for name in COLUMNS)], 1.0, "here")
    (folder / "campaign.toml").write_text("[campaign]\nepisodes = 3000\n")
    assert report(folder, "-o", tmp_path / "page.html")[0] == 0
    page = (tmp_path / "page.html").read_text()
    assert "61 random episodes" in page and "60 random" not in page
    assert "2938 more episodes were asked for and have no result" in page
    assert "1 more were given up" in page and "--replay 63" in page
    (folder / "summary.json").unlink()
    assert report(folder, "-o", tmp_path / "again.html")[0] == 0
    assert (tmp_path / "again.html").read_text() == page
