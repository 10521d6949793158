"""The way that an arm has come, kept for the case that it has to go back."""

from typing import Any, Final, final

import numpy as np

from ftqp.control.planner.stages import CLOCK, FREE, LED, Stage
from ftqp.core.checks import FloatArray, positive
from ftqp.kernel.entry.session import Session

ROWS: Final = 1024
"""Places that are kept, of however long a time."""
APART: Final = 1e-3
"""A place nearer than this to the last one in every joint is not kept [rad or m]: the arm stands. A
convention."""


@final
class Remembered:
    """Keeps where the joints were commanded to be, now and then, in memory of its own."""

    def __init__(self, session: Session, joints: int, seconds: float, dt: float) -> None:
        self._q = session.field("state", "q_command")[:joints]
        self._rows = np.zeros((ROWS, joints))
        self._stride = max(1, round(positive("remember", seconds, "s") / (ROWS * dt)))
        self._count = self._ticks = 0

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(ticks=(CLOCK, FREE, *LED), after=self.see, begin=lambda *_: self.begin())

    def begin(self) -> None:
        """Forget the way, and keep where the arm is now."""
        self._count = self._ticks = 0
        self._keep()

    def see(self, code: int, _inputs: tuple[Any, ...] = ()) -> None:
        """Keep the place of a tick when it is time."""
        self._ticks += 1
        if code >= 0 and self._ticks % self._stride == 0:
            last = self._rows[(self._count - 1) % ROWS]
            if np.abs(self._q - last).max() > APART:
                self._keep()

    def _keep(self) -> None:
        self._rows[self._count % ROWS] = self._q
        self._count += 1

    @property
    def q(self) -> FloatArray:
        """The places in the order of time, (k, nv) [rad or m]; a copy."""
        first = max(0, self._count - ROWS)
        return self._rows[np.arange(first, self._count) % ROWS].copy()
