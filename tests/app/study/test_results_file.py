"""The results file of a study: rows by item, one writer, and trouble said in a sentence."""

import os
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from ftqp.app.study.results_file import FILE_NAME, FORMAT, ResultsFile
from ftqp.core.errors import FtqpError, InputError

COLUMNS = {"error": "REAL", "ticks": "INTEGER", "kind": "TEXT"}


def opened(folder: Path, **changes: Any) -> ResultsFile:
    given: dict[str, Any] = {
        "kind": "map",
        "key": "k1",
        "columns": COLUMNS,
        "about": {"study": "a = 1", "ftqp": "1"},
    }
    return ResultsFile(folder, **(given | changes))


def made(folder: Path) -> None:
    """A file with one row."""
    with opened(folder) as results:
        results.write([0], [(0.5, 7, "x")], 1.0, "a")


def test_rows_come_back_by_item_with_their_types_and_an_item_keeps_its_first(tmp_path: Path) -> None:
    with opened(tmp_path) as results:
        results.write([3, 1], [(0.5, 7, "correct"), (1.5, 8, "none")], 2.0, "here:1")
        assert results.seconds() == 2.0
        results.write([1, 2], [(0.5, 7, "again"), (0.5, 7, "new")], 1.0, "b")
    with opened(tmp_path) as results:
        assert results.table() == [(1, 1.5, 8, "none"), (2, 0.5, 7, "new"), (3, 0.5, 7, "correct")]
        assert results.done() == {1, 2, 3}


def test_a_crashed_item_is_noted_until_it_has_a_row_or_is_cleared(tmp_path: Path) -> None:
    with opened(tmp_path) as results:
        results.crash([4, 5, 6], "the worker died")
        results.clear([5])
        results.write([4], [(0.5, 7, "x")], 1.0, "a")
        assert results.crashed() == {6: "the worker died"}


def edited(statement: str) -> Callable[[Path], None]:
    """A file that somebody has changed."""

    def edit(folder: Path) -> None:
        made(folder)
        with closing(sqlite3.connect(folder / FILE_NAME)) as connection, connection:
            connection.execute(statement)

    return edit


def written(name: str, text: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text(text, encoding="utf-8")


STRANGE = "not a database, but long enough to be looked at" * 30
NEWER = f"UPDATE about SET value = '{FORMAT + 1}' WHERE key = 'format'"
REFUSALS: dict[str, tuple[Callable[[Path], object], dict[str, Any], str]] = {
    "another study": (
        made,
        {"key": "k2", "about": {"study": "a = 2", "ftqp": "1"}},
        r"another study \('a = 1' there, 'a = 2' here\); name another folder",
    ),
    "another kind": (made, {"kind": "campaign"}, "of kind 'map', this one is of kind 'campaign'"),
    "another version": (made, {"about": {"study": "a = 1", "ftqp": "2"}}, "made by ftqp 1, this is 2"),
    "other columns": (made, {"columns": {"error": "REAL"}}, "another study"),
    "newer": (edited(NEWER), {}, f"has format {FORMAT + 1}, this ftqp reads up to {FORMAT}; a newer ftqp"),
    "no format": (edited("DELETE FROM about WHERE key = 'format'"), {}, "not a results file of ftqp"),
    "no table": (edited("DROP TABLE about"), {}, "not a results file of ftqp, or is damaged: no such table"),
    "no database": (written(FILE_NAME, STRANGE), {}, "cannot be used as a results file"),
    "a file above": (written("below", "x"), {}, "cannot be used as a results file"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_what_is_not_of_this_study_is_refused_and_left_as_it_is(tmp_path: Path, name: str) -> None:
    make, changes, sentence = REFUSALS[name]
    make(tmp_path)
    file = tmp_path / FILE_NAME
    before = file.read_bytes() if file.exists() else None
    with pytest.raises(InputError, match=sentence):
        opened(tmp_path / "below" if name == "a file above" else tmp_path, **changes)
    if before is not None:
        assert file.read_bytes() == before


def test_two_writers_do_not_meet(tmp_path: Path) -> None:
    held = r"another process writes to .*; wait until it has ended, or name another folder"
    with opened(tmp_path), pytest.raises(InputError, match=held):
        opened(tmp_path)
    opened(tmp_path).close()


@pytest.mark.parametrize("room", [0, 24 * 1024])
def test_a_disk_that_is_nearly_full_is_said_in_a_sentence_whatever_fails_first(
    tmp_path: Path, room: int
) -> None:
    resource = pytest.importorskip("resource", reason="needs a system that limits the size of files")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    rows = [(0.5, 7, "y" * 400)] * 10
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
        with pytest.raises(FtqpError) as said, opened(tmp_path) as results:
            for k in range(100):
                results.write(range(10 * k, 10 * k + 10), rows, 1.0, "a")
                results.done(), results.count(), results.crashed(), results.seconds(), results.table()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert "full" in str(said.value) and "another process" not in str(said.value)
    with opened(tmp_path) as results:  # there is room again
        kept = results.count()
        assert kept % 10 == 0 and kept < 1000
        results.write(range(1000), rows * 100, 1.0, "a")
        assert results.count() == 1000


def test_a_damaged_page_is_said_in_a_sentence(tmp_path: Path) -> None:
    with opened(tmp_path) as results:
        results.write(range(300), [(0.5, 7, "y" * 100)] * 300, 1.0, "a")
    whole = bytearray((tmp_path / FILE_NAME).read_bytes())
    assert len(whole) > 4096 * 12
    whole[4096 : 2 * 4096] = os.urandom(4096)
    (tmp_path / FILE_NAME).write_bytes(whole)
    with (
        pytest.raises(FtqpError, match=rf"{FILE_NAME} (cannot be|is not a|holds)"),
        opened(tmp_path) as results,
    ):
        results.crash([1], "x")
        results.done(), results.count(), results.crashed(), results.seconds(), results.table()
