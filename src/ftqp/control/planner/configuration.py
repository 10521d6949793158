"""Configuration: all that a planner was given, and how one compiled call puts another one in its place."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import count
from typing import Any, ClassVar, final

import numpy as np

from ftqp.control.planner.assembly import Assembly
from ftqp.control.planner.mounted_robot import MountedRobot, braking_reserve, warn_of_weight
from ftqp.control.planner.stages import Tick
from ftqp.core.checks import FloatArray, array, frozen, positive
from ftqp.core.errors import InputError
from ftqp.faults.belief import Belief, weakens
from ftqp.faults.kinds import Fault, FreeSwinging, Locked
from ftqp.kernel.entry.planner_commands import PlannerCommands, ReserveSamples
from ftqp.kernel.entry.session import WORD, ArmSession, Session, bound_write
from ftqp.model.payload import Payload

NUMBERS = count()
"""Of configurations: none occurs twice, so that a number says which one it is."""
WORK = ("kinematics", "scratch", "past", "history", "ahead", "supposed")
"""Rooms that only ticks use; ..."""
MATRICES_IN, LARGE = ("qp", "settling", "scene"), 10_000
"""... of these rooms the fields of more than so many bytes: matrices, and the shapes of bodies."""


@dataclass(frozen=True, slots=True, eq=False)
class Configuration:
    """All that a planner was given; it never changes, another one takes its place."""

    number: int  # Its own, which the call that writes it into the record leaves beside that
    belief: Belief  # Which joints have failed
    arm: MountedRobot  # The arm with its load and tool
    reserve: ReserveSamples | None  # The deceleration that its motors have; None where torque is not limited
    # Where the arm begins, q and v, (nv,) each; None before the first ``reset``
    start: tuple[FloatArray, FloatArray] | None = None
    speed: float = 1.0  # How fast the arm is led, in (0, 1] of full speed
    # What else the last change brings about, as often as it is called; None is nothing
    then: Callable[[], None] | None = None

    def tell(self, K: Any, commands: PlannerCommands, before: "Configuration | None") -> None:
        """Write what differs from the configuration before into a record, ``speed`` aside."""
        if before is not None and before.arm is not self.arm:
            if before.arm.place is not self.arm.place:
                commands.hold(np.eye(4) if self.arm.place is None else self.arm.place)
            else:
                commands.carry(self.arm.load)
        believes = before is None or before.belief is not self.belief
        if believes:
            self.belief.write(commands, None if before is None else before.belief)
            commands.believed()
        if before is None or believes or before.reserve is not self.reserve:
            commands.count_on(self.reserve)
        if self.start is not None and (before is None or before.start is not self.start):
            commands.start(*self.start)

    def tells_as(self, before: "Configuration") -> bool:
        """Whether nothing but ``speed`` differs of what a record is given."""
        parts = ("belief", "arm", "reserve", "start")
        return all(getattr(self, part) is getattr(before, part) for part in parts)

    def weakened(self, before: "Configuration") -> list[int]:
        """Joints that are now said to have less torque."""
        robot, was = self.arm.robot, before.belief.faults
        now = self.belief.faults.items()
        return [robot.joint(name) for name, one in now if was.get(name) != one and weakens(robot, one)]


@cache
def command_parts(record: Any) -> tuple[slice, ...]:
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
    """

    free: ClassVar[dict[int, list["Draft"]]] = {}

    def __init__(self, arm: ArmSession) -> None:
        session, lone = Session(len(arm.joints)), copy(arm)
        self.K, self.commands = session.K, PlannerCommands(session, lone, {})
        self._mine = session.memory, lone.memory, self.commands.memory
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
        self.free[len(self.commands.expected)].append(self)

    def begin(self, session: Session, arm: ArmSession, commands: PlannerCommands) -> None:
        """Take what a kernel knows now."""
        self._words = []
        for theirs, mine in zip((session.memory, arm.memory, commands.memory), self._mine, strict=True):
            to, now = theirs.view(np.int64), mine.view(np.int64)
            for part in command_parts(theirs.dtype) if theirs is session.memory else (slice(None),):
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


