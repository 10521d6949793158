"""Session: a simulation that is stepped by a caller, never ends, and takes commands between two ticks."""

from dataclasses import replace
from math import floor, isfinite
from queue import Empty, SimpleQueue
from typing import Literal, final

import numpy as np

from ftqp.core.errors import FtqpError, InputError
from ftqp.faults.kinds import Degraded, Fault, kind_of
from ftqp.sim.schedule import FaultEvent, Schedule
from ftqp.sim.session.frame import Frame
from ftqp.sim.session.session_arms import ArmsOf, Choice, RivalArm, SessionArms
from ftqp.sim.session.session_commands import (
    TELLS,
    WEAK,
    Aim,
    Break,
    Command,
    LookForWays,
    Pause,
    Place,
    Play,
    Repair,
    Reset,
    Seek,
    Speed,
    TakeWay,
    Tell,
    Use,
)
from ftqp.sim.session.watched_arm import WatchedArm

FASTEST = 100.0
"""Simulated seconds in a second that may be asked for at most."""
ROUNDING = 1e-6
"""Share of a tick by which time may be short of it."""


@final
class Session:
    """An arm on its path without end, stepped by one thread; it raises nothing, and says it in the frame."""

    def __init__(self, arms_of: ArmsOf, choice: Choice) -> None:
        self._arms_of, self.choice = arms_of, choice
        self._orders: SimpleQueue[Command] = SimpleQueue()
        self.paused, self.speed, self.pace = False, 1.0, 1.0
        self.stage = 0
        self._message = ""
        self._left = 0.0
        self._show(arms_of(choice))
        self._begin()

    def put(self, command: Command) -> None:
        """Ask for something; it is done between two ticks. Any thread may call this."""
        self._orders.put(command)

    @property
    def frame(self) -> Frame:
        """The picture of the last tick."""
        return replace(
            self._frame,
            stage=self.stage,
            paused=self.paused,
            speed=self.speed,
            pace=self.pace,
            message=self._message or self._arm.sentence,
        )

    @property
    def tell(self) -> str:
        """How the planner learns of failures, one of `ftqp.sim.session.session_commands.TELLS`."""
        return self._tell.how

    def advance(self, seconds: float) -> int:
        """Apply the commands that have come, then go on; every tick is made, none is skipped."""
        self._apply_orders()
        if self.paused or self._broken:
            return 0
        self._left += max(seconds, 0.0) / self.arms.arm.planner.dt
        count = floor(self._left + ROUNDING)
        self._left -= count
        for left in range(count, 0, -1):
            if not self._tick(last=left == 1):
                return count - left
        return count

    def _apply_orders(self) -> None:
        while True:
            try:
                command = self._orders.get_nowait()
            except Empty:
                return
            try:
                self._message = self._apply(command)
            except FtqpError as error:
                self._message = f"{error}."
            except Exception as error:  # of a reader, a solver or a model from elsewhere: the page lives on
                self._message = f"this could not be done, and the arm is as it was: {error!r:.300}."

    def _apply(self, command: Command) -> str:
        """Do what is ordered; a note for the operator, or nothing."""
        match command:
            case Break():
                self._break(command)
            case Repair():
                self._repair(command.joint)
            case Pause():
                self.paused = bool(command.paused)
                return "" if self.paused else self._resume()
            case Reset():
                self._begin()
            case Speed():
                self._hurry(command.factor)
            case Tell():
                return self._tell_so(command)
            case Aim():
                self._arm.follow(command.pose)
            case LookForWays():
                if command.look:
                    return self._arm.look_for_ways()
                self._arm.forget_ways()
            case TakeWay():
                return self._arm.take_way(command.number)
            case Place():
                self._arm.place(command.name, command.position)
            case Use():
                return self._use(command)
            case Play():
                self._rehearse(command)
            case Seek():
                return "Only a replay can go to another time; a running session cannot."
        return ""

    def _resume(self) -> str:
        """Let a planner that has stopped its arm go on; why it does not, or nothing."""
        why = self._arm.resume()
        return f"The arm does not go on: {why}. Reset begins anew." if why else ""

    def _show(self, arms: SessionArms) -> None:
        """Let other arms run."""
        self.arms = arms
        self._arm = WatchedArm(arms.arm)
        self._tell = Tell("detector" if arms.detects else "at once")

    @property
    def _both(self) -> tuple[WatchedArm | RivalArm, ...]:
        """The arm, and the rival while there is one."""
        return (self._arm,) if self._rival is None else (self._arm, self._rival)

    def _begin(self, schedule: Schedule | None = None) -> None:
        """Tick 0, nothing broken; what fails by itself comes from the schedule, or from the arms."""
        arms, dt = self.arms, self.arms.arm.planner.dt
        self._rival = None if arms.rival is None else RivalArm(arms.rival, arms.arm)
        for one in self._both:
            one.begin(arms.q, arms.v)
        events = arms.schedule if schedule is None else schedule
        self._failing, self._announced = events.failing(dt), events.announced(dt)
        self._telling: dict[str, int] = {}
        self._k, self._left, self._broken, self._message = 0, 0.0, False, ""
        self._tick(last=True)

    def _tick(self, *, last: bool) -> bool:
        """One tick; whether the arm can go on."""
        k = self._k
        try:
            self._happen(k)
            for one in self._both:
                one.plan_step(k)
            if last:
                self._frame = self._arm.frame(k, None if self._rival is None else self._rival.seen())
            for one in self._both:
                one.move()
        except (FtqpError, ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            return self._break_off(str(error))
        self._k = k + 1
        failure = self._arm.failure
        if failure is not None:
            return self._break_off(failure)
        if self._rival is not None and self._rival.failure is not None:
            self._message = f"The rival cannot go on: {self._rival.failure}."
            self._rival = None
        return True

    def _break_off(self, why: str) -> bool:
        self._broken = True
        self._message = f"The simulation of the arm cannot go on: {why}. Reset begins anew."
        return False

    def _happen(self, k: int) -> None:
        """What fails by itself at tick k, and what is reported then."""
        for event in self._failing.get(k, ()):
            for one in self._both:
                one.fail(event.fault)
        for event in self._announced.get(k, ()):
            self._announce(event.fault)
        if self._telling:
            for joint in [joint for joint, due in self._telling.items() if due <= k]:
                del self._telling[joint]
                self._announce(self._arm.failed[joint])

    def _announce(self, fault: Fault) -> None:
        """Tell the planner, and the rival."""
        for one in self._both:
            one.tell(fault)

    def _joint(self, joint: str | int) -> str:
        robot = self.arms.robot
        return robot.joints[robot.joint(joint)]

    def _break(self, command: Break) -> None:
        joint, fault = self._joint(command.joint), self._fault(command)
        at_once = self._tell.how == "at once"
        self._arm.fail(fault)
        if at_once:
            try:
                self._arm.tell(fault)
            except FtqpError:
                self._arm.repair(joint)
                raise
        if self._rival is not None:
            self._rival.fail(fault)
            if at_once:
                self._rival.tell(fault)
        self._telling.pop(joint, None)
        if self._tell.how == "after":
            self._telling[joint] = self._due()

    def _rehearse(self, command: Play) -> None:
        """Begin anew with failures of this command alone."""
        whole = command.joint
        single = not isinstance(whole, str) or whole in self.arms.robot.joints
        joints = [whole] if single else str(whole).split("+")
        reported: float | Literal["never"] | None = "never"
        if self._tell.how in ("at once", "after"):
            reported = command.time + self._tell.delay if self._tell.how == "after" else None
        faults = [self._fault(Break(joint, command.kind, command.settings)) for joint in joints]
        self._begin(Schedule([FaultEvent(command.time, fault, announced=reported) for fault in faults]))

    def _fault(self, command: Break) -> Fault:
        """The fault of a command, for a joint by name."""
        joint = self._joint(command.joint)
        settings = command.settings or (WEAK if command.kind == Degraded.kind else {})
        try:
            return kind_of(command.kind)(joint, **settings)
        except TypeError as error:
            raise InputError(f"a fault of kind {command.kind} has no such setting: {error}") from error

    def _due(self) -> int:
        return self._k + round(self._tell.delay / self.arms.arm.planner.dt)

    def _repair(self, which: str | int) -> None:
        joint = self._joint(which)
        self._telling.pop(joint, None)
        for one in self._both:
            one.repair(joint)

    def _hurry(self, factor: float) -> None:
        if not (isinstance(factor, int | float) and isfinite(factor) and 0.0 < factor <= FASTEST):
            raise InputError(f"speed is {factor!r}, expected a factor above 0 and at most {FASTEST:g}")
        self.speed = float(factor)

    def _tell_so(self, command: Tell) -> str:
        """Change how the planner learns of failures; those that it does not know of yet count, too."""
        if command.how not in TELLS:
            raise InputError(f"{command.how!r} is no way to tell the planner; there are {', '.join(TELLS)}")
        if not (isfinite(command.delay) and command.delay >= 0.0):
            raise InputError(f"delay is {command.delay!r} s, expected a number of seconds >= 0")
        detects = command.how == "detector"
        if detects != self.arms.detects:
            self._recast(replace(self.choice, detector=detects))
            self._tell = command
            return (
                "The arm begins anew, its planner made " + ("with" if detects else "without") + " a detector."
            )
        self._tell = command
        self._telling.clear()
        for joint in self._arm.unreported:
            if command.how == "at once":
                self._announce(self._arm.failed[joint])
            elif command.how == "after":
                self._telling[joint] = self._due()
        return ""

    def _use(self, command: Use) -> str:
        choice = self.choice
        if command.scenario is not None:
            choice = Choice(scenario=command.scenario)
        for name in ("robot", "scheme", "backend", "box"):
            wanted = getattr(command, name)
            if wanted is not None:
                choice = replace(choice, **{name: wanted})
        self._recast(choice)
        return ""

    def _recast(self, choice: Choice) -> None:
        """Other arms, if they can be made and moved; else the old one goes on."""
        arms = self._arms_of(choice)
        self.choice = choice
        self._show(arms)
        self.stage += 1
        self._begin()
