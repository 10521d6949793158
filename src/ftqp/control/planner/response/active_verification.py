"""Active verification: whether joints that a detector took for held move, or follow a small motion."""

from typing import Final, final

import numpy as np

from ftqp.control.planner.response.probing import swing
from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import LOCKED, DriveKind

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

FAR: Final = 1e-3
"""A joint is asked to move so far to either side [rad or m] ..."""
DURATION: Final = 0.3
"""... and back within so long [s]."""
AGREES: Final = 2
"""It follows again when it followed so many motions in a row."""
FOLLOWS: Final = (0.6, 1.4)
"""It followed if it moved by a share of what was asked within these ..."""
LEFT: Final = 0.15
"""... and what that leaves is within noise and this share of FAR: with noise of 1e-4 rad the share is known
to 0.01 (docs/theory/detection.md, "Active verification")."""

PATIENCE: Final = 0.5
"""The first motion is asked for so long after the joint was found [s] ..."""
LONGEST: Final = 60.0
"""... and twice as long after every one that it did not follow, and every new finding, up to this [s]: so
that neither sticking nor a wrong verdict makes the belief flap."""


@final
class ActiveVerification:
    """Looks for signs that a joint which was found to be held moves, or follows its command.

    A held joint that moves with MOVES is not held. Where motions may be made that only serve to tell, the
    joint of an arm with servos is also asked, alone and now and then, for q_held + s(t), |s| <= 1 mrad, there
    and back: the planner counts on it as locked all the while, so that nothing else moves for its sake. The
    samples are fitted by c_0 + c_1 s + c_2 s', in which c_2 takes the servo's lag, and the joint followed if
    c_1 is near 1 and hardly anything is left. A torque arm sends a held joint no torque: one that is not held
    falls, unless its friction holds it.

    Attributes:
        active: Whether any joint is looked at.

    Source: docs/theory/detection.md, "Active verification".
    """

    def __init__(self, session: Session, joints: int, *, asks: bool) -> None:
        K = session.K
        self._K, self._dt, self._n = K, float(K.state.dt), joints
        self._asks = asks and K.feedback.kind != DriveKind.TORQUE
        self._seen, self._code = K.feedback.seen[:joints], K.faults.code[:joints]
        self._noise = SIGMAS * float(K.feedback.sigma)
        self._s = FAR * swing(max(round(DURATION / self._dt), 4))
        self._samples = np.zeros(len(self._s))
        self.forget()

    def forget(self) -> None:
        """Look at no joint, and know nothing of any."""
        n = self._n
        self._looks: list[int] = []
        self.active = False
        self._age, self._then = np.zeros(n), np.zeros(n)
        self._mean, self._off = np.zeros(n), np.zeros(n)
        self._spans, self._agreed = np.zeros(n, dtype=int), np.zeros(n, dtype=int)
        self._wait, self._next = np.full(n, 0.5 * PATIENCE), np.zeros(n)
        self._asked, self._at, self._base = -1, 0, 0.0

    def begin(self, i: int) -> None:
        """Look at joint i, which was just found to be held."""
        if i not in self._looks:
            self._looks.append(i)
        self._age[i], self._then[i], self._spans[i], self._agreed[i] = 0.0, self._seen[i], 0, 0
        self._mean[i], self._off[i] = self._seen[i], 0.0
        self._put_off(i)
        self.active = True

    def end(self, i: int) -> None:
        """Look at joint i no more."""
        if i in self._looks:
            self._looks.remove(i)
        if self._asked == i:
            self._asked = -1
        self.active = bool(self._looks)

    @property
    def stirs(self) -> bool:
        """Whether a held joint has just moved: if it goes on, what the others do is its doing."""
        return any(i != self._asked and self._off[i] > STIRRED + self._noise for i in self._looks)

    def _put_off(self, i: int) -> None:
        """Ask joint i again after twice the time."""
        self._wait[i] = min(2.0 * self._wait[i], LONGEST)
        self._next[i] = self._age[i] + self._wait[i]

    def look(self) -> int | None:
        """After a tick: the joint that is not held, or follows again; None is none.

        What a joint is asked for is put into the command of this tick.
        """
        found = None
        for i in self._looks:
            self._age[i] += self._dt
            off = self._seen[i] - self._mean[i]
            self._mean[i] += min(1.0, self._dt / LATELY) * off
            self._off[i] = abs(off)
            if self._moves(i):
                found = i
            elif self._asked < 0 and self._asks and self._age[i] >= self._next[i] and self._may_ask(i):
                self._asked, self._at, self._base = i, 0, float(self._K.state.q_command[i])
        if found is None and self._asked >= 0 and self._follows():
            found = self._asked
            self._asked = -1
        return found

    def _may_ask(self, i: int) -> bool:
        """Whether joint i rests, no brake was asked for, and the arm is not being stopped."""
        K = self._K
        return bool(self._code[i] == LOCKED and not K.feedback.asks[i] and not K.watch.latched)

    def _moves(self, i: int) -> bool:
        """Whether joint i has moved for some time though it is held, and was not asked to."""
        if self._asked == i or self._age[i] < SETTLES:
            self._then[i], self._spans[i] = self._seen[i], 0
            return False
        if self._age[i] % SPAN >= self._dt:
            return False
        moved = abs(self._seen[i] - self._then[i]) > MOVES * SPAN + self._noise
        self._spans[i] = self._spans[i] + 1 if moved and not self._K.feedback.asks[i] else 0
        self._then[i] = self._seen[i]
        return bool(self._spans[i] >= SPANS)

    def _follows(self) -> bool:
        """Send the joint on and take its sample; at the end, whether it has followed often enough."""
        K, i, k = self._K, self._asked, self._at
        if not self._may_ask(i):
            self._asked = -1
            return False
        if k < len(self._s):
            before = self._s[k - 1] if k else 0.0
            K.feedback.v_sent[i] = (self._s[k] - before) / self._dt
            if K.feedback.kind == DriveKind.POSITION:
                K.feedback.q_sent[i] = self._base + self._s[k]
            self._samples[k] = self._seen[i]
            self._at += 1
            return False
        if not self._has_followed():
            self._agreed[i] = 0
            self._put_off(i)
            self._asked = -1
            return False
        self._agreed[i] += 1
        self._at = 0
        if self._agreed[i] < AGREES:
            return False
        self._agreed[i] = 0
        return True

    def _has_followed(self) -> bool:
        """Whether the samples are those of a joint that followed: c_0 + c_1 s + c_2 s'."""
        s = self._s
        columns = np.stack([np.ones(len(s)), s, np.gradient(s)], axis=1)
        c, _, _, _ = np.linalg.lstsq(columns, self._samples, rcond=None)
        left: FloatArray = self._samples - columns @ c
        low, high = FOLLOWS
        spread = float(np.sqrt(np.mean(left * left)))
        return low <= float(c[1]) <= high and spread <= LEFT * FAR + 1.5 * float(self._K.feedback.sigma)
