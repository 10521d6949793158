"""A real Dask cluster of two worker processes computes studies; workers and clients are killed."""

import os
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing

import pytest
from tests.app.conftest import invoke
from tests.app.study.jobs import Squares, environment, expected, kept, results_in

from ftqp.app.study.dask_cluster import DaskCluster
from ftqp.app.study.results_file import FILE_NAME
from ftqp.app.study.runner import run_study
from ftqp.core.errors import InputError

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


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """The scheduler of a cluster in processes of its own."""
    folder = tmp_path_factory.mktemp("cluster")
    script = folder / "cluster.py"
    script.write_text(CLUSTER, encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, str(script)],
        cwd=folder,
        env=environment(),
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


def _begun(folder, address, rows):
    """A client that runs a study on the cluster, as soon as it has some rows on file."""
    script = folder / "client.py"
    script.write_text(CLIENT, encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, str(script), str(folder / "out"), address], env=environment(), cwd=folder
    )
    deadline = time.monotonic() + 60.0
    while (
        len(kept(folder / "out", "worker")) < rows and process.poll() is None and time.monotonic() < deadline
    ):
        time.sleep(0.05)
    return process


@pytest.mark.slow
def test_a_cluster_computes_what_one_process_does(tmp_path, address):
    with results_in(tmp_path) as results:
        run_study(Squares(), 60, results, what="squares", dask=address)
        assert results.table() == expected(60)
    assert len(set(kept(tmp_path, "worker"))) >= 2


@pytest.mark.slow
def test_a_campaign_has_the_same_rows_on_a_cluster(tmp_path, address):
    for name, workers in (("here", ["--jobs", "1"]), ("there", ["--dask", address])):
        result = invoke("campaign", "safety", "--episodes", "12", "--out", tmp_path / name, *workers)
        assert result.exit_code == 0, result.output
    here, there = (_rows(tmp_path / name) for name in ("here", "there"))
    assert len(here) == 12
    assert here == there


def _rows(folder):
    """Every row of a study without its time and worker."""
    with closing(sqlite3.connect(folder / FILE_NAME)) as connection:
        return [row[:-2] for row in connection.execute("SELECT * FROM results ORDER BY item")]


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", "tcp://no-such-host.invalid:8786"])
def test_a_scheduler_that_does_not_answer_is_bad_input(address, monkeypatch):
    monkeypatch.setattr("ftqp.app.study.dask_cluster.TIMEOUT", 1.0)
    with pytest.raises(InputError, match=r"no Dask scheduler answers at .*; start one with: dask scheduler"):
        DaskCluster(Squares(), address)


@pytest.mark.slow
def test_a_killed_worker_and_a_killed_client_lose_nothing_and_repeat_nothing(tmp_path, address):
    process = _begun(tmp_path, address, 60)
    victim = {worker for worker in kept(tmp_path / "out", "worker")[6:]}.pop()
    os.kill(int(victim.rpartition(":")[2]), signal.SIGKILL)
    seen = len(kept(tmp_path / "out", "worker"))
    while len(kept(tmp_path / "out", "worker")) < seen + 40 and process.poll() is None:
        time.sleep(0.05)
    process.kill()
    assert process.wait() == -signal.SIGKILL
    with results_in(tmp_path / "out") as results:
        before = results.done()
        assert 100 <= len(before) < 300
        outcome = run_study(Squares(), 300, results, what="squares", dask=address)
        assert outcome.computed == 300 - len(before)
        assert results.table() == expected(300)


@pytest.mark.slow
def test_an_item_that_kills_every_worker_is_noted(tmp_path, address):
    """The last test here: what is left of the workers may take minutes to begin anew."""
    with results_in(tmp_path) as results:
        outcome = run_study(Squares(deadly=5), 8, results, what="squares", dask=address)
        assert outcome.crashed == {5: "the worker died"}
        assert results.done() == set(range(8)) - {5}
