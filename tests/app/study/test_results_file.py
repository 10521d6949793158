import json
import os
import sqlite3
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from ftqp.app.study.results_file import FILE_NAME, ResultsFile, read_only
from ftqp.app.study.results_layout import FORMAT
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


def test_rows_come_back_by_item_with_their_types(tmp_path: Path) -> None:
    with opened(tmp_path) as results:
        results.write([3, 1], [(0.5, 7, "correct"), (1.5, 8, "none")], 2.0, "here:1")
        assert results.table() == [(1, 1.5, 8, "none"), (3, 0.5, 7, "correct")]
        assert results.done() == {1, 3}
        assert results.seconds() == 2.0


def test_an_item_that_is_computed_twice_keeps_its_first_row(tmp_path: Path) -> None:
    with opened(tmp_path) as results:
        results.write([1], [(0.5, 7, "first")], 1.0, "a")
        results.write([1, 2], [(0.5, 7, "again"), (0.5, 7, "new")], 1.0, "b")
        assert [row[3] for row in results.table()] == ["first", "new"]


def test_a_study_goes_on_in_its_own_file(tmp_path: Path) -> None:
    with opened(tmp_path) as results:
        results.write([0], [(0.5, 7, "x")], 1.0, "a")
    with opened(tmp_path) as results:
        assert results.done() == {0}


def test_results_of_another_study_are_refused_and_left_as_they_are(tmp_path: Path) -> None:
    with opened(tmp_path) as results:
        results.write([0], [(0.5, 7, "x")], 1.0, "a")
    with pytest.raises(
        InputError, match=r"another study \('a = 1' there, 'a = 2' here\); name another folder"
    ):
        opened(tmp_path, key="k2", about={"study": "a = 2", "ftqp": "1"})
    with pytest.raises(InputError, match=r"of kind 'map', this one is of kind 'campaign'"):
        opened(tmp_path, kind="campaign")
    with pytest.raises(InputError, match=r"made by ftqp 1, this is 2"):
        opened(tmp_path, about={"study": "a = 1", "ftqp": "2"})
    with pytest.raises(InputError, match=r"another study"):
        opened(tmp_path, columns={"error": "REAL"})
    with opened(tmp_path) as results:
        assert results.done() == {0}


def test_a_file_of_a_newer_version_is_refused(tmp_path: Path) -> None:
    opened(tmp_path).close()
    with closing(sqlite3.connect(tmp_path / FILE_NAME)) as connection:
        connection.execute("UPDATE about SET value = ? WHERE key = 'format'", [json.dumps(FORMAT + 1)])
        connection.commit()
    with pytest.raises(
        InputError, match=f"has format {FORMAT + 1}, this ftqp reads up to {FORMAT}; a newer ftqp"
    ):
        opened(tmp_path)


def test_two_writers_do_not_meet(tmp_path: Path) -> None:
    with opened(tmp_path), pytest.raises(InputError, match="another process writes to"):
        opened(tmp_path)
    opened(tmp_path).close()


@pytest.mark.parametrize("content", [b"", b"not a database, but long enough to be looked at" * 30])
def test_what_is_no_results_file_is_refused_or_begun(tmp_path: Path, content: bytes) -> None:
    (tmp_path / FILE_NAME).write_bytes(content)
    if content:
        with pytest.raises(InputError, match="cannot be used as a results file"):
            opened(tmp_path)
        assert (tmp_path / FILE_NAME).read_bytes() == content
    else:
        opened(tmp_path).close()


def test_a_database_of_something_else_is_refused(tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / FILE_NAME)) as connection:
        connection.execute("CREATE VIEW about AS SELECT 1 AS key, 2 AS value")
        connection.commit()
    with pytest.raises(InputError, match="has no table about as such a file has it"):
        opened(tmp_path)


