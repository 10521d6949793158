"""Work in a process apart with a time limit: whoever hangs or dies takes nobody along."""

import multiprocessing
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

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
    """A process that does one piece of work after the other; a new one takes the place of one that gave none.

    Args:
        seconds: How long a piece of work may take, the start of the process included [s].
    """

    def __init__(self, seconds: float = LIMIT) -> None:
        self._seconds = seconds
        self._pool: Any = None

    def ask(self, work: Callable[..., Any], *arguments: Any) -> Ended:
        """Call ``work``, a function of a module, in the process; this one always goes on."""
        if self._pool is None:
            self._pool = multiprocessing.get_context("spawn").Pool(1)
        try:
            return Ended(answer=self._pool.apply_async(work, arguments).get(self._seconds))
        except multiprocessing.TimeoutError:
            self.close()
            return Ended(reason=f"gave no answer within {self._seconds:g} s; it hangs, or its process died")
        except Exception as error:  # a foreign solver may raise anything, or answer what cannot be sent
            return Ended(reason=f"{type(error).__name__}: {(str(error).splitlines() or [''])[0]:.200}")

    def close(self) -> None:
        """End the process, whatever it does."""
        if self._pool is not None:
            self._pool.terminate()
            self._pool = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: Any, trace: TracebackType | None) -> None:
        self.close()
