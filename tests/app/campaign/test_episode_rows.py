"""Rows of a campaign as they are read: what a campaign writes is taken, anything else is named, refused."""

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from ftqp.app.campaign.campaign_summary import summary
from ftqp.app.campaign.episode_rows import episode_rows
from ftqp.app.campaign.episode_study import COLUMNS
from ftqp.app.study.results_file import FILE_NAME, ResultsFile
from ftqp.core.errors import InputError

ROW = dict.fromkeys(COLUMNS) | {
    "drawn": json.dumps({"planner.dt": 0.01, "robot.name": "panda", "faults": [{"at": 1e400}]}),
    "outcome": "sound",
    "said": '{"OK": 10}',
    "ticks": 10,
    "largest_error": float("inf"),
    "law_speed": 0.0,
    "sentences": "",
    "healthy_time": 1.0,
    "false_alarms": 0,
    "unannounced": 2,
    "showed": 1,
    "found": 1,
    "right_kind": 1,
    "wrong_joint": 0,
    "delay": 0.1,
    "found_as": "locked",
}
REFUSED = dict.fromkeys(COLUMNS) | {"drawn": "{}", "outcome": "refused", "ticks": 0}


def opened(folder: Path) -> ResultsFile:
    return ResultsFile(folder, kind="campaign", key="k", columns=COLUMNS)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    with opened(tmp_path) as results:
        rows = [tuple(row[name] for name in COLUMNS) for row in (*[ROW] * 9, REFUSED)]
        results.write(range(10), rows, 1.0, "here")
    return tmp_path


def test_rows_of_a_campaign_are_taken_as_far_as_it_goes(folder: Path) -> None:
    with opened(folder) as results:
        assert summary("x", episode_rows(results, 10))["episodes"] == 10
        assert [row["episode"] for row in episode_rows(results, 4)] == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("change", "column"),
    [
        ("drawn = 'xx'", "drawn"),
        ("drawn = NULL", "drawn"),
        ("drawn = '[1]'", "drawn"),
        ('drawn = \'{"a": 1' + 400 * "0" + "}'", "drawn"),
        ("drawn = '" + 100_000 * "[" + "'", "drawn"),
        ("drawn = CAST(x'ff' AS TEXT)", "damaged"),
        ("said = '{'", "said"),
        ('said = \'{"OK": "x"}\'', "said"),
        ("said = '{\"OK\": -1}'", "said"),
        ("law_speed = 'abc'", "law_speed"),
        ("law_speed = -1.0", "law_speed"),
        ("ticks = 'abc'", "ticks"),
        ("ticks = x'00ff'", "ticks"),
        ("ticks = -1", "ticks"),
        ("outcome = 'broken'", "sentences"),
        ("outcome = 'raised', sentences = NULL", "sentences"),
        ("outcome = 'zzz'", "outcome"),
        ("outcome = NULL", "outcome"),
        ("followable = 'abc'", "followable"),
        ("found = NULL", "found"),
        ("found = 3", "found"),
        ("showed = 3", "showed"),
        ("right_kind = 2", "right_kind"),
        ("false_alarms = 'x'", "false_alarms"),
        ("item = -5", "item"),
    ],
)
def test_value_that_no_campaign_writes_is_refused_by_row_and_column(
    folder: Path, change: str, column: str
) -> None:
    with closing(sqlite3.connect(folder / FILE_NAME)) as connection, connection:
        connection.execute(f"UPDATE results SET {change} WHERE item = 3")
    number = -5 if column == "item" else 3
    with opened(folder) as results, pytest.raises(InputError) as refusal:
        episode_rows(results, 10)
    sentence = str(refusal.value)
    assert str(folder / FILE_NAME) in sentence and "\n" not in sentence and len(sentence) < 500
    if column == "damaged":
        assert "cannot be used as a results file: a row of it is damaged" in sentence
        return
    assert f"row {number} of" in sentence and f" as {column}, expected " in sentence
    assert f"DELETE FROM results WHERE item = {number}" in sentence
    with closing(sqlite3.connect(folder / FILE_NAME)) as connection, connection:
        connection.execute(f"DELETE FROM results WHERE item = {number}")
    with opened(folder) as results:
        assert len(episode_rows(results, 10)) == 9