def test_a_folder_that_cannot_be_made_is_bad_input(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x", encoding="utf-8")
    with pytest.raises(InputError, match="cannot be used as a results file"):
        opened(tmp_path / "file" / "below")


def test_a_full_disk_is_said_and_rows_before_it_are_kept(tmp_path: Path) -> None:
    with opened(tmp_path) as results:
        results.write([0], [(0.5, 7, "x")], 1.0, "a")
        results._connection.execute("PRAGMA max_page_count = 1")
        with pytest.raises(
            FtqpError, match=f"written: database or disk is full; .* with --out {tmp_path} goes on from there"
        ):
            results.write(range(1, 5000), [(0.5, 7, "y" * 100)] * 4999, 1.0, "a")
        assert results.done() == {0}


@pytest.mark.parametrize("room", [1024 * k for k in (2, 6, 12, 20, 24, 28, 32, 36, 44)])
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


@pytest.mark.parametrize("page", [1, 3, 4, 5, 8, 11])
def test_a_damaged_page_is_said_in_a_sentence(tmp_path: Path, page: int) -> None:
    with opened(tmp_path) as results:
        results.write(range(300), [(0.5, 7, "y" * 100)] * 300, 1.0, "a")
    whole = bytearray((tmp_path / FILE_NAME).read_bytes())
    assert len(whole) > 4096 * 12
    whole[4096 * page : 4096 * (page + 1)] = os.urandom(4096)
    (tmp_path / FILE_NAME).write_bytes(whole)
    with (
        pytest.raises(FtqpError, match=rf"{FILE_NAME} (cannot be|is not a|holds)"),
        opened(tmp_path) as results,
    ):
        results.crash(1, "x")
        results.done(), results.count(), results.crashed(), results.seconds(), results.table()


def test_a_crashed_item_is_noted_until_it_has_a_row(tmp_path: Path) -> None:
    with opened(tmp_path) as results:
        results.crash(4, "the worker died")
        assert results.crashed() == {4: "the worker died"}
        results.write([4], [(0.5, 7, "x")], 1.0, "a")
        assert results.crashed() == {}


def test_a_clock_that_is_set_back_changes_no_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times = iter(range(10**6, 0, -1))
    monkeypatch.setattr(time, "time", lambda: float(next(times)))
    monkeypatch.setattr(time, "time_ns", lambda: 10**9 * next(times))
    with opened(tmp_path) as results:
        results.write([0], [(0.5, 7, "x")], 1.0, "a")
    with opened(tmp_path) as results:
        results.write([1], [(0.5, 7, "x")], 1.0, "a")
        assert results.done() == {0, 1} and results.seconds() == 2.0


def mode_of_journal(file: Path) -> int:
    """What the header of a database says: 2 where readers have to write beside it, 1 where not."""
    return file.read_bytes()[18]


def test_finished_file_can_be_read_where_nobody_can_write(tmp_path: Path) -> None:
    with opened(tmp_path) as results:
        results.write([0], [(0.5, 7, "x")], 1.0, "a")
        assert mode_of_journal(tmp_path / FILE_NAME) == 2
    assert mode_of_journal(tmp_path / FILE_NAME) == 1
    with opened(tmp_path) as results:
        assert results.done() == {0}


def test_file_of_an_older_version_is_read_without_anything_written_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with opened(tmp_path) as results:
        results.write([0], [(0.5, 7, "x")], 1.0, "a")
    with closing(sqlite3.connect(tmp_path / FILE_NAME)) as connection:
        connection.execute("PRAGMA journal_mode = WAL")
    assert mode_of_journal(tmp_path / FILE_NAME) == 2
    monkeypatch.setattr(os, "access", lambda *_: False)  # whoever runs the tests may
    with closing(read_only(tmp_path / FILE_NAME)) as connection:
        assert connection.execute("SELECT item FROM results").fetchall() == [(0,)]
        assert not list(tmp_path.glob(f"{FILE_NAME}-*"))


def test_file_that_is_being_read_is_closed_all_the_same(tmp_path: Path) -> None:
    with opened(tmp_path) as results:
        results.write([0], [(0.5, 7, "x")], 1.0, "a")
        with closing(read_only(tmp_path / FILE_NAME)) as connection:
            reader = connection.execute("SELECT item FROM results")
            results.close()
            assert reader.fetchall() == [(0,)]
    with opened(tmp_path) as results:
        assert results.done() == {0}
