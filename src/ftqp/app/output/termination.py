"""SIGTERM, as sent by ``kill``, ``timeout`` and schedulers, ends work as Ctrl-C does: with complete files."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
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


@contextmanager
def no_interrupt_lost() -> Iterator[None]:
    """Raise KeyboardInterrupt at the end where Ctrl-C or SIGTERM came and the body did not end by it.

    Libraries lose it on the way: numpy makes a TypeError of one that comes while it looks at a type.
    """
    came: list[int] = []

    def listening(before: Callable[[int, FrameType | None], Any]) -> Callable[[int, FrameType | None], None]:
        def hear(number: int, frame: FrameType | None) -> None:
            came.append(number)
            before(number, frame)

        return hear

    main = threading.current_thread() is threading.main_thread()
    handlers = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)} if main else {}
    heard = {one: before for one, before in handlers.items() if callable(before)}
    try:
        for one, before in heard.items():
            signal.signal(one, listening(before))
        yield
    except Exception as error:
        if came:
            raise KeyboardInterrupt from error
        raise
    finally:
        for one, before in heard.items():
            signal.signal(one, before)
    if came:
        raise KeyboardInterrupt
