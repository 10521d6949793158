"""The results file of a study: rows by item, one writer, and trouble said in a sentence."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ftqp.app.study.results_file import FILE_NAME, ResultsFile
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


REFUSALS: dict[str, tuple[Callable[[Path], object], dict[str, Any], str]] = {
    "another study": (
        made,
        {"key": "k2", "about": {"study": "a = 2", "ftqp": "1"}},
        r"another study \('a = 1' there, 'a = 2' here\); name another folder",
    ),
    "another kind": (made, {"kind": "campaign"}, "of kind 'map', this one is of kind 'campaign'"),
    "another version": (made, {"about": {"study": "a = 1", "ftqp": "2"}}, "made by ftqp 1, this is 2"),
    "other columns": (made, {"columns": {"error": "REAL"}}, "another study"),
    "no database": (
        lambda folder: (folder / FILE_NAME).write_text("not a database" * 99),
        {},
        "cannot be used as a",
    ),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_what_is_not_of_this_study_is_refused_and_left_as_it_is(tmp_path: Path, name: str) -> None:
    make, changes, sentence = REFUSALS[name]
    make(tmp_path)
    file = tmp_path / FILE_NAME
    before = file.read_bytes() if file.exists() else None
    with pytest.raises(InputError, match=sentence):
        opened(tmp_path, **changes)
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
    assert "cannot be" in str(said.value) and "another process" not in str(said.value)
    with opened(tmp_path) as results:  # there is room again
        kept = results.count()
        assert kept % 10 == 0 and kept < 1000
        results.write(range(1000), rows * 100, 1.0, "a")
        assert results.count() == 1000
