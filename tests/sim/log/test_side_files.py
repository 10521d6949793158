"""A pipe beside a database of SQLite lets nobody wait."""

import os
import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from ftqp.app.study.results_file import ResultsFile, locked, read_only
from ftqp.core.errors import InputError
from ftqp.sim.log.side_files import SIDES

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes among its files")
PATIENCE = 20.0
"""A call that has not come back after so long waits forever [s]."""


def refusal(call: Callable[[], object]) -> str:
    """What a call is refused with; a user's thread makes it, so that one that hangs fails the test."""
    said = []

    def ask() -> None:
        try:
            call()
        except InputError as error:
            said.append(str(error))

    user = threading.Thread(target=ask, daemon=True)
    user.start()
    user.join(PATIENCE)
    assert said, "it hangs, or does not refuse"
    return said[0]


@pytest.mark.parametrize("side", SIDES)
def test_pipe_beside_results_or_their_lock_is_refused_at_once(tmp_path: Path, side: str) -> None:
    def opened() -> ResultsFile:
        return ResultsFile(tmp_path, kind="map", key="k", columns={"error": "REAL"})

    opened().close()
    file = tmp_path / "results.sqlite"
    os.mkfifo(f"{file}{side}")
    for call in (opened, lambda: read_only(file).execute("SELECT * FROM results")):
        assert f"cannot be used: results.sqlite{side} is no regular file; delete" in refusal(call)
    os.mkfifo(tmp_path / f"writer.lock{side}")
    assert f"cannot be used: writer.lock{side} is no regular" in refusal(lambda: locked(tmp_path, "wait"))


def test_side_files_of_a_writer_at_work_are_no_hindrance(tmp_path: Path) -> None:
    with ResultsFile(tmp_path, kind="map", key="k", columns={"error": "REAL"}) as results:
        results.write([0], [(0.5,)], 1.0, "a")
        assert (tmp_path / "results.sqlite-wal").is_file()
        with closing(read_only(tmp_path / "results.sqlite")) as connection:
            assert connection.execute("SELECT error FROM results").fetchall() == [(0.5,)]
