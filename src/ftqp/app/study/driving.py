"""Drives a study: the items without a row go to workers in chunks, and every chunk goes on file at once."""

import os
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any

from ftqp.app.output.console import progress
from ftqp.app.study.chunk import Done, Work, compute
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.workers import LocalProcesses, ThisProcess, Workers
from ftqp.core.errors import FtqpError, InputError

SHORT = 20.0
"""Work of fewer seconds than this is done in this process, unless processes are asked for [s]."""
PER_WORKER = 2
"""So many chunks wait for a worker or are with it at a time."""
HOPELESS = 5
"""Workers that die at so many items in succession do not work at all."""
ROUNDS = 4
"""A worker gets at least so many chunks, so that no one waits long for the last."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Driven:
    """How a study's items were computed.

    Attributes:
        items: Items of the study.
        computed: Those that were computed now.
        crashed: Those at which a worker died, with the reason.
        seconds: Processor time of all rows on file [s].
    """

    items: int
    computed: int
    crashed: dict[int, str]
    seconds: float


def drive(
    work: Work,
    count: int,
    results: ResultsFile,
    *,
    what: str,
    jobs: int | None = None,
    cluster: Callable[[Work], Workers] | None = None,
    heard: Callable[[float], None] | None = None,
) -> Driven:
    """Compute the items of a study that have no row yet.

    Interrupted at any point, it loses the chunks that are being computed, and goes on when called again.

    Args:
        work: What computes the rows of some items.
        count: Items of the study, numbered from 0.
        results: Where rows go.
        what: The study, for the progress bar.
        jobs: Processes of this machine; None takes all cores where the work is worth it.
        cluster: Makes the workers of a cluster, in place of processes.
        heard: Hears how many items are done, in place of a bar.

    Raises:
        FtqpError: A chunk went wrong, or results cannot be written.
    """
    done = results.done()
    missing = [item for item in range(count) if item not in done]
    begun = count - len(missing)
    with progress(what, float(count)) if heard is None else nullcontext(heard) as told:
        told(begun)
        per_item = 0.0
        for size in (1, 1, 4)[: 3 if missing else 0]:  # the first one compiles
            first, missing = missing[:size], missing[size:]
            if first:
                tried = compute(work, first)
                results.write(tried.items, tried.rows, tried.seconds, tried.worker)
                per_item = tried.seconds / len(first)
        told(count - len(missing))
        if missing:
            workers = _workers(work, per_item * len(missing), jobs, cluster)
            try:
                _run(workers, _chunks(missing, per_item, workers), results, told)
            finally:
                workers.close()
    crashed = results.crashed()
    return Driven(
        items=count, computed=count - begun - len(crashed), crashed=crashed, seconds=results.seconds()
    )


def _workers(
    work: Work, seconds: float, jobs: int | None, cluster: Callable[[Work], Workers] | None
) -> Workers:
    """Who computes work of so many seconds."""
    if cluster is not None:
        return cluster(work)
    count = jobs or (1 if seconds < SHORT else os.cpu_count() or 1)
    return ThisProcess(work) if count == 1 else LocalProcesses(work, count)


def _chunks(missing: Sequence[int], per_item: float, workers: Workers) -> deque[tuple[int, ...]]:
    """The items in chunks, as long as the workers want them, but enough to go round."""
    most = max(1, len(missing) // (ROUNDS * workers.count))
    size = min(most, max(1, round(workers.chunk_seconds / max(per_item, 1e-6))))
    return deque(tuple(missing[at : at + size]) for at in range(0, len(missing), size))


def _run(
    workers: Workers,
    chunks: deque[tuple[int, ...]],
    results: ResultsFile,
    told: Callable[[float], None],
) -> None:
    """All chunks, and every one on file when it comes back.

    A chunk whose worker died is computed again while no other is; if it kills its worker again, so are its
    items one by one, and one that does it for the third time is noted as crashed.

    Raises:
        FtqpError: No worker lives, or a chunk went wrong.
    """
    deaths = 0
    running: dict[Future[Done], tuple[int, ...]] = {}
    suspects: deque[tuple[int, ...]] = deque()
    while chunks or running or suspects:
        alone = bool(suspects) and not running
        _fill(workers, suspects if suspects else chunks, running, 1 if suspects else _most(workers))
        ended = wait(running, return_when=FIRST_COMPLETED).done
        lost = [items for items in (_kept(workers, running, future, results) for future in ended) if items]
        if lost and workers.share_fate:
            wait(running)
            lost += [
                items for items in (_kept(workers, running, f, results) for f in tuple(running)) if items
            ]
        if lost:
            workers.renew()
        for items in lost:
            if not alone:
                suspects.append(items)
            elif len(items) > 1:
                suspects.extend((item,) for item in items)
            else:
                results.crash(items[0], "the worker died")
                deaths += 1
        deaths = deaths if lost else 0
        if deaths >= HOPELESS:
            raise FtqpError(
                f"workers die at every item, the last {deaths} in succession; what they said is above, and "
                "what was computed before is on file"
            )
        told(results.count())


def _most(workers: Workers) -> int:
    """How many chunks are under way at a time."""
    return PER_WORKER * workers.count if workers.count > 1 else 1


def _fill(
    workers: Workers,
    chunks: deque[tuple[int, ...]],
    running: dict["Future[Done]", tuple[int, ...]],
    most: int,
) -> None:
    """Give the workers enough to do."""
    while chunks and len(running) < most:
        items = chunks.popleft()
        running[workers.submit(items)] = items


def _kept(
    workers: Workers,
    running: dict["Future[Done]", tuple[int, ...]],
    future: "Future[Done]",
    results: ResultsFile,
) -> tuple[int, ...]:
    """Puts what came back on file; the items that were lost because their worker died.

    Raises:
        FtqpError: The workers went away, or results cannot be written.
    """
    items = running.pop(future)
    try:
        done = future.result()
    except CancelledError as error:
        raise FtqpError(
            f"the workers went away while items {items[0]} to {items[-1]} were computed; what was computed "
            "before is on file, and the same command goes on from there"
        ) from error
    except Exception as error:
        if workers.died(error):
            return items
        raise
    results.write(done.items, done.rows, done.seconds, done.worker)
    return ()


def cluster_at(jobs: int | None, dask: str | None) -> Callable[[Any], Workers] | None:
    """Makes the workers of a cluster; None where processes do the work.

    Args:
        jobs: What ``--jobs`` says.
        dask: What ``--dask`` says.

    Raises:
        InputError: There are no jobs, or both say who computes.
    """
    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs is {jobs}, expected 1 process or more")
    if jobs is not None and dask is not None:
        raise InputError("--jobs and --dask both say who computes; leave one of them out")
    return None if dask is None else partial(_cluster, dask)


def _cluster(address: str, work: Any) -> Workers:
    from ftqp.app.study.dask_cluster import DaskCluster  # an optional package

    return DaskCluster(work, address)
