"""Drives a study: the items without a row go to workers in chunks, and every chunk goes on file at once."""

import os
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any

from ftqp.app.output.console import progress
from ftqp.app.study.chunk import Work
from ftqp.app.study.course import Course
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.workers import LocalProcesses, ThisProcess, Workers
from ftqp.core.errors import InputError

SHORT = 20.0
"""Work of fewer seconds than this is done in this process, unless processes are asked for [s]."""
ROUNDS = 4
"""A worker gets at least so many chunks, so that no one waits long for the last."""
TRIED = (1, 1, 4)
"""So many items go before all others, to see what an item takes; the first one compiles."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Driven:
    """How a study's items were computed.

    Attributes:
        items: Items of the study.
        computed: Those that were computed now.
        crashed: Those at which a worker died, with the reason.
        seconds: Processor time of the rows of these items [s].
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
    Items at which a process died before, a worker's or this one, come last, and in processes of their own.

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
    done, suspected = results.done(), results.crashed()
    missing = [item for item in range(count) if item not in done]
    begun = count - len(missing)
    with progress(what, float(count)) if heard is None else nullcontext(heard) as told:
        told(begun)
        if missing:
            first = [item for item in missing if item not in suspected]
            last = [item for item in missing if item in suspected]
            _drive(work, first, last, Course(results, count, told), jobs, cluster)
    return Driven(
        items=count,
        computed=results.count(count) - begun,
        crashed={item: reason for item, reason in results.crashed().items() if 0 <= item < count},
        seconds=results.seconds(count),
    )


def _drive(
    work: Work,
    first: Sequence[int],
    last: Sequence[int],
    course: Course,
    jobs: int | None,
    cluster: Callable[[Work], Workers] | None,
) -> None:
    """Computes all these items; the last ones are known to kill, and that is never to be this process."""
    with ExitStack() as ended:
        workers = ended.enter_context(closing(_workers(work, jobs, cluster)))
        per_item = 0.0
        for size in TRIED:
            tried, first = tuple(first[:size]), first[size:]
            per_item = course.run(workers, [tried] if tried else []) or per_item
        cores = os.cpu_count() or 1
        if jobs is None and not workers.apart and cores > 1 and per_item * len(first) >= SHORT:
            workers = ended.enter_context(closing(LocalProcesses(work, cores)))
        course.run(workers, _chunks(first, per_item, workers))
        if last and not workers.apart:
            workers = ended.enter_context(closing(LocalProcesses(work, 1)))
        course.run(workers, _chunks(last, per_item, workers), suspected=True)


def _workers(work: Work, jobs: int | None, cluster: Callable[[Work], Workers] | None) -> Workers:
    """Who computes the first items, and all others unless it turns out that they are worth processes."""
    if cluster is not None:
        return cluster(work)
    return ThisProcess(work) if jobs is None or jobs == 1 else LocalProcesses(work, jobs)


def _chunks(missing: Sequence[int], per_item: float, workers: Workers) -> list[tuple[int, ...]]:
    """The items in chunks, as long as the workers want them, but enough to go round."""
    most = max(1, len(missing) // (ROUNDS * workers.count))
    size = min(most, max(1, round(workers.chunk_seconds / max(per_item, 1e-6))))
    return [tuple(missing[at : at + size]) for at in range(0, len(missing), size)]


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
