"""Studies are driven to their end in this process and by processes, killed, interrupted and continued."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest
from tests.app.study.jobs import COLUMNS, Squares, expected

from ftqp.app.study.course import DEAD_WORKERS
from ftqp.app.study.driving import drive
from ftqp.app.study.results_file import FILE_NAME, ResultsFile
from ftqp.app.study.workers import LocalProcesses
from ftqp.core.errors import FtqpError


def results_in(folder: Path) -> ResultsFile:
    return ResultsFile(folder, kind="squares", key="k", columns=COLUMNS)


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_item_gets_its_row(tmp_path: Path, jobs: int) -> None:
    with results_in(tmp_path) as results:
        driven = drive(Squares(), 37, results, what="squares", jobs=jobs)
        assert results.table() == expected(37)
    assert (driven.items, driven.computed, driven.crashed) == (37, 37, {})


def test_only_what_is_missing_is_computed(tmp_path: Path) -> None:
    with results_in(tmp_path) as results:
        drive(Squares(), 10, results, what="squares")
        driven = drive(Squares(fails=3), 20, results, what="squares")
        assert driven.computed == 10
        assert results.table() == expected(20)


def test_only_items_of_the_study_are_counted_where_it_had_more_before(tmp_path: Path) -> None:
    with results_in(tmp_path) as results:
        drive(Squares(), 20, results, what="squares")
        whole = results.seconds()
        results.crash(25, "the worker died")
        told: list[float] = []
        driven = drive(Squares(), 10, results, what="squares", heard=told.append)
    assert (driven.items, driven.computed, driven.crashed) == (10, 0, {})
    assert 0.0 < driven.seconds < whole and max(told) == 10


def test_an_item_that_always_kills_its_worker_is_noted_and_the_others_finish(tmp_path: Path) -> None:
    with results_in(tmp_path) as results:
        driven = drive(Squares(deadly=23), 40, results, what="squares", jobs=2)
        assert driven.crashed == {23: "the worker died"}
        assert results.done() == set(range(40)) - {23}


def test_an_item_that_kills_takes_a_worker_with_it_and_not_the_command_also_among_the_first(
    tmp_path: Path,
) -> None:
    with results_in(tmp_path) as results:
        driven = drive(Squares(deadly=2), 8, results, what="squares", jobs=2)
        assert driven.crashed == {2: "the worker died"}
        assert results.done() == set(range(8)) - {2}


@pytest.mark.parametrize("jobs", [None, 1, 2])
def test_an_item_that_was_given_up_is_tried_again_after_all_others_and_elsewhere(
    tmp_path: Path, jobs: int | None
) -> None:
    with results_in(tmp_path) as results:
        for item in (0, 3):
            results.crash(item, "the worker died")
        driven = drive(Squares(deadly=3), 10, results, what="squares", jobs=jobs)
        assert driven.crashed == {3: "the worker died"} and driven.computed == 9
        assert results.done() == set(range(10)) - {3}


def test_many_items_that_were_given_up_do_not_keep_a_study_from_its_end(tmp_path: Path) -> None:
    with results_in(tmp_path) as results:
        for item in range(DEAD_WORKERS + 1):
            results.crash(item, "the worker died")
        driven = drive(Squares(all_deadly_below=DEAD_WORKERS + 1), 10, results, what="squares", jobs=2)
        assert set(driven.crashed) == set(range(DEAD_WORKERS + 1)) and driven.computed == 9 - DEAD_WORKERS


def test_workers_that_die_at_everything_are_not_tried_with_everything(tmp_path: Path) -> None:
    with results_in(tmp_path) as results:
        with pytest.raises(FtqpError, match="workers die at every item, the last 5 in succession"):
            drive(Squares(all_deadly_below=100), 100, results, what="squares", jobs=2)
        assert len(results.crashed()) == DEAD_WORKERS


ALONE = """
import sys
from pathlib import Path
from ftqp.app.study.driving import drive
from ftqp.app.study.results_file import ResultsFile
from tests.app.study.jobs import COLUMNS, Squares

with ResultsFile(Path(sys.argv[1]), kind="squares", key="k", columns=COLUMNS) as results:
    drive(Squares(deadly=7), 20, results, what="squares", jobs=1)
"""


def test_a_process_that_dies_of_an_item_leaves_it_to_a_worker_when_the_study_goes_on(tmp_path: Path) -> None:
    root = Path(__file__).parents[3]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(root / "src"), str(root)])}
    died = subprocess.run(
        [sys.executable, "-c", ALONE, str(tmp_path)], env=environment, cwd=root, check=False, timeout=60
    )
    assert died.returncode == -signal.SIGKILL
    with results_in(tmp_path) as results:
        assert 7 in results.crashed()
        driven = drive(Squares(deadly=7), 20, results, what="squares", jobs=1)
        assert driven.crashed == {7: "the worker died"}
        assert results.done() == set(range(20)) - {7}


def test_an_interrupted_or_failed_item_is_not_taken_for_one_that_kills(tmp_path: Path) -> None:
    with results_in(tmp_path) as results:
        with pytest.raises(ArithmeticError):
            drive(Squares(fails=0), 10, results, what="squares", jobs=1)
        assert results.crashed() == {}


def test_a_chunk_that_raises_ends_the_study_with_its_error_and_keeps_the_rest(tmp_path: Path) -> None:
    with results_in(tmp_path) as results:
        with pytest.raises(ArithmeticError, match="item 30"):
            drive(Squares(fails=30), 40, results, what="squares", jobs=1)
        assert results.done() >= set(range(6))


SCRIPT = """
import signal
import sys
from pathlib import Path
from ftqp.app.study.driving import drive
from ftqp.app.study.results_file import ResultsFile
from tests.app.study.jobs import COLUMNS, Squares

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # whatever the tests were started from
    with ResultsFile(Path(sys.argv[1]), kind="squares", key="k", columns=COLUMNS) as results:
        drive(Squares(seconds=0.05), 200, results, what="squares", jobs=2)
