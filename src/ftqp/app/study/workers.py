"""Who computes the chunks of a study: this process, processes of this machine, or a Dask cluster."""

import os
import signal
import socket
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from typing import Any, final

from ftqp.core.clock import now
from ftqp.core.errors import InputError
from ftqp.core.safe_path import SAFE_PATH, safe_path

PER_WORKER = 2
"""So many chunks wait for a worker or are with it at a time."""
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Every worker has a core of its own, so numerical libraries start no threads."""


Work = Callable[[Sequence[int]], list[tuple[Any, ...]]]
"""Computes the rows of some items; it can be pickled, and a row depends on its item alone."""
Computed = tuple[list[tuple[Any, ...]], float, str]
"""The rows of a chunk, what it took [s], and who computed it: host and process."""


class Workers(ABC):
    """Computes chunks.

    Attributes:
        count: How many chunks are computed at a time.
        chunk_seconds: How long a chunk should take, so that what it costs to send it vanishes [s].
        death: What the future of a chunk raises whose worker died.
        apart: Whether this process lives on when a worker dies.
    """

    count: int
    chunk_seconds: float
    death: tuple[type[Exception], ...] = ()
    apart = True

    @property
    def most(self) -> int:
        """How many chunks are under way at a time."""
        return PER_WORKER * self.count if self.count > 1 else 1

    @abstractmethod
    def submit(self, items: tuple[int, ...]) -> "Future[Computed]":
        """Begin a chunk, on new workers where the last ones died."""

    @abstractmethod
    def close(self) -> None:
        """End, without waiting for chunks that have not ended."""


def compute(work: Work, items: tuple[int, ...]) -> Computed:
    """The rows of some items."""
    began = now()
    rows = work(items)
    return rows, (now() - began) * 1e-9, f"{socket.gethostname()}:{os.getpid()}"


@final
class ThisProcess(Workers):
    """Computes every chunk at once when it is submitted."""

    count = 1
    chunk_seconds = 0.2
    apart = False

    def __init__(self, work: Work) -> None:
        self._work = work

    def submit(self, items: tuple[int, ...]) -> "Future[Computed]":
        future: Future[Computed] = Future()
        future.set_result(compute(self._work, items))
        return future

    def close(self) -> None:
        """Nothing to be done."""


@final
class LocalProcesses(Workers):
    """Computes chunks in processes of this machine, which end when this process does, however that is."""

    chunk_seconds = 1.0
    death = (BrokenProcessPool,)

    def __init__(self, work: Work, count: int) -> None:
        if sys.flags.ignore_environment and not sys.flags.safe_path:
            raise InputError(
                f"python -E ignores {SAFE_PATH}, so processes would import from the current folder; give "
                "python -P, too, or --jobs 1"
            )
        for name in _THREADS:
            os.environ.setdefault(name, "1")
        self.count, self._work = count, work
        self._pool = self._started()

    def _started(self) -> ProcessPoolExecutor:
        with safe_path():  # the pool's locks start a process, too, which keeps account of them
            return ProcessPoolExecutor(
                self.count, mp_context=get_context("spawn"), initializer=_begin, initargs=(self._work,)
            )

    def submit(self, items: tuple[int, ...]) -> "Future[Computed]":
        with _uninterrupted(), safe_path():
            if self._pool._broken:
                self.close()
                self._pool = self._started()
            try:
                future = self._pool.submit(_compute_here, items)
            except (BrokenProcessPool, OSError, ValueError):  # the last two of a process that was to start
                if not self._pool._broken:
                    raise
            else:
                if not self._pool._broken:
                    return future
            lost: Future[Computed] = Future()  # a chunk before this one has just killed its process
            lost.set_exception(BrokenProcessPool("a process of the pool has just died"))
            return lost

    def close(self) -> None:
        """End the processes at once; nobody waits any more for what they are computing."""
        with _uninterrupted():
            for process in tuple((self._pool._processes or {}).values()):  # public since Python 3.14
                process.kill()
            self._pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Puts Ctrl-C and SIGTERM off: a pool loses sight of a process that starts then, and waits for ever."""
    if sys.platform == "win32" or threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    signals = (signal.SIGINT, signal.SIGTERM)
    handlers = [signal.signal(one, lambda number, frame: came.append(number)) for one in signals]
    # a terminal's Ctrl-C goes to the new process, too, which cannot ignore it until it has loaded
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for one, handler in zip(signals, handlers, strict=True):
            signal.signal(one, handler)
    if came:
        signal.raise_signal(came[0])


_WORK: list[Any] = []
"""What this worker process computes with."""


def _begin(work: Work) -> None:
    """Prepare a worker: Ctrl-C is its parent's, and it ends when that does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _WORK[:] = [work]
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _compute_here(items: tuple[int, ...]) -> Computed:
    """A chunk in a worker process."""
    return compute(_WORK[0], items)
