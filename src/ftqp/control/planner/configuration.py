"""What a planner was told since it was made, its load and tool among that, in one immutable object."""

import logging
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, final

import numpy as np

from ftqp.control.planner.braking_reserve import BrakingReserve
from ftqp.core.checks import FloatArray
from ftqp.core.pose import pose
from ftqp.faults.belief import Belief
from ftqp.kernel.entry.orders import NO_LOAD, Load, Orders
from ftqp.kernel.entry.session import WORD, ArmSession, Call, Session, bound
from ftqp.kernel.layout.record import load_chain
from ftqp.model.followers import coupled_columns
from ftqp.model.payload import Payload
from ftqp.model.posture import gravity_torques
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")


@final
class MountedRobot:
    """A bare robot and what is mounted on it; it never changes, another one takes its place.

    Args:
        bare: The bare robot; loads and tools are in the frame of its tip.
        payload: The load; None is none.
        place: Pose of the controlled point, (4, 4); None is the robot's own tip.

    Attributes:
        robot: The robot as it is fitted.
        unloaded: The same without the load.
        payload: The load; None is none.
        load: The same as the kernel is told of it.
    """

    __slots__ = ("_bare", "_place", "load", "payload", "robot", "unloaded")

    def __init__(self, bare: Robot, payload: Payload | None = None, place: FloatArray | None = None) -> None:
        self._bare, self._place, self.payload = bare, place, payload
        self.unloaded = bare if place is None else bare.with_tip(place, f"{bare.tip} tool")
        robot = bare if payload is None else bare.with_payload(payload)
        self.robot = robot if place is None else robot.with_tip(place, f"{robot.tip} tool")
        self.load = NO_LOAD if payload is None else Load(payload.mass, payload.com, payload.inertia)

    def carrying(self, payload: Payload | None) -> "MountedRobot":
        """The robot with another load."""
        return MountedRobot(self._bare, payload, self._place)

    def holding(self, T: Any) -> "MountedRobot":
        """The robot with another controlled point, (4, 4) in the frame of the bare robot's tip."""
        return MountedRobot(self._bare, self.payload, None if T is None else pose(T, "T"))


@dataclass(frozen=True, slots=True, eq=False)
class Configuration:
    """All that a planner was told; it never changes, another one takes its place.

    Attributes:
        number: Its own, which the call that writes it into the record leaves beside that.
        belief: Which joints have failed.
        arm: The arm with its load and tool.
        reserve: The deceleration that its motors have; None where torque is not limited.
        start: Where the arm begins, q and v, (nv,) each; None before the first ``reset``.
        speed: How fast the arm is led, in (0, 1] of full speed.
        then: What else the last change brings about, as often as it is called; None is nothing.
    """

    number: int
    belief: Belief
    arm: MountedRobot
    reserve: BrakingReserve | None
    start: tuple[FloatArray, FloatArray] | None = None
    speed: float = 1.0
    then: Callable[[], None] | None = None

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


def write_call(changes: Sequence[tuple[Any, Any]]) -> tuple[Call, Any]:
    """The compiled call that writes arrays into others, and the table that it reads, to be kept till then."""
    table = np.array([(to.ctypes.data, of.ctypes.data, of.nbytes // WORD) for to, of in changes])
    return bound("write_together", table, len(table)), table


def weight_sentence(robot: Robot, q: FloatArray, tau_max: FloatArray) -> str:
    """What is to be said where a motor cannot hold the arm at rest at q; empty where all can."""
    holding = gravity_torques(robot.model, robot.model.createData(), robot.configuration(q))
    tau = np.abs(coupled_columns(robot.chain, holding))
    worst = int(np.argmax(tau / tau_max))
    if not tau[worst] > tau_max[worst]:
        return ""
    return (
        f"{robot.joints[worst]} needs {tau[worst]:.3g} N m to hold the arm at rest here, beyond its limit of "
        f"{tau_max[worst]:.3g} N m, so the arm may sink; choose another posture, or correct the payload, the "
        "masses or robot.with_limits(tau_max=...)"
    )


def warn_of_weight(robot: Robot, q: FloatArray | None, tau_max: FloatArray) -> None:
    """One warning on the logger ``ftqp`` where a motor cannot hold the arm at rest at q, or at neutral."""
    if sentence := weight_sentence(robot, robot.neutral if q is None else q, tau_max):
        _LOG.warning("%s: %s", robot.name, sentence)


def warn_of_rotors(robot: Robot) -> None:
    """One warning on the logger ``ftqp`` where torques go to joints whose rotors the model lacks."""
    without = [joint for joint, rotor in zip(robot.joints, robot.chain.armature, strict=True) if not rotor]
    if without:
        _LOG.warning(
            "%s: no rotor inertia%s is in the model, and behind a gear it can be most of what a joint "
            "accelerates; it is learned while the arm moves, and better known from the start: give it by "
            "robot.with_rotors(...), armature in MJCF, or drake:rotor_inertia and drake:gear_ratio in URDF",
            robot.name,
            f" of {', '.join(without)}" if len(without) < robot.nv else "",
        )
