"""Studies are run to their end in this process and by processes, killed, interrupted and continued."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from tests.app.study.jobs import ROOT, Squares, environment, expected, kept, results_in

from ftqp.app.study.results_file import FILE_NAME, locked
from ftqp.app.study.runner import DEAD_WORKERS, run_study, study_folder
from ftqp.core.errors import FtqpError, InputError

SCRIPT = """
import signal
import sys
from pathlib import Path
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.runner import run_study
from tests.app.study.jobs import COLUMNS, Squares

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # whatever the tests were started from
    with ResultsFile(Path(sys.argv[1]), kind="squares", key="k", columns=COLUMNS) as results:
        run_study(Squares({work}), 200, results, what="squares", jobs={jobs})
"""


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_missing_item_gets_its_row_and_no_other(tmp_path: Path, jobs: int) -> None:
    with results_in(tmp_path) as results:
        outcome = run_study(Squares(), 17, results, what="squares", jobs=jobs)
        assert (outcome.items, outcome.computed, outcome.crashed) == (17, 17, {})
        assert run_study(Squares(fails=3), 37, results, what="squares", jobs=jobs).computed == 20
        assert results.table() == expected(37)


@pytest.mark.parametrize("deadly", [23, pytest.param(0, marks=pytest.mark.slow)])
def test_an_item_that_always_kills_its_worker_is_given_up_and_the_others_finish(
    tmp_path: Path, deadly: int
) -> None:
    with results_in(tmp_path) as results:
        outcome = run_study(Squares(deadly=deadly), 40, results, what="squares", jobs=2)
        assert outcome.crashed == {deadly: "the worker died"}
        assert results.done() == set(range(40)) - {deadly}
    with pytest.raises(FtqpError, match="the worker died at 1 of 40 pairs; the same command with --resume"):
        outcome.refuse_gaps("pairs")


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_item_that_was_given_up_is_tried_again_after_all_others_and_elsewhere(
    tmp_path: Path, jobs: int
) -> None:
    with results_in(tmp_path) as results:
        results.crash([0, 3], "the worker died")
        outcome = run_study(Squares(deadly=3), 10, results, what="squares", jobs=jobs)
        assert outcome.crashed == {3: "the worker died"} and outcome.computed == 9
        assert results.done() == set(range(10)) - {3}


@pytest.mark.slow
def test_workers_that_die_at_everything_are_not_tried_with_everything_unless_they_did_before(
    tmp_path: Path,
) -> None:
    with results_in(tmp_path) as results:
        with pytest.raises(FtqpError, match="workers die at every item, the last 5 in succession"):
            run_study(Squares(all_deadly_below=100), 100, results, what="squares", jobs=2)
        assert len(results.crashed()) == DEAD_WORKERS
        deadly = DEAD_WORKERS + 1
        results.crash(range(deadly), "the worker died")
        outcome = run_study(Squares(all_deadly_below=deadly), 10, results, what="squares", jobs=2)
        assert set(outcome.crashed) == set(range(deadly)) and outcome.computed == 10 - deadly


def test_an_item_that_raises_ends_the_study_with_its_error_and_is_not_taken_for_one_that_kills(
    tmp_path: Path,
) -> None:
    with results_in(tmp_path) as results:
        with pytest.raises(ArithmeticError, match="item 30"):
            run_study(Squares(fails=30), 40, results, what="squares", jobs=1)
        assert results.done() >= set(range(6)) and results.crashed() == {}


def begun(folder: Path, rows: int, work: str = "seconds=0.02", jobs: int = 2) -> "subprocess.Popen[bytes]":
    """A process that runs a study, as soon as it has some rows on file."""
    script = folder / "script.py"
    script.write_text(SCRIPT.format(work=work, jobs=jobs), encoding="utf-8")
    command = [sys.executable, str(script), str(folder / "out")]
    process = subprocess.Popen(command, env=environment(), cwd=ROOT)
    wait_until(lambda: len(kept(folder / "out")) >= rows or process.poll() is not None)
    return process


def wait_until(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60.0
    while not holds() and time.monotonic() < deadline:
        time.sleep(0.05)


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


@pytest.mark.parametrize(
    ("number", "times"), [pytest.param(signal.SIGKILL, 1, marks=pytest.mark.slow), (signal.SIGINT, 2)]
)
def test_a_study_that_is_killed_or_interrupted_ends_with_its_workers_and_goes_on(
    tmp_path: Path, number: signal.Signals, times: int
) -> None:
    process = begun(tmp_path, 30)
    children = _children(process.pid)
    assert len(children) >= 2
    for _ in range(times):
        process.send_signal(number)
        time.sleep(0.1)
    try:
        assert process.wait(timeout=30) != 0
    finally:
        process.kill()
    wait_until(lambda: not any(_is_alive(child) for child in children))
    assert not any(_is_alive(child) for child in children)
    with results_in(tmp_path / "out") as results:
        before = len(results.done())
        assert 30 <= before < 200
        assert run_study(Squares(), 200, results, what="squares").computed == 200 - before
        assert results.table() == expected(200)


def test_a_worker_that_is_killed_loses_nothing(tmp_path: Path) -> None:
    process = begun(tmp_path, 20)
    for child in _children(process.pid)[-1:]:
        os.kill(child, signal.SIGKILL)
    assert process.wait(timeout=60) == 0
    with results_in(tmp_path / "out") as results:
        assert results.table() == expected(200)


def test_a_process_that_dies_of_an_item_leaves_it_to_a_worker_when_the_study_goes_on(tmp_path: Path) -> None:
    assert begun(tmp_path, 200, "deadly=7", jobs=1).wait(timeout=60) == -signal.SIGKILL
    with results_in(tmp_path / "out") as results:
        assert 7 in results.crashed()
        outcome = run_study(Squares(deadly=7), 20, results, what="squares", jobs=1)
        assert outcome.crashed == {7: "the worker died"}
        assert results.done() == set(range(20)) - {7}


@pytest.mark.parametrize("content", [None, "lock", "results"])
def test_folder_with_no_more_than_a_study_leaves_is_taken(tmp_path: Path, content: str | None) -> None:
    out = tmp_path / "out"
    if content is not None:
        out.mkdir()
    if content == "lock":
        locked(out).close()
        with closing(locked(out)):
            assert study_folder(out, "x") == out
    elif content == "results":
        (out / FILE_NAME).touch()
        (out / "summary.json").touch()
    assert study_folder(out, "x") == out


def test_folder_with_anything_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").touch()
    with pytest.raises(InputError, match="exists, and nothing is overwritten"):
        study_folder(tmp_path, "x")
    with pytest.raises(InputError, match="exists, and nothing is overwritten"):
        study_folder(tmp_path / "mine.txt", "x")
