"""A real Dask cluster of two worker processes computes studies; workers and clients are killed."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from tests.app.conftest import invoke
from tests.app.study.jobs import COLUMNS, Squares, expected

from ftqp.app.study.dask_cluster import DaskCluster
from ftqp.app.study.results_file import FILE_NAME, ResultsFile
from ftqp.app.study.runner import run_study
from ftqp.core.errors import InputError

ROOT = Path(__file__).parents[3]
CLUSTER = """
import os
import sys
import dask
from distributed import LocalCluster

if __name__ == "__main__":
    dask.config.set({"distributed.scheduler.allowed-failures": 1})  # a worker takes seconds to begin anew
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()
"""
CLIENT = """
import sys
from pathlib import Path
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.runner import run_study
from tests.app.study.jobs import COLUMNS, Squares

if __name__ == "__main__":
    with ResultsFile(Path(sys.argv[1]), kind="squares", key="k", columns=COLUMNS) as results:
        run_study(Squares(seconds=0.02), 300, results, what="squares", dask=sys.argv[2])
"""


def _environment() -> dict[str, str]:
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)])}


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The scheduler of a cluster in processes of its own."""
    folder = tmp_path_factory.mktemp("cluster")
    script = folder / "cluster.py"
    script.write_text(CLUSTER, encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, str(script)],
        cwd=folder,
        env=_environment(),
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert process.stdin is not None and process.stdout is not None
    yield process.stdout.readline().strip()
    process.stdin.close()
    process.stdout.close()
    process.wait(timeout=30)


def _begun(folder: Path, address: str, rows: int) -> "subprocess.Popen[bytes]":
    """A client that runs a study on the cluster, as soon as it has some rows on file."""
    script = folder / "client.py"
    script.write_text(CLIENT, encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, str(script), str(folder / "out"), address], env=_environment(), cwd=folder
    )
    deadline = time.monotonic() + 60.0
    while len(_workers(folder / "out")) < rows and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.05)
    return process


def _workers(folder: Path) -> list[str]:
    """Who computed each item that is on file."""
    if not (folder / FILE_NAME).is_file():
        return []
    connection = sqlite3.connect((folder / FILE_NAME).absolute().as_uri() + "?mode=ro", uri=True)
    try:
        return [worker for (worker,) in connection.execute("SELECT worker FROM results ORDER BY item")]
    except sqlite3.Error:
        return []
    finally:
        connection.close()


def _results(folder: Path) -> ResultsFile:
    return ResultsFile(folder, kind="squares", key="k", columns=COLUMNS)


@pytest.mark.slow
def test_a_cluster_computes_what_one_process_does(tmp_path: Path, address: str) -> None:
    with _results(tmp_path) as results:
        run_study(Squares(), 60, results, what="squares", dask=address)
        assert results.table() == expected(60)
    assert len(set(_workers(tmp_path))) >= 2


@pytest.mark.slow
def test_a_campaign_has_the_same_rows_on_a_cluster(tmp_path: Path, address: str) -> None:
    for name, workers in (("here", ["--jobs", "1"]), ("there", ["--dask", address])):
        result = invoke("campaign", "safety", "--episodes", "12", "--out", tmp_path / name, *workers)
        assert result.exit_code == 0, result.output
    here, there = (_rows(tmp_path / name) for name in ("here", "there"))
    assert len(here) == 12
    assert here == there


def _rows(folder: Path) -> list[tuple[float, ...]]:
    """Every row of a study without its time and worker."""
    with closing(sqlite3.connect(folder / FILE_NAME)) as connection:
        return [row[:-2] for row in connection.execute("SELECT * FROM results ORDER BY item")]


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", "tcp://no-such-host.invalid:8786"])
def test_a_scheduler_that_does_not_answer_is_bad_input(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ftqp.app.study.dask_cluster.TIMEOUT", 1.0)
    with pytest.raises(InputError, match=r"no Dask scheduler answers at .*; start one with: dask scheduler"):
        DaskCluster(Squares(), address)


@pytest.mark.slow
def test_a_killed_worker_and_a_killed_client_lose_nothing_and_repeat_nothing(
    tmp_path: Path, address: str
) -> None:
    process = _begun(tmp_path, address, 60)
    victim = {worker for worker in _workers(tmp_path / "out")[6:]}.pop()
    os.kill(int(victim.rpartition(":")[2]), signal.SIGKILL)
    seen = len(_workers(tmp_path / "out"))
    while len(_workers(tmp_path / "out")) < seen + 40 and process.poll() is None:
        time.sleep(0.05)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    with _results(tmp_path / "out") as results:
        before = results.done()
        assert 100 <= len(before) < 300
        outcome = run_study(Squares(), 300, results, what="squares", dask=address)
        assert outcome.computed == 300 - len(before)
        assert results.table() == expected(300)


@pytest.mark.slow
def test_an_item_that_kills_every_worker_is_noted(tmp_path: Path, address: str) -> None:
    """The last test here: what is left of the workers may take minutes to begin anew."""
    with _results(tmp_path) as results:
        outcome = run_study(Squares(deadly=5), 8, results, what="squares", dask=address)
        assert outcome.crashed == {5: "the worker died"}
        assert results.done() == set(range(8)) - {5}
