"""Work in a process apart with a time limit: whoever hangs, dies or answers nonsense takes nobody along."""

import multiprocessing
import signal
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from time import monotonic
from types import TracebackType
from typing import Any, Self

from ftqp import FtqpError

HUNG = "gave no answer within {:g} s and was ended"
TICK = 0.2
"""How often the limit is looked at [s]."""
PATIENCE = 10.0
"""How long a process that has closed its pipe may take to end [s]."""
LIMIT = 300.0
"""How long a contender may take for one piece of work, unless told otherwise [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """How work in a process apart has ended.

    Attributes:
        answer: What it returned; None if it did not.
        reason: Why not, in words; empty if it did.
    """

    answer: Any = None
    reason: str = ""


class Apart:
    """A process that does one piece of work after the other; a new one takes the place of one that died.

    Args:
        seconds: How long a piece of work may take, the start of the process included [s].
    """

    def __init__(self, seconds: float = LIMIT) -> None:
        self._seconds = seconds
        self._process: Any = None
        self._pipe: Any = None

    def ask(self, work: Callable[..., Any], *arguments: Any) -> Ended:
        """Call ``work`` in the process; whatever happens to that, this one goes on.

        Args:
            work: A function of a module; it, its arguments and its answer are pickled. What it keeps in its
                module is there at the next call, unless the process has died meanwhile.
            arguments: Its arguments.
        """
        until = monotonic() + self._seconds
        if self._process is None:
            self._start()
        try:
            self._pipe.send((work, arguments))
        except OSError:
            return Ended(reason=self._end())
        while not self._pipe.poll(TICK):
            if monotonic() > until:
                self.close()
                return Ended(reason=HUNG.format(self._seconds))
        try:
            reason, answer = self._pipe.recv()
        except (EOFError, OSError):
            return Ended(reason=self._end())
        except Exception as error:  # what a foreign solver has sent cannot be read here
            self.close()
            return Ended(reason=f"sent what cannot be read ({_words(error)})")
        return Ended(answer=answer, reason=reason)

    def close(self) -> None:
        """End the process, whatever it does."""
        if self._process is not None:
            self._process.kill()
            self._end()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: Any, trace: TracebackType | None) -> None:
        self.close()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, its = context.Pipe()
        self._process = context.Process(target=_serve, args=(its,), daemon=True)
        self._process.start()
        its.close()  # so that the end of the process is the end of the pipe

    def _end(self) -> str:
        """Wait for a process that ends, and say in words how it did."""
        process, self._process = self._process, None
        self._pipe.close()
        process.join(PATIENCE)
        words = _death(process.exitcode)
        process.kill()
        process.join()
        return words


def _serve(its: Connection) -> None:
    """The side of the process apart; Ctrl-C is its parent's."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            work, arguments = its.recv()
        except EOFError:
            return
        except Exception as error:  # the work cannot be found here
            its.send((_words(error), None))
            continue
        try:
            said = ("", work(*arguments))
        except BaseException as error:  # a foreign solver may raise anything, SystemExit included
            said = (_words(error), None)
        try:
            its.send(said)
        except Exception as error:  # not to be pickled
            its.send((f"returned what cannot be sent ({_words(error)})", None))


def _death(code: int | None) -> str:
    if code is not None and code < 0:
        return f"its process died of {signal.Signals(-code).name}"
    return f"its process ended without an answer, exit code {code}"


def _words(error: BaseException) -> str:
    if isinstance(error, FtqpError):
        return str(error)
    text = str(error).splitlines()
    return f"{type(error).__name__}: {text[0]:.200}" if text else type(error).__name__
