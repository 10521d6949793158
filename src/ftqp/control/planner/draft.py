"""Draft: a copy of what a kernel knows, on which a change is worked out, and which one call then writes."""

from collections.abc import Sequence
from copy import copy
from functools import cache
from typing import Any, ClassVar, final

import numpy as np

from ftqp.kernel.entry.orders import Orders
from ftqp.kernel.entry.session import WORD, ArmSession, Call, Session, bound

WORK = ("kinematics", "scratch", "past", "history", "ahead", "supposed")
"""Rooms that only ticks use; ..."""
MATRICES_IN, LARGE = ("qp", "calm", "scene"), 10_000
"""... of these rooms the fields of more than so many bytes: matrices, and the shapes of bodies."""


@cache
def told_parts(record: Any) -> tuple[slice, ...]:
    """Where a record of that dtype has what orders read or write, in words."""
    parts = []
    for room, (fields, begin, *_) in record.fields.items():
        end = begin + fields.itemsize
        if room in WORK:
            continue
        for field, at, *_ in sorted(fields.fields.values(), key=lambda field: field[1]):
            if room in MATRICES_IN and field.itemsize > LARGE:
                parts.append(slice(begin // WORD, (record.fields[room][1] + at) // WORD))
                begin = record.fields[room][1] + at + field.itemsize
        parts.append(slice(begin // WORD, end // WORD))
    return tuple(part for part in parts if part.stop > part.start)


@final
class Draft:
    """A copy of what a kernel knows, on which a change is worked out, and which one call then writes.

    Words that the change leaves alone stay as they are, whoever has written them meanwhile. Planners of as
    many joints have one in common, which is taken for as long as a change lasts.

    Attributes:
        K: The rooms of the copy.
        orders: The orders on the copy.
    """

    free: ClassVar[dict[int, list["Draft"]]] = {}

    def __init__(self, arm: ArmSession) -> None:
        session, lone = Session(len(arm.joints)), copy(arm)
        self.K, self.orders = session.K, Orders(session, lone, {})
        self._mine = session.memory, lone.memory, self.orders.memory
        self._words: list[tuple[Any, Any, Any]] = []

    @classmethod
    def taken(cls, arm: ArmSession) -> "Draft":
        """One that nobody has, for a planner of that arm; ``give_back`` it."""
        free = cls.free.setdefault(len(arm.joints), [])
        try:
            return free.pop()
        except IndexError:  # a signal handler, or another thread, has it
            return cls(arm)

    def give_back(self) -> None:
        """Let others have it."""
        self._words = []
        self.free[len(self.orders.expected)].append(self)

    def begin(self, session: Session, arm: ArmSession, orders: Orders) -> None:
        """Take what a kernel knows now."""
        self._words = []
        for theirs, mine in zip((session.memory, arm.memory, orders.memory), self._mine, strict=True):
            to, now = theirs.view(np.int64), mine.view(np.int64)
            for part in told_parts(theirs.dtype) if theirs is session.memory else (slice(None),):
                now[part] = before = to[part].copy()
                self._words.append((to[part], now[part], before))

    @property
    def changes(self) -> list[tuple[Any, Any]]:
        """What is to be written, and what with: runs of words."""
        found = []
        for to, now, before in self._words:
            at = (now != before).nonzero()[0]
            if len(at):
                runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
                found += [(to[run[0] : run[-1] + 1], now[run[0] : run[-1] + 1]) for run in runs]
        return found


def write_call(changes: Sequence[tuple[Any, Any]]) -> Call:
    """The compiled call that writes arrays into others; the arrays are to be kept till then."""
    table = np.array([(to.ctypes.data, of.ctypes.data, of.nbytes // WORD) for to, of in changes])
    return bound("write_together", table, len(table))
