"""Runs a study: the items without a row go to workers in chunks, and every chunk goes on file at once."""

import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import final

from ftqp.app.output.console import progress, say
from ftqp.app.run.runs import free_folder, holds
from ftqp.app.study.results_file import FILE_NAME, LOCK_NAME, ResultsFile
from ftqp.app.study.workers import Computed, LocalProcesses, ThisProcess, Work, Workers
from ftqp.core.errors import FtqpError, InputError

SHORT = 20.0
"""Work of fewer seconds than this is done in this process, unless processes are asked for [s]."""
MEASURED = 3
"""So many chunks come before that is decided; the first one compiles."""
ROUNDS = 4
"""A worker gets at least so many chunks, so that no one waits long for the last."""
GROWTH = 4
"""A chunk is at most so many times as large as those before it, as items may differ."""
DEAD_WORKERS = 5
"""So many dead workers at items in succession mean that workers do not work at all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How a study's items were computed: now, or not, as a worker died; and what all of them took [s]."""

    items: int
    computed: int
    crashed: dict[int, str]
    seconds: float

    def refuse_gaps(self, called: str) -> None:
        """Refuse to go on without every row."""
        if self.crashed:
            raise FtqpError(
                f"the worker died at {len(self.crashed)} of {self.items} {called}; the same command with "
                "--resume tries them again"
            )


def refuse_wrong_workers(jobs: int | None, dask: str | None) -> None:
    """Refuse what cannot say who computes."""
    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs is {jobs}, expected 1 process or more")
    if jobs is not None and dask is not None:
        raise InputError("--jobs and --dask both say who computes; leave one of them out")


def run_study(
    work: Work,
    count: int,
    results: ResultsFile,
    *,
    what: str,
    jobs: int | None = None,
    dask: str | None = None,
) -> Outcome:
    """Compute the items of a study that have no row yet.

    Interrupted at any point, it loses the chunks that are being computed, and goes on when called again.
    Items at which a process died before, a worker's or this one, come last, and in processes of their own.
    """
    done, crashed = results.done(), results.crashed()
    missing = [item for item in range(count) if item not in done]
    begun = count - len(missing)
    with progress(what, float(count)) as notify:
        notify(begun)
        if missing:
            fresh = [item for item in missing if item not in crashed]
            known = [item for item in missing if item in crashed]
            with closing(_Runner(work, results, jobs, dask, lambda: notify(results.count(count)))) as runner:
                runner.run(fresh, known)
    return Outcome(
        items=count,
        computed=results.count(count) - begun,
        crashed={item: reason for item, reason in results.crashed().items() if 0 <= item < count},
        seconds=results.seconds(count),
    )


@final
class _Runner:
    """Sees items through to the end."""

    def __init__(
        self, work: Work, results: ResultsFile, jobs: int | None, dask: str | None, notify: Callable[[], None]
    ) -> None:
        self._work, self._results, self._notify = work, results, notify
        self._workers = _workers(work, jobs, dask)
        self._may_spread = jobs is None and dask is None and (os.cpu_count() or 1) > 1
        self._running: dict[Future[Computed], tuple[int, ...]] = {}
        self._quarantine: deque[tuple[int, ...]] = deque()
        self._chunks, self._per_item, self._largest = 0, float("inf"), 1
        self._deaths = 0

    def run(self, fresh: Sequence[int], known: Sequence[int]) -> None:
        """Compute fresh items in chunks, then alone those at which a process is known to have died."""
        self._compute(deque(fresh), frozenset())
        if known and not self._workers.apart:
            self._workers = LocalProcesses(self._work, 1)
        self._quarantine.extend((item,) for item in known)
        self._compute(deque(), frozenset(known))

    def close(self) -> None:
        """Let the workers go."""
        self._workers.close()

    def _compute(self, left: deque[int], known: frozenset[int]) -> None:
        """Chunks whose worker died are in quarantine: computed alone, then by halves, at last given up."""
        while left or self._running or self._quarantine:
            alone = bool(self._quarantine) and not self._running
            if alone:
                self._submit(self._quarantine.popleft())
            elif not self._quarantine:
                self._spread(len(left))
                while left and len(self._running) < self._workers.most:
                    self._submit(self._taken(left))
            for future in wait(self._running, return_when=FIRST_COMPLETED).done:
                items = self._running.pop(future)
                if self._kept(future, items):
                    self._deaths = 0
                elif not alone:
                    self._quarantine.append(items)
                elif len(items) > 1:
                    middle = len(items) // 2
                    self._quarantine.extendleft((items[middle:], items[:middle]))
                else:
                    self._give_up(items, expected=items[0] in known)
            self._notify()

    def _taken(self, left: deque[int]) -> tuple[int, ...]:
        """The next chunk, as long as workers want it, but short enough to go round."""
        share = len(left) // (ROUNDS * self._workers.count)
        wanted = self._workers.chunk_seconds / max(self._per_item, 1e-6)
        size = max(1, int(min(share, wanted, GROWTH * self._largest)))
        self._largest = max(self._largest, size)
        return tuple(left.popleft() for _ in range(size))

    def _spread(self, left: int) -> None:
        """Go on in processes where what is left is worth them."""
        long = self._chunks >= MEASURED and self._per_item * left >= SHORT
        if long and self._may_spread and not self._workers.apart:
            self._workers = LocalProcesses(self._work, os.cpu_count() or 1)

    def _submit(self, items: tuple[int, ...]) -> None:
        """Begin a chunk; one that can take this very process with it is on file as such meanwhile."""
        if not self._workers.apart:
            self._results.crash(items, "the process died")
        try:
            self._running[self._workers.submit(items)] = items
        except BaseException:
            if not self._workers.apart:
                with suppress(FtqpError):
                    self._results.clear(items)
            raise

    def _kept(self, future: "Future[Computed]", items: tuple[int, ...]) -> bool:
        """Puts what came back on file; whether its worker lived."""
        try:
            rows, seconds, worker = future.result()
        except self._workers.death:
            return False
        except CancelledError as error:
            raise FtqpError(
                f"the workers went away while items {items[0]} to {items[-1]} were computed; what was "
                f"computed before is on file, and {self._results.onward} goes on from there"
            ) from error
        self._results.write(items, rows, seconds, worker)
        self._chunks += 1
        self._per_item = seconds / len(items)
        return True

    def _give_up(self, items: tuple[int, ...], *, expected: bool) -> None:
        """Notes an item that killed its worker while no other was computed."""
        self._results.crash(items, "the worker died")
        self._deaths += not expected
        if self._deaths >= DEAD_WORKERS:
            raise FtqpError(
                f"workers die at every item, the last {self._deaths} in succession; what they said is "
                "above, and what was computed before is on file"
            )


def _workers(work: Work, jobs: int | None, dask: str | None) -> Workers:
    """Who computes the first items, and all others unless it turns out that they are worth processes."""
    if dask is not None:
        from ftqp.app.study.dask_cluster import DaskCluster  # an optional package

        return DaskCluster(work, dask)
    return ThisProcess(work) if jobs is None or jobs == 1 else LocalProcesses(work, jobs)


def study_folder(out: Path | None, name: str) -> Path:
    """The folder wanted where a study has begun; else as for a run."""
    if out is not None and (holds(out, FILE_NAME) or holds(out, LOCK_NAME)):
        return out
    return free_folder(out, name)


@contextmanager
def told_how_to_go_on(folder: Path) -> Iterator[None]:
    """What whoever interrupts a study reads: the command that goes on with it, with its folder."""
    try:
        yield
    except KeyboardInterrupt:
        say(f"what is done is kept; the same command with --out {folder} goes on from there")
        raise
