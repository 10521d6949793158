"""The course of a study's chunks: given to workers, put on file, and computed again where a worker died."""

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import suppress
from typing import final

from ftqp.app.study.chunk import Done
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.workers import Workers
from ftqp.core.errors import FtqpError

PER_WORKER = 2
"""So many chunks wait for a worker or are with it at a time."""
DEAD_WORKERS = 5
"""So many dead workers at items in succession mean that workers do not work at all."""


@final
class Course:
    """Sees chunks through to the end.

    Args:
        results: Where rows go.
        count: Items of the study, numbered from 0.
        told: Hears how many of them have a row.
    """

    def __init__(self, results: ResultsFile, count: int, told: Callable[[float], None]) -> None:
        self._results, self._count, self._told = results, count, told
        self._running: dict[Future[Done], tuple[int, ...]] = {}
        self._deaths = 0
        self._computed, self._seconds = 0, 0.0

    def run(self, workers: Workers, chunks: Sequence[tuple[int, ...]], *, suspected: bool = False) -> float:
        """Have all chunks computed, and put every one on file when it comes back.

        A chunk whose worker died is computed again while no other is; if it kills its worker again, so are
        its items one by one, and one that does it for the third time is noted as crashed.

        Args:
            workers: Who computes them.
            chunks: Items, some at a time.
            suspected: Whether workers may well die at them, so that nothing follows from it if they do.

        Returns:
            What one of these items took [s]; 0 where none was computed.

        Raises:
            FtqpError: No worker lives, or a chunk went wrong.
        """
        self._computed, self._seconds = 0, 0.0
        left, suspects = deque(chunks), deque[tuple[int, ...]]()
        while left or self._running or suspects:
            alone = bool(suspects) and not self._running
            self._fill(workers, suspects if suspects else left, 1 if suspects else _most(workers))
            lost = self._lost(workers)
            for items in lost:
                if not alone:
                    suspects.append(items)
                elif len(items) > 1:
                    suspects.extend((item,) for item in items)
                else:
                    self._results.crash(items[0], "the worker died")
                    self._deaths += not suspected
            self._deaths = self._deaths if lost else 0
            if self._deaths >= DEAD_WORKERS:
                raise FtqpError(
                    f"workers die at every item, the last {self._deaths} in succession; what they said is "
                    "above, and what was computed before is on file"
                )
            self._told(self._results.count(self._count))
        return self._seconds / max(self._computed, 1)

    def _fill(self, workers: Workers, chunks: deque[tuple[int, ...]], most: int) -> None:
        """Give the workers enough to do."""
        while chunks and len(self._running) < most:
            items = chunks.popleft()
            self._running[self._begun(workers, items)] = items

    def _begun(self, workers: Workers, items: tuple[int, ...]) -> "Future[Done]":
        """A chunk under way; one that can take this very process with it is on file as such meanwhile."""
        if workers.apart:
            return workers.submit(items)
        self._results.suspect(items)
        try:
            return workers.submit(items)
        except BaseException:
            with suppress(FtqpError):
                self._results.acquit(items)
            raise

    def _lost(self, workers: Workers) -> list[tuple[int, ...]]:
        """Waits for a chunk; those that were lost because their worker died."""
        ended = wait(self._running, return_when=FIRST_COMPLETED).done
        lost = [items for items in (self._kept(workers, future) for future in ended) if items]
        if lost and workers.share_fate:
            wait(self._running)
            lost += [items for items in (self._kept(workers, f) for f in tuple(self._running)) if items]
        if lost:
            workers.renew()
        return lost

    def _kept(self, workers: Workers, future: "Future[Done]") -> tuple[int, ...]:
        """Puts what came back on file; the items that were lost because their worker died.

        Raises:
            FtqpError: The workers went away, or results cannot be written.
        """
        items = self._running.pop(future)
        try:
            done = future.result()
        except CancelledError as error:
            raise FtqpError(
                f"the workers went away while items {items[0]} to {items[-1]} were computed; what was "
                f"computed before is on file, and {self._results.onward} goes on from there"
            ) from error
        except Exception as error:
            if workers.died(error):
                return items
            raise
        self._results.write(done.items, done.rows, done.seconds, done.worker)
        self._computed += len(done.items)
        self._seconds += done.seconds
        return ()


def _most(workers: Workers) -> int:
    """How many chunks are under way at a time."""
    return PER_WORKER * workers.count if workers.count > 1 else 1
