"""The parts that the work of a plan falls into: who computes them, and who keeps what is done."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final, Protocol, final

Portion = Callable[[Sequence[int]], list[tuple[Any, ...]]]
"""Computes some items of a stage, a text in a row each; it can be pickled, and a text depends on its item."""
ROUNDS: Final = 20
"""Without anybody who shares the work, a stage is computed in about so many parts, to tell of progress."""


class Portions(Protocol):
    """Who computes the parts of a plan; the plan is the same whoever does."""

    @property
    def keeps(self) -> bool:
        """Whether what is done is kept, so that an interrupted plan is given up and not ended in a hurry."""

    @property
    def threads(self) -> int | None:
        """How many threads compute one part; None is one a core."""

    def each(self, stage: str, work: Portion, count: int) -> Iterator[str]:
        """The texts of all items of a stage, in order; items do not depend on each other."""

    def one(self, stage: str, item: int, work: Callable[[], str]) -> str:
        """The text of one item of a stage whose items come one after the other."""


@final
class Here:
    """Computes everything in this process, and keeps nothing."""

    def __init__(self, threads: int | None = None) -> None:
        self.keeps, self.threads = False, threads

    def each(self, stage: str, work: Portion, count: int) -> Iterator[str]:
        """The texts of all items of a stage, in order."""
        size = max(1, count // ROUNDS)
        for first in range(0, count, size):
            for row in work(range(first, min(first + size, count))):
                yield str(row[0])

    def one(self, stage: str, item: int, work: Callable[[], str]) -> str:
        """The text of one item."""
        return work()
