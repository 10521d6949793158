"""Who computes the chunks of a study: this process, processes of this machine, or a Dask cluster."""

import os
import signal
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from typing import Any, final

from ftqp.app.study.chunk import Done, Work, compute
from ftqp.core.errors import InputError

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Every worker has a core of its own, so numerical libraries start no threads."""
_SAFE_PATH = "PYTHONSAFEPATH"
"""Python then imports nothing from the current folder, where a stranger's files may lie: workers are started
as ``python -c``, which would."""


class Workers(ABC):
    """Computes chunks.

    Attributes:
        count: How many chunks are computed at a time.
        chunk_seconds: How long a chunk should take, so that what it costs to send it vanishes [s].
        share_fate: Whether a worker that dies takes all chunks under way with it.
        apart: Whether this process lives on when a worker dies.
    """

    count: int
    chunk_seconds: float
    share_fate = False
    apart = True

    @abstractmethod
    def submit(self, items: Sequence[int]) -> "Future[Done]":
        """Begin a chunk."""

    @abstractmethod
    def died(self, error: BaseException) -> bool:
        """Whether an error says that the worker of a chunk died, rather than what the chunk raised."""

    @abstractmethod
    def renew(self) -> None:
        """Be ready for more chunks after a worker died."""

    @abstractmethod
    def close(self) -> None:
        """End, without waiting for chunks that have not ended."""


@final
class ThisProcess(Workers):
    """Computes every chunk at once when it is submitted."""

    count = 1
    chunk_seconds = 0.2
    apart = False

    def __init__(self, work: Work) -> None:
        self._work = work

    def submit(self, items: Sequence[int]) -> "Future[Done]":
        """Compute a chunk."""
        future: Future[Done] = Future()
        future.set_result(compute(self._work, items))
        return future

    def died(self, error: BaseException) -> bool:
        """No: this process is the worker."""
        return False

    def renew(self) -> None:
        """Nothing to be done."""

    def close(self) -> None:
        """Nothing to be done."""


@final
class LocalProcesses(Workers):
    """Computes chunks in processes of this machine, which end when this process does, however that is.

    Args:
        work: What computes the rows.
        count: How many processes.

    Raises:
        InputError: Python was told to ignore the variable that keeps the current folder out of workers.
    """

    chunk_seconds = 1.0
    share_fate = True

    def __init__(self, work: Work, count: int) -> None:
        self.count = count
        self._work = work
        self._pool = self._started()

    def _started(self) -> ProcessPoolExecutor:
        for name in _THREADS:
            os.environ.setdefault(name, "1")
        if sys.flags.ignore_environment and not sys.flags.safe_path:
            raise InputError(
                f"python -E ignores {_SAFE_PATH}, so processes would import from the current folder; give "
                "python -P, too, or --jobs 1"
            )
        with _safe_path():  # the pool's locks start a process, too, which keeps account of them
            return ProcessPoolExecutor(
                self.count, mp_context=get_context("spawn"), initializer=_begin, initargs=(self._work,)
            )

    def submit(self, items: Sequence[int]) -> "Future[Done]":
        """Begin a chunk; this starts a process where one is missing."""
        with _uninterrupted(), _safe_path():
            try:
                future = self._pool.submit(_compute_here, tuple(items))
            except (BrokenProcessPool, OSError, ValueError):  # the last two of a process that was to start
                if not self._pool._broken:
                    raise
            else:
                if not self._pool._broken:
                    return future
            lost: Future[Done] = Future()  # a chunk before this one has just killed its process
            lost.set_exception(BrokenProcessPool("a process of the pool has just died"))
            return lost

    def died(self, error: BaseException) -> bool:
        """Whether a process was killed."""
        return isinstance(error, BrokenProcessPool)

    def renew(self) -> None:
        """Start new processes in place of a pool with a dead one."""
        self.close()
        self._pool = self._started()

    def close(self) -> None:
        """End the processes at once; nobody waits any more for what they are computing."""
        with _uninterrupted():
            for process in tuple((self._pool._processes or {}).values()):  # public since Python 3.14
                process.kill()
            self._pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Puts Ctrl-C and SIGTERM off.

    A pool loses sight of a process that starts, or of its own thread that ends, and would wait for ever.
    """
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


@contextmanager
def _safe_path() -> Iterator[None]:
    """Lets Python processes that start meanwhile keep the current folder out, and no others."""
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ[_SAFE_PATH]
        else:
            os.environ[_SAFE_PATH] = before


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


def _compute_here(items: tuple[int, ...]) -> Done:
    """A chunk in a worker process."""
    return compute(_WORK[0], items)
