"""The three ways in which a step is called, and the loop that times them.

``best`` hands recurring arrays over and takes targets that were made ahead. ``readme`` hands over fresh
arrays and rewrites one target every tick, as a loop after the README's does. ``paced`` is ``readme`` once a
millisecond, the process asleep between ticks: by then caches are cold, as in the loops that arms run on.

Needs the standard library only, as programs without ftqp are timed by it, too.
"""

from collections.abc import Callable, Iterable
from time import perf_counter, perf_counter_ns, sleep

WAYS = ("best", "readme", "paced")
PERIOD = 1e-3
"""From one paced tick to the next [s]."""


class Metronome:
    """Ticks at fixed times; one that is missed is left out, so that the process sleeps before every tick.

    Args:
        period: From tick to tick [s].
        now: The clock [s].
        wait: Sleeps for so many seconds.
    """

    def __init__(
        self,
        period: float,
        now: Callable[[], float] = perf_counter,
        wait: Callable[[float], None] = sleep,
    ) -> None:
        self._period, self._now, self._wait = period, now, wait
        self._due = now()

    def __call__(self) -> None:
        """Sleep until the next tick."""
        now = self._now()
        missed = int(max(0.0, now - self._due) / self._period)
        self._due += (1 + missed) * self._period
        self._wait(self._due - now)


def nothing() -> None:
    """What happens between two steps of a program that keeps its own state."""


def took(
    way: str, step: Callable[[int], None], between: Callable[[], None], ticks: Iterable[int]
) -> list[int]:
    """Time that each step took [ns]."""
    wait = Metronome(PERIOD) if way == "paced" else nothing
    ns = []
    for k in ticks:
        wait()
        before = perf_counter_ns()
        step(k)
        after = perf_counter_ns()
        ns.append(after - before)
        between()
    return ns