@final
class CurrentConfiguration:
    """The configuration that a planner's record was written with, and what puts another in its place."""

    def __init__(self, parts: Assembly, lead: Callable[[Tick | None], None]) -> None:
        self._parts, self._lead, robot = parts, lead, parts.given.robot
        reserve = braking_reserve(robot) if parts.given.limits_torque else None
        given = Configuration(next(NUMBERS), Belief(robot), MountedRobot(robot), reserve)
        self._number, self._known = np.array([given.number]), {given.number: given}
        self._applied: Configuration | None = None
        given.tell(parts.session.K, parts.commands, None)
        self.apply()

    @property
    def now(self) -> Configuration:
        """What the planner was given last, by the number that its record was written with."""
        return self._known[int(self._number[0])]

    def start(self, q: Any, v: Any) -> None:
        """Begin at joint positions and velocities, (nv,) each."""
        robot = self.now.arm.robot
        q = frozen(robot.angles(q))
        v = frozen(np.zeros(robot.nv) if v is None else array("v", v, (robot.nv,), "(nv,)"))
        self._change(lambda given: replace(given, start=(q, v)))

    def report(self, fault: Fault) -> None:
        """Believe a fault that the user reports: what becomes of it is the user's."""
        response = self._parts.response
        self.believe(fault, response and partial(response.reported, fault))

    def withdraw(self, joint: str | int) -> None:
        """Believe the user that a joint is healthy, and look at it again."""
        response = self._parts.response
        self.disbelieve(joint, response and partial(response.forget, joint))

    def believe(self, fault: Fault, then: Callable[[], None] | None = None) -> None:
        """Believe one fault more."""
        self._change(lambda given: replace(given, belief=given.belief.reported(fault)), then)

    def disbelieve(self, joint: str | int, then: Callable[[], None] | None = None) -> None:
        """Believe that a joint is healthy."""
        self._change(lambda given: replace(given, belief=given.belief.without(joint)), then)

    def brake(self, joint: str | int) -> None:
        """Let the brake of a joint that swings freely be closed, and believe that it stands."""
        robot = self.now.arm.robot
        i = robot.joint(joint)
        name = robot.joints[i]
        if not isinstance(self.now.belief.faults.get(name), FreeSwinging):
            raise InputError(
                f"{name} is not believed to swing freely, so that no brake of it is asked for; report it as "
                "ftqp.Locked if it stands"
            )
        self._parts.commands.ask_for_brake(i)
        self.report(Locked(name, mode="instant"))

    def carry(self, payload: Payload | None) -> None:
        """Count on another load; one that motors cannot hold gets a warning."""
        limited = self._parts.given.limits_torque

        def loaded(given: Configuration) -> Configuration:
            arm = given.arm.carrying(payload)
            load = None if payload is None else arm.load
            reserve = braking_reserve(arm.bare, load) if limited else None
            return replace(given, arm=arm, reserve=reserve)

        self._change(loaded)
        if payload is not None:
            K, robot = self._parts.session.K, self.now.arm.robot
            q = K.state.q_command[: robot.nv] if K.state.is_reset else None
            warn_of_weight(robot, q, K.limits.tau_max[: robot.nv])

    def hold(self, T: Any) -> None:
        """Control another point, (4, 4) in the frame of the robot's own tip."""
        if self._parts.leading is not None:
            raise InputError(
                "the planner follows a plan of another end effector; plan for robot.with_tip(T) instead"
            )
        self._change(lambda given: replace(given, arm=given.arm.holding(T)))

    def lead_at(self, share: float) -> None:
        """Lead the arm at another share of full speed."""
        if not 0.0 < positive("speed", share) <= 1.0:
            raise InputError(f"speed is {share:g}, expected a share of full speed in (0, 1]")
        self._change(lambda given: replace(given, speed=float(share)))

    def _change(
        self, change: Callable[[Configuration], Configuration], then: Callable[[], None] | None = None
    ) -> None:
        """Tell the planner something else: all is worked out first, then one compiled call writes it."""
        written = False
        while not written:
            self.apply()
            before = self.now
            after = replace(change(before), number=next(NUMBERS), then=then)
            draft = Draft.taken(self._parts.arm)
            changes = self._worked_out(before, after, draft)
            write = bound_write(changes)
            self._known[after.number] = after
            self._lead(None)  # until its parts have followed, steps look at its configuration
            # as one expression: no signal handler comes between the look and the call
            written = self._number[0] == before.number and write() == 0
            draft.give_back()
            self._known.pop((before if written else after).number, None)
        self.apply()

    def _worked_out(self, before: Configuration, after: Configuration, draft: Draft) -> list[tuple[Any, Any]]:
        """What makes the record that of another configuration, its number included."""
        parts, changes = self._parts, [(self._number, np.array([after.number]))]
        if not after.tells_as(before):
            if before.arm is not after.arm:
                parts.out.fill_in()  # steps that are kept stay with the arm that they had
            draft.begin(parts.session, parts.arm, parts.commands)
            after.tell(draft.K, draft.commands, before)
            if draft.K.state.is_reset:
                for i in after.weakened(before):
                    parts.loop.find_overload(i, draft.K, draft.commands)
            changes += draft.changes
        if after.speed != before.speed:
            changes.append((parts.session.field("feedback", "speed"), np.array([after.speed])))
        return changes

    def apply(self) -> None:
        """Let the planner's parts follow its configuration where they have not; begun, it begins again."""
        while self._applied is not self.now:
            before, given = self._applied, self.now
            if before is not None and before.arm is not given.arm:
                for stage in self._parts.stages:
                    if stage.mount is not None:
                        stage.mount(given.arm.robot)
            if before is None or before.belief is not given.belief:
                self._parts.believe(given.belief)
            if given.start is not None and (before is None or before.start is not given.start):
                for stage in self._parts.stages:
                    if stage.begin is not None:
                        stage.begin(given.start[0], given.arm.robot, given.belief)
            if given.then is not None:
                given.then()
            self._applied = given
        self._lead(self._parts.fast)
