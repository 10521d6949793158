"""SIGTERM, as sent by ``kill``, ``timeout`` and schedulers, ends work as Ctrl-C does: with complete files."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, Final, Self, final

INTERRUPTED: Final = 130
"""What a process returns that Ctrl-C has ended."""


def end_on_interrupt() -> None:
    """Let Ctrl-C end the process at once, except while a command is at work, which hears it by itself.

    Else it would be an exception wherever it comes: in the midst of imports, or of what ends a process. A
    process that was told to ignore Ctrl-C, or that handles it already, goes on to do so.
    """
    main = threading.current_thread() is threading.main_thread()
    if main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)


def _end(number: int, frame: FrameType | None) -> None:
    with suppress(OSError):
        os.write(2, b"interrupted\n")
    os._exit(INTERRUPTED)


@final
class Termination:
    """While entered, SIGTERM raises KeyboardInterrupt, and it is remembered that it was not Ctrl-C.

    A process that was told to ignore SIGTERM, or that handles it already, goes on to do so. Ctrl-C raises
    KeyboardInterrupt meanwhile where it would end the process at once.

    Attributes:
        received: whether SIGTERM has come.
    """

    def __init__(self) -> None:
        self.received = False
        self._before: Any = None
        self._heard = False

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
                self._before = signal.signal(signal.SIGTERM, self._interrupt)
            self._heard = signal.getsignal(signal.SIGINT) is _end
            if self._heard:
                signal.signal(signal.SIGINT, signal.default_int_handler)
        return self

    def over(self) -> None:
        """Have nothing more to interrupt: from now on Ctrl-C ends the process at once again."""
        if self._heard:
            signal.signal(signal.SIGINT, _end)
            self._heard = False

    def __exit__(self, *_: object) -> None:
        self.over()
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
