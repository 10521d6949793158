"""SIGTERM, as sent by ``kill``, ``timeout`` and schedulers, ends work as Ctrl-C does: with complete files."""

import signal
import threading
from types import FrameType
from typing import Any, Self, final


@final
class Termination:
    """While entered, SIGTERM raises KeyboardInterrupt, and it is remembered that it was not Ctrl-C.

    A process that was told to ignore SIGTERM, or that handles it already, goes on to do so.

    Attributes:
        received: whether SIGTERM has come.
    """

    def __init__(self) -> None:
        self.received = False
        self._before: Any = None

    def __enter__(self) -> Self:
        free = signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
        if free and threading.current_thread() is threading.main_thread():
            self._before = signal.signal(signal.SIGTERM, self._interrupt)
        return self

    def __exit__(self, *_: object) -> None:
        if self._before is not None:
            signal.signal(signal.SIGTERM, self._before)
            self._before = None

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        self.received = True
        raise KeyboardInterrupt
