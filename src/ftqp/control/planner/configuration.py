"""All that a planner was told, and how a change of it is worked out first and then written by one call."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cache
from itertools import count
from typing import Any, ClassVar, final

import numpy as np

from ftqp.control.planner.mounted_robot import BrakingReserve, MountedRobot, braking_reserve, warn_of_weight
from ftqp.core.checks import FloatArray
from ftqp.faults.belief import Belief
from ftqp.kernel.entry.orders import Orders
from ftqp.kernel.entry.session import WORD, ArmSession, Call, Session, bound
from ftqp.kernel.layout.record import load_chain
from ftqp.model.payload import Payload
from ftqp.model.robot import Robot

NUMBERS = count()
"""Of configurations: none occurs twice, so that a number says which one it is."""
WORK = ("kinematics", "scratch", "past", "history", "ahead", "supposed")
"""Rooms that only ticks use; ..."""
MATRICES_IN, LARGE = ("qp", "calm", "scene"), 10_000
"""... of these rooms the fields of more than so many bytes: matrices, and the shapes of bodies."""


@dataclass(frozen=True, slots=True, eq=False)
class Configuration:
    """All that a planner was told; it never changes, another one takes its place."""

    number: int  # Its own, which the call that writes it into the record leaves beside that
    belief: Belief  # Which joints have failed
    arm: MountedRobot  # The arm with its load and tool
    reserve: BrakingReserve | None  # The deceleration that its motors have; None where torque is not limited
    # Where the arm begins, q and v, (nv,) each; None before the first ``reset``
    start: tuple[FloatArray, FloatArray] | None = None
    speed: float = 1.0  # How fast the arm is led, in (0, 1] of full speed
    # What else the last change brings about, as often as it is called; None is nothing
    then: Callable[[], None] | None = None

    @classmethod
    def first(cls, robot: Robot, limits_torque: bool) -> "Configuration":
        """That of a new planner: healthy and unloaded."""
        reserve = braking_reserve(robot) if limits_torque else None
        return cls(next(NUMBERS), Belief(robot), MountedRobot(robot), reserve)

    def carrying(self, payload: Payload | None, limits_torque: bool) -> "Configuration":
        """The same with another load."""
        arm = self.arm.carrying(payload)
        load = None if payload is None else arm.load
        return replace(self, arm=arm, reserve=braking_reserve(arm.unloaded, load) if limits_torque else None)

    def warn_of_weight(self, K: Any) -> None:
        """One warning where a motor cannot hold the arm where it is, or at neutral before a reset."""
        n = self.arm.robot.nv
        q = K.state.q_command[:n] if K.state.is_reset else None
        warn_of_weight(self.arm.robot, q, K.limits.tau_max[:n])

    def tell(self, K: Any, orders: Orders, before: "Configuration | None") -> None:
        """Write what differs from the configuration before into a record, ``speed`` aside."""
        if before is not None and before.arm is not self.arm:
            if before.arm.payload is not self.arm.payload:
                K.learned.load[:] = 0.0  # it is what is told now
            load_chain(K, **self.arm.unloaded.chain.constants())
            orders.carry(self.arm.load)
        believes = before is None or before.belief is not self.belief
        if believes:
            self.belief.write(orders, None if before is None else before.belief)
            orders.believed()
        if before is None or believes or before.reserve is not self.reserve:
            orders.count_on(None if self.reserve is None else self.reserve.samples)
        if self.start is not None and (before is None or before.start is not self.start):
            orders.start(*self.start)

    def tells_as(self, before: "Configuration") -> bool:
        """Whether nothing but ``speed`` differs of what a record is told."""
        parts = ("belief", "arm", "reserve", "start")
        return all(getattr(self, part) is getattr(before, part) for part in parts)

    def weakened(self, before: "Configuration") -> list[int]:
        """Joints that are now said to have less torque, of an arm whose weight is known."""
        robot, was = self.arm.robot, before.belief.faults
        return [
            robot.joint(joint)
            for joint, fault in self.belief.faults.items()
            if robot.has_inertia
            and was.get(joint) != fault
            and "tau_max" in fault.shares
            and getattr(fault, fault.shares["tau_max"]) < 1.0
        ]


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