"""


def begun(folder: Path, rows: int) -> "subprocess.Popen[bytes]":
    """A process that drives a study, as soon as it has some rows on file."""
    script = folder / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    root = Path(__file__).parents[3]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(root / "src"), str(root)])}
    process = subprocess.Popen([sys.executable, str(script), str(folder / "out")], env=environment, cwd=root)
    deadline = time.monotonic() + 60.0
    while _rows(folder / "out") < rows and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.05)
    return process


def _rows(folder: Path) -> int:
    if not (folder / FILE_NAME).is_file():
        return 0
    connection = sqlite3.connect((folder / FILE_NAME).absolute().as_uri() + "?mode=ro", uri=True)
    try:
        return int(connection.execute("SELECT count(*) FROM results").fetchone()[0])
    except sqlite3.Error:
        return 0
    finally:
        connection.close()


def test_a_study_whose_process_is_killed_goes_on_where_it_was(tmp_path: Path) -> None:
    process = begun(tmp_path, 30)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    with results_in(tmp_path / "out") as results:
        before = len(results.done())
        assert 30 <= before < 200
        driven = drive(Squares(), 200, results, what="squares")
        assert driven.computed == 200 - before
        assert results.table() == expected(200)


def test_workers_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    process = begun(tmp_path, 30)
    children = _children(process.pid)
    assert len(children) >= 2
    process.kill()
    process.wait()
    deadline = time.monotonic() + 60.0
    while any(_is_alive(child) for child in children) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(_is_alive(child) for child in children)


def _children(parent: int) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[1]) == parent:
                found.append(int(entry.name))
    return found


def _is_alive(process: int) -> bool:
    try:
        return (Path("/proc") / str(process) / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_study_that_is_interrupted_leaves_a_file_that_goes_on(tmp_path: Path) -> None:
    process = begun(tmp_path, 30)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=30) != 0
    with results_in(tmp_path / "out") as results:
        assert 30 <= len(results.done()) < 200
        drive(Squares(), 200, results, what="squares")
        assert results.table() == expected(200)


def test_a_second_interrupt_ends_a_study_as_soon_as_the_first(tmp_path: Path) -> None:
    process = begun(tmp_path, 30)
    children = _children(process.pid)
    for _ in range(2):
        process.send_signal(signal.SIGINT)
        time.sleep(0.1)
    try:
        assert process.wait(timeout=30) != 0
    finally:
        process.kill()
    assert children and not any(_is_alive(child) for child in children)
    with results_in(tmp_path / "out") as results:
        assert 30 <= len(results.done()) < 200


def test_workers_end_without_finishing_what_nobody_waits_for() -> None:
    workers = LocalProcesses(Squares(seconds=0.01), 1)
    workers.submit([1]).result()
    workers.submit(range(2, 100_000))
    began = time.monotonic()
    workers.close()
    assert time.monotonic() - began < 60.0


def test_a_worker_that_is_killed_loses_nothing(tmp_path: Path) -> None:
    process = begun(tmp_path, 20)
    for child in _children(process.pid)[-1:]:
        os.kill(child, signal.SIGKILL)
    assert process.wait(timeout=60) == 0
    with results_in(tmp_path / "out") as results:
        assert results.table() == expected(200)


def test_an_interrupt_while_a_process_starts_waits_until_it_has(monkeypatch: pytest.MonkeyPatch) -> None:
    began, before = [], signal.default_int_handler
    ours = signal.signal(signal.SIGINT, before)  # a process of pytest's own pool does not listen
    workers = LocalProcesses(Squares(), 1)
    try:

        def starts(*_: object) -> None:
            signal.raise_signal(signal.SIGINT)
            began.append(True)

        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            patch.setattr(workers._pool, "submit", starts)
            workers.submit([1])
        assert began == [True] and signal.getsignal(signal.SIGINT) is before
        assert workers.submit([2]).result().items == (2,)
    finally:
        workers.close()
        signal.signal(signal.SIGINT, ours)


def test_a_chunk_that_comes_when_its_pool_has_just_broken_is_lost_like_those_in_it() -> None:
    workers = LocalProcesses(Squares(), 1)
    try:
        workers.submit([1]).result()
        for process in workers._pool._processes.values():
            process.kill()
        first = workers.submit([2]).exception()
        second = workers.submit([3]).exception()
        assert first is not None and second is not None and workers.died(first) and workers.died(second)
        workers.renew()
        assert workers.submit([4]).result().items == (4,)
    finally:
        workers.close()


def test_a_chunk_that_comes_while_its_pool_breaks_is_lost_like_those_in_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    workers = LocalProcesses(Squares(), 1)
    own = workers._pool.submit
    try:
        workers.submit([1]).result()

        def breaks(*arguments: Any) -> Any:
            monkeypatch.setattr(workers._pool, "_broken", "a child process terminated abruptly")
            raise ValueError("bad value(s) in fds_to_keep")  # of a pipe that was closed meanwhile

        monkeypatch.setattr(workers._pool, "submit", breaks)
        lost = workers.submit([2]).exception()
        assert lost is not None and workers.died(lost)
        monkeypatch.setattr(workers._pool, "submit", lambda *_: Future())  # nobody will ever end it
        lost = workers.submit([3]).exception(timeout=30.0)
        assert lost is not None and workers.died(lost)
        monkeypatch.setattr(workers._pool, "submit", own)
        workers.renew()
        assert workers.submit([4]).result().items == (4,)
    finally:
        workers.close()
