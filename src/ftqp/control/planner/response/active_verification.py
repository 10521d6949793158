"""Active verification: whether joints that a detector took for held move."""

from typing import Final, final

import numpy as np

from ftqp.kernel.entry.session import Session

SETTLES: Final = 0.3
"""A joint comes to rest within so long, or it never does [s]."""

SPAN: Final = 0.01
"""The way of a held joint is looked at over so long [s] ..."""
SPANS: Final = 3
"""... and it moves if it did in so many in a row ..."""
MOVES: Final = 0.05
"""... by more than this [rad/s or m/s], beside noise."""

SIGMAS: Final = 8.0
"""So many standard deviations are noise, because it exceeds them once in 1e15 samples."""

STIRRED, LATELY = 2e-4, 0.05
"""It stirs where it is so far [rad or m], beside noise, from its mean place of so long [s]."""


@final
class ActiveVerification:
    """Looks for signs that a joint which was found to be held moves.

    A torque arm sends a held joint no torque: one that is not held falls, unless its friction holds it. One
    that moves with MOVES is not held.

    Attributes:
        active: Whether any joint is looked at.

    Source: docs/theory/detection.md, "Active verification".
    """

    def __init__(self, session: Session, joints: int) -> None:
        K = session.K
        self._K, self._dt, self._n = K, float(K.state.dt), joints
        self._seen = K.feedback.seen[:joints]
        self._noise = SIGMAS * float(K.feedback.sigma)
        self.forget()

    def forget(self) -> None:
        """Look at no joint, and know nothing of any."""
        n = self._n
        self._looks: list[int] = []
        self.active = False
        self._age, self._then = np.zeros(n), np.zeros(n)
        self._mean, self._off = np.zeros(n), np.zeros(n)
        self._spans = np.zeros(n, dtype=int)

    def begin(self, i: int) -> None:
        """Look at joint i, which was just found to be held."""
        if i not in self._looks:
            self._looks.append(i)
        self._age[i], self._then[i], self._spans[i] = 0.0, self._seen[i], 0
        self._mean[i], self._off[i] = self._seen[i], 0.0
        self.active = True

    def end(self, i: int) -> None:
        """Look at joint i no more."""
        if i in self._looks:
            self._looks.remove(i)
        self.active = bool(self._looks)

    @property
    def stirs(self) -> bool:
        """Whether a held joint has just moved: if it goes on, what the others do is its doing."""
        return any(self._off[i] > STIRRED + self._noise for i in self._looks)

    def look(self) -> int | None:
        """After a tick: the joint that is not held; None is none."""
        found = None
        for i in self._looks:
            self._age[i] += self._dt
            off = self._seen[i] - self._mean[i]
            self._mean[i] += min(1.0, self._dt / LATELY) * off
            self._off[i] = abs(off)
            if self._moves(i):
                found = i
        return found

    def _moves(self, i: int) -> bool:
        """Whether joint i has moved for some time though it is held."""
        if self._age[i] < SETTLES:
            self._then[i], self._spans[i] = self._seen[i], 0
            return False
        if self._age[i] % SPAN >= self._dt:
            return False
        moved = abs(self._seen[i] - self._then[i]) > MOVES * SPAN + self._noise
        self._spans[i] = self._spans[i] + 1 if moved and not self._K.feedback.asks[i] else 0
        self._then[i] = self._seen[i]
        return bool(self._spans[i] >= SPANS)
