"""Planner: one arm, one task, one QP a tick."""

import sys
from collections.abc import Callable, Sequence
from functools import update_wrapper
from threading import get_ident
from types import FrameType
from typing import Any, Concatenate, NoReturn, ParamSpec, TypeVar

from ftqp.control.paths.path import Path
from ftqp.control.planner.assembly import Assembly, Deployable
from ftqp.control.planner.configuration import Configuration, CurrentConfiguration
from ftqp.control.planner.lead import Lead, Ticks
from ftqp.control.planner.leading_plan import Remaining
from ftqp.control.planner.planner_view import PlannerView, planner_html
from ftqp.control.planner.rollout_setup import RolloutSetup
from ftqp.control.planner.settings import Settings, planner_settings, takes
from ftqp.control.planner.step import Step
from ftqp.control.planner.ways.way_out import WayOut, ways_out
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.fixed import Fixed
from ftqp.faults.kinds import Fault
from ftqp.kernel.entry.session import Memory, Session
from ftqp.kernel.layout.enums import NEWS, RELAXED
from ftqp.model.capsules import Capsule
from ftqp.model.payload import Payload

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")
ANEW = "the planner was laid out for it; make another one, ftqp.Planner(robot, {name}=...)"
"""What to do about an attribute that a planner was made with."""


def guarded(name: str) -> Callable[[Callable[Concatenate[Any, P], R]], Callable[Concatenate[Any, P], R]]:
    """Lets one thread at a time into a method, and no step into a step, of a function that the step asks."""

    def with_guard(call: Callable[Concatenate[Any, P], R]) -> Callable[Concatenate[Any, P], R]:
        def guard(planner: Any, /, *args: P.args, **kwargs: P.kwargs) -> R:
            me, inside = get_ident(), planner._inside
            if inside is not None and (inside[0] != me or name == inside[1] == "step"):
                _refuse_inside(name, me, *inside)
                inside = None
            if inside is not None:  # the outermost call counts
                return call(planner, *args, **kwargs)
            try:
                planner._inside = me, name, sys._getframe()
                return call(planner, *args, **kwargs)
            finally:
                planner._inside = None

        return update_wrapper(guard, call)

    return with_guard


def _refuse_inside(name: str, me: int, owner: int, other: str, frame: FrameType) -> None:
    """Refuse a call inside another one; one that an exception has ended may not have said so."""
    found = sys._current_frames().get(owner)
    while found is not None and found is not frame:
        found = found.f_back
    if found is None:
        return
    if me != owner:
        raise InputError(
            f"planner.{name} is called while another thread is inside planner.{other}; a planner "
            "belongs to one thread: let the others hand over to it what they want, by a queue.Queue"
        )
    raise InputError(
        "planner.step is called inside planner.step, by a function that it asks; let that only fill "
        "in its arrays, and step another planner to look ahead"
    )


def given(read: Callable[[Settings], T]) -> Fixed[T]:
    """An attribute that a planner was made with."""
    return Fixed(lambda planner: read(planner._given), remedy=ANEW)


def configured(read: Callable[[Configuration], T], about: str, remedy: str) -> Fixed[T]:
    """An attribute of a planner's configuration."""
    return Fixed(lambda planner: read(planner._configuration.now), about, remedy)


def part(read: Callable[[Assembly], T], about: str, remedy: str = "it is read, and follows it") -> Fixed[T]:
    """An attribute of a planner's parts."""
    return Fixed(lambda planner: read(planner._parts), about, remedy)


class Planner:
    """Redundancy resolution, one QP a tick, with failed joints as bounds.

    Args:
        robot: The arm, of at most 64 joints with finite acceleration limits.
        dt: The sampling period, > 0 and at most 1 [s]. A longer one needs smaller gains, and braking begins
            earlier.
        level: ``acceleration`` or ``velocity``, what the QP decides. Accelerations keep velocity continuous.
        scheme: What the arm does with its redundancy: an ``ftqp.schemes`` recipe, its name, or
            ``{"name": ..., ...}``; None is ``mvn``.
        task: Which rows of the pose are followed, how, and with which gains; None is ``Task()``.
        bounds: How limits become intervals: ``viability``, ``jin`` or ``one_step``, or an object of
            ``ftqp.bounds``.
        backend: What solves the QP: ``active_set`` or ``dtrnn``, which both run in the kernel, or any name,
            table, profile file or object that ``ftqp.qp.backend`` takes.
        posture: The posture that ``rmp`` and ``dlsm`` return to, (nv,) [rad or m]; None is that given to
            ``reset``.
        torque_limits: Whether torque limits are rows of the QP. It has no effect without inertia or limits.
        emergency: When the planner stops the arm of its own accord; None never does, unless a sensor is lost
            or no usable command is found.
        timing: Whether every step is timed (``step.qp.time``), which costs two readings of the clock.
        branch_limits: A range (low, high) [rad or m] for some joints, inside their own, that keeps the arm
            on one side of a singularity.
        drive: What the arm takes: ``position``, ``velocity`` or ``torque``, or an ``ftqp.Drive`` or table
            that says more. On an arm that follows exactly all three give the same motion.
        noise: How noisy the measurements are; None is unknown.
        detector: Detects failures that nobody reports, and makes the planner count on them: None does so at
            0.1 false alarms an hour, an ``ftqp.Detector`` at another rate. With False the arm is guarded, and
            no joint is named.
        plan: One of ``ftqp.analysis.plan`` or ``load_plan``: its postures lead the null space, instead
            of ``posture``; the scheme is ``rmp`` unless another is named.
        tasks: That of the end effector, if it is not given as ``task``, as ``ftqp.Task`` or as a ``PoseTask``
            or ``PositionTask`` of its frame, and up to 8 of further frames and joints, ``PoseTask``,
            ``RelativeTask`` and others. Those on level 0 go before it, those on level 1 are as firm as it,
            and the rest share what these leave of the arm's freedom, as their weights say.
        remember: For how long the way that the joints have come is kept for ``ways_out``, > 0 [s], the time
            not counted in which they stand; longer is coarser. None: not at all, which costs nothing.
        n_minus_one: Looks ahead at what the lock of each joint would cost, see ``security``, and leads the
            null space to where it costs least, by scheme ``rmp`` unless another is named; None does not.
        constraints: What goes before the task of the end effector: up to 8 sides of planes, boxes and cones
            that points and axes are kept to, ``ftqp.Keep``, up to 8 rows of your own, ``ftqp.Rows``, and the
            torque limits that are there anyway, ``ftqp.TorqueLimits``.
        scene: What stands around the arm, an ``ftqp.Scene``; the arm keeps clear of it and of itself. None
            keeps clear of nothing, unless ``clearance`` is given.
        clearance: How far it keeps, an ``ftqp.Clearance``; None is ``Clearance()`` with a scene.

    Raises:
        InputError: A parameter is wrong, or two of them exclude each other.
        ModelError: The robot cannot be driven safely.
    """

    __slots__ = (
        "__weakref__",
        "_at_rest",
        "_begin",
        "_configuration",
        "_given",
        "_inside",
        "_out",
        "_parts",
        "_rest",
        "_said",
        "_session",
        "_ticks",
        "_view",
    )  # fmt: skip
    _begin: Callable[..., int] | None
    _inside: tuple[int, str, FrameType] | None

    dt = given(lambda settings: settings.dt)
    level = given(lambda settings: settings.level)
    task = given(lambda settings: settings.task)
    scheme = given(lambda settings: settings.scheme)
    bounds = given(lambda settings: settings.bounds)
    emergency = given(lambda settings: settings.emergency)
    posture = given(lambda settings: settings.posture)
    drive = given(lambda settings: settings.drive)
    noise = given(lambda settings: settings.noise)
    backend = given(lambda settings: settings.backend)
    plan = given(lambda settings: settings.plan)
    tasks = part(
        lambda parts: parts.tasks,
        "The further tasks by name; their weights and targets may be changed between steps.",
        ANEW,
    )
    constraints = part(
        lambda parts: parts.constraints,
        "Points that are kept on their side of a plane, and rows of your own, by name.",
        ANEW,
    )
    robot = configured(
        lambda now: now.arm.robot,
        "The arm as it is fitted now, with its load and tool.",
        "planner.carry(payload) mounts a load, planner.tool(T) a tool; for another arm make another planner",
    )
    faults = configured(
        lambda now: now.belief.faults,
        "The faults believed now, by joint name; a copy.",
        "planner.report(fault) believes one more, planner.withdraw(joint) one less",
    )
    payload = configured(
        lambda now: now.arm.payload,
        "The load that is carried in addition to the robot's own bodies; None is none.",
        "planner.carry(payload) mounts a load, planner.carry(None) puts it down",
    )
    pace = configured(
        lambda now: now.speed,
        "How fast the arm is led, in (0, 1]: ``speed``.",
        "planner.speed = share asks for another one",
    )
    stopped_because = part(
        lambda parts: parts.loop.stopped_because,
        "Why a stop is latched, in a sentence that names the joint; None while none is.",
        "planner.stop() stops the arm, planner.resume() lets it go on",
    )
    scene = part(
        lambda parts: None if parts.surroundings is None else parts.surroundings.scene,
        "What stands around the arm; None where it keeps clear of nothing.",
    )
    clearance = part(
        lambda parts: None if parts.surroundings is None else parts.surroundings.clearance,
        "How far it keeps from itself and from the scene; None where it keeps clear of nothing.",
    )
    pairs_left_out = part(
        lambda parts: () if parts.surroundings is None else parts.surroundings.left_out,
        "Pairs of the arm's own bodies that are built too near to each other to be kept apart, by name.",
    )
    watched_pairs = part(
        lambda parts: () if parts.surroundings is None else parts.surroundings.names,
        "The bodies of each pair that are kept apart, by name, those of ends of bodies as well.",
    )
    task_rows = part(
        lambda parts: parts.task_rows, "The rows of the pose that the task has, of x, y, z, rx, ry, rz."
    )
    given_up = part(
        lambda parts: parts.rest.given_up,
        "What of the task is given up now, as it cannot be held, in a sentence; None while all counts.",
    )
    learned = part(
        lambda parts: parts.loop.learned,
        "What the planner has estimated of the arm: of position servos, or what a torque arm's model lacks."
        " On drive ``position`` lag, sag, friction and noise of each joint with standard deviations, in "
        "numbers and ``sentences``; None before the arm has moved, and of one whose samples are commands. "
        "On drive ``torque`` rotors, friction and a load, since ``reset``: what is known by now may be "
        "stated, "
        "``planner.carry(planner.learned.payload)``, ``robot.with_rotors(...)``; None before the first step, "
        "and with ``inertia_error=0``. None with drive ``velocity``.",
    )
    diagnosis = part(
        lambda parts: None if parts.response is None else parts.response.diagnosis,
        "What the detector holds for likely; None without one.",
    )
    findings = part(
        lambda parts: () if parts.response is None else tuple(parts.response.findings),
        "What the detector has found since ``reset`` and the planner acted upon, in order.",
    )
    plan_time = part(
        lambda parts: None if parts.leading is None else parts.leading.at,
        "The time of the plan at which the end effector is [s]; None without a plan.",
    )
    security = part(
        lambda parts: None if parts.watch is None else parts.watch.security,
        "What the lock of each joint would cost, as it was looked at last; None without ``n_minus_one``.",
    )

    @takes(planner_settings)
    def __init__(self, given: Settings) -> None:
        self._given, self._inside, self._begin = given, None, None
        self._parts = parts = Assembly(
            given,
            lambda fault: self._configuration.believe(fault),
            lambda joint: self._configuration.disbelieve(joint),
            self.what_ifs,
        )
        self._session, self._out, self._said, self._rest = parts.session, parts.out, parts.said, parts.rest
        self._ticks = Ticks(parts)
        self._at_rest = self._ticks.at_rest
        self._configuration = CurrentConfiguration(parts, self._let)
        self._view = PlannerView(self._session, self.robot)
        if given.n_minus_one is not None:
            parts.refuse_looking_ahead(self._configuration.now.reserve)

    def _let(self, tick: Callable[..., int] | None) -> None:
        """Steps may call this tick at once; None: its configuration is looked at first."""
        self._begin = tick

    def __repr__(self) -> str:
        failed = ", ".join(self.faults)
        return (
            f"Planner({self.robot.name}, {self.robot.nv} joints, dt={self.dt:g} s, {self.level} level, "
            f"failed: {failed or 'none'})"
        )

    def _repr_html_(self) -> str:
        """What it was made with and what it believes, for notebooks."""
        return planner_html(self)

    def distances(self, q: Any) -> dict[tuple[str, str], FloatArray]:
        """The distance of each pair of bodies that are kept apart [m], by their names.

        Args:
            q: A configuration, (nv,) or (nq,), for a number each, or several of them, (S, nv), for (S,) each
                [rad or m].

        Raises:
            InputError: A wrong shape, or a planner without a scene.
        """
        return self._parts.kept_clear().distances_at(q)

    @property
    def kept_rows(self) -> str | tuple[str, ...]:
        """The rows that are asked for now: ``position_axis``, or names, as searches take them."""
        return "position_axis" if self._session.K.task.tool_rows else self.task_rows

    @property
    def tick(self) -> int:
        """Number of the step, from 0 at the first one after ``reset``; -1 before it."""
        return int(self._session.K.state.ticks) - 1

    @property
    def disturbance(self) -> FloatArray:
        """Torque that acts on the joints and is not in the model, as observed, (nv,) [N m or N]; a copy.

        It is known of a torque arm only, 0 for failed joints, and NaN with another drive.
        """
        return self._parts.loop.disturbance

    @property
    def touch(self) -> FloatArray | None:
        """The force that seems to push the end effector of a torque arm, (3,) [N], along the base's axes.

        A force at the end effector shows up in many joints at once, a motor that does not obey in its own:
        where the force explains what is unusual much better no joint is suspected. None while nothing pushes,
        with another drive, and while a joint is known to have failed. What lasts longer than 1 s is a load.
        """
        return self._parts.loop.touch

    def view(self) -> PlannerView:
        """The planner's own state and belief, to be read: for what is built around it."""
        return self._view

    @property
    def known(self) -> Session:
        """What a search for ways takes over of the planner."""
        return self._session

    @property
    def avoids(self) -> bool:
        """Whether bodies are kept apart, or points and axes where they may be."""
        return bool(self._parts.keeps) or bool(self.watched_pairs)

    def session(self) -> Session:
        """A copy of all that the planner knows, for studies of what is in it."""
        return self._session.copy()

    @guarded("reset")
    def reset(self, q: Any, v: Any = None) -> None:
        """Begin at (q, v): the latch of a stop, warm starts and the last command are forgotten, not faults.

        A start that is near a singularity of the task, that a motor cannot hold, or that leaves no redundancy
        gets one warning on the logger ``ftqp``.

        Args:
            q: Measured configuration, (nv,) joint values or (nq,) [rad or m].
            v: Measured velocity, (nv,) [rad/s or m/s]; None is rest.

        Raises:
            InputError: A wrong shape, or a number that is not finite.
        """
        self._configuration.start(q, v)

    @guarded("report")
    def report(self, fault: Fault) -> None:
        """Believe ``fault`` from the next step on, of any kind in ``ftqp.faults.kinds.KINDS``.

        Args:
            fault: The fault; it takes the place of another one of the same joint.

        Raises:
            InputError: An unknown joint, or not a fault.
        """
        self._configuration.report(fault)

    @guarded("brake")
    def brake(self, joint: str | int) -> None:
        """Let the brake of a joint that swings freely be closed, and believe that it stands where it is.

        ``step.brakes`` names it from the next step on, on an arm that has a brake for each joint.

        Args:
            joint: Its name or 0-based index.

        Raises:
            InputError: An unknown joint, or one that does not swing freely.
        """
        self._configuration.brake(joint)

    @guarded("withdraw")
    def withdraw(self, joint: str | int) -> None:
        """Believe the joint to be healthy again from the next step on.

        Args:
            joint: Its name or 0-based index; one that is healthy stays so.

        Raises:
            InputError: An unknown joint.
        """
        self._configuration.withdraw(joint)

    @guarded("carry")
    def carry(self, payload: Payload | None) -> None:
        """Count on this load at the end effector from the next step on, instead of the last one.

        State, faults and the solver's memory stay; ``planner.robot`` is then the loaded arm, which brakes
        earlier. A load that it cannot hold where it is gets one warning on the logger ``ftqp``. This takes
        some ten milliseconds: call it while the arm rests.

        Args:
            payload: The load, in the frame of the robot's own tip, whatever the tool is; None is none.

        Raises:
            InputError: This is no payload, or a robot without masses.
        """
        self._configuration.carry(payload)

    @guarded("tool")
    def tool(self, T: Any) -> None:
        """Control another point from the next step on; targets are then poses of that point.

        State, faults and the solver's memory stay, and so do masses: a tool that weighs something is a
        payload, too. A target that is not moved along with the point is somewhere else for the arm.

        Args:
            T: Pose of the point in the frame of the robot's own tip, (4, 4) [m]; None is that tip.

        Raises:
            InputError: T is no pose, or a plan leads the planner, which is one of its own tip.
        """
        self._configuration.hold(T)

    @guarded("attach")
    def attach(self, name: str, shapes: Capsule | Sequence[Capsule]) -> None:
        """Keep more bodies clear that move with the arm: a tool, a load that sticks out.

        From the next step on they are kept clear of the scene and of the arm, as its links are. Their weight
        counts only where ``carry`` has it, too.

        Args:
            name: What they are called together in statuses and certificates.
            shapes: Capsules, one or several; without a ``frame`` they are in that of the robot's own tip.

        Raises:
            InputError: These are no capsules, the name is taken, they touch the arm where it is neutral, or
                the planner keeps clear of nothing. Nothing changes then.
        """
        self._parts.kept_clear().attach(name, shapes)

    @guarded("detach")
    def detach(self, name: str) -> None:
        """Forget bodies that were attached.

        Args:
            name: What they are called.

        Raises:
            InputError: Nothing of that name is attached.
        """
        self._parts.kept_clear().detach(name)

    @property
    def speed(self) -> float:
        """How fast the arm goes, in (0, 1] of full speed; it may be changed at every step.

        A smaller number slows the path of a ``PathFollower`` down, and the way of a ``GoTo`` or a
        ``TargetFollower`` by as much, an operator's twist included. Targets that the user's own clock gives
        to ``step`` are not changed by it.
        """
        return self._configuration.now.speed

    @speed.setter
    @guarded("speed")
    def speed(self, share: float) -> None:
        self._configuration.lead_at(share)

    def stop(self) -> None:
        """Brake every healthy joint from the next step on and hold it, until ``resume`` or ``reset``."""
        self._parts.loop.stop()

    def resume(self) -> bool:
        """Go on from where the arm is after a stop, along the path from where the stop began.

        Targets that your own clock gave meanwhile are played back, and the time is made up for by a quarter
        of their speed. One that jumped is another goal, and the arm goes there at once, as fast as its limits
        allow: ``GoTo`` goes gently.

        Returns:
            Whether the planner goes on; it does not while a lost sensor forbids it, and needs ``reset``.
        """
        return self._parts.loop.resume()

    # Each default by keyword only costs 15 ns before Python 3.13: hence an argument that ends those by place.
    def step(
        self, q: Any, v: Any = None, target: Any = None, _: None = None, tau: Any = None, tip: Any = None,
        ticks: int = 1,
    ) -> Step:  # fmt: skip
        """The command for the next ``dt``.

        Args:
            q: Measured configuration, (nv,) joint values or (nq,) [rad or m]. Arrays are copied, and nothing
                of them is remembered.
            v: Measured velocity, (nv,) [rad/s or m/s], or None: the planner observes it from q, and looks at
                a given one only to see whether it is finite.
            target: Where the end effector should be now; or ``targets.at(k)`` of a whole trajectory; or a
                table of targets by task, ``{"tip": target, "elbow": position}``, in which a task that is left
                out keeps its last one.
            _: Nothing; what follows is given by name.
            tau: Measured torque, (nv,) [N m or N]; it is checked to be finite.
            tip: Measured pose of the end effector, (4, 4), in place of the one of forward kinematics.
            ticks: How many ``dt`` have passed since the last step, >= 1: 1 in a loop that is on time. The
                ticks that a late loop has missed are made up for first, up to four, so that the command is
                where it would be and keeps every limit over the gap; more count as four.

        Returns:
            The planner's own step, valid until the next one.

        Raises:
            InputError: A wrong shape or type, a position target for a task with rotation rows, or no
                ``reset`` before. What the world does (NaN, an infeasible task, a failing solver) never
                raises: see ``step.status``.
        """
        begin = self._begin
        if tau is None and tip is None and _ is None and begin is not None and ticks == 1:
            try:
                code = begin(q, self._at_rest if v is None else v, target.packed, target.row)
            except (AttributeError, TypeError, ValueError, OverflowError):
                code = -1  # no target; what is below says so, or takes it for a table of them
            if code >= NEWS:
                code = self._ticks.respond(code)
                self._said.code = code
                return self._out
            if code >= 0:
                self._said.code = code
                if code == RELAXED or self._rest.held:
                    self._rest.tell(self._out)
                return self._out
        return self._led(None, q, v, self._ticks.target(target, _), tau, tip, ticks=ticks)

    def ways_out(self, home: Any = None) -> tuple[WayOut, ...]:
        """Where the arm can go from here with the joints that work, tried in thought, what is clear first.

        It takes some 0.05 s; ``ftqp.GoTo(planner, way=...)`` goes one. Source: docs/theory/ways-out.md.

        Args:
            home: Where the arm belongs, (nv,) [rad or m]; None is ``posture``, or the robot's neutral one.

        Raises:
            InputError: There was no ``reset``, home has a wrong shape, or the robot floats.
        """
        self._configuration.apply()
        parts = self._parts
        return ways_out(self, parts.commands, self._configuration.now.reserve, parts.remembered, home)

    def options(self) -> tuple[Remaining, ...]:
        """What can still be done after faults, least lost first; without a plan the clear ``ways_out()``.

        With one, of its path: all of it, with fewer rows, a part of it, the way back, and to stop. A plan is
        looked ahead on without constraints: a planner that has some answers as one without a plan.
        """
        if self._parts.leading is None or self._parts.constraints:
            return tuple(way.remaining for way in self.ways_out() if way.clear or way.kind == "stop")
        q = self._session.K.state.q_command[: self.robot.nv].copy()
        return self._parts.leading.options(q, self.faults)

    def lead(self, leader: Memory, meant: FloatArray | None = None) -> Lead:
        """The planner's ticks led by a path's progress, an inertial target or a motion of the joints.

        Args:
            leader: The memory of the path, the base or the motion; it stays the leader's own.
            meant: Where the end effector is meant to be meanwhile, (4, 4), for errors and statuses; None: as
                led.

        Raises:
            InputError: They do not go together.
        """
        return Lead(self._led, self._parts, leader, meant)

    @guarded("step")
    def _led(self, *given: Any, **more: Any) -> Step:
        """A step of any leader; see ``Ticks.make``."""
        self._configuration.apply()
        self._begin = None  # so that another thread's step comes here, too, where it is refused
        step = self._ticks.make(*given, **more)
        self._begin = self._parts.fast
        return step

    def what_ifs(self) -> RolloutSetup:
        """What other arms like this one would begin with, for ``ftqp.batch``; nothing here changes.

        Raises:
            InputError: A foreign solver, or a plan.
        """
        if not self._session.K.state.is_reset:
            self._parts.tasks.refuse_without_target()
        now = self._configuration.now
        return self._parts.what_ifs(self.robot, now.belief, now.reserve)

    def foresee(self, path: Path | None, at: float = 0.0) -> None:
        """Say what the end effector will follow, for ``n_minus_one``; a ``PathFollower`` says it by itself.

        Args:
            path: What it follows by the clock; None goes on with the target's twist.
            at: The time of the path at the next step [s].
        """
        if self._parts.watch is not None:
            self._parts.watch.foresee(path, at)

    def deployable(self) -> Deployable:
        """What this planner is without Python, for ``ftqp build``; nothing here changes.

        Raises:
            InputError: A foreign solver, a network, a closed form, a plan, functions in
                Python, a cloud of balls, or faults that it already believes in.
        """
        self._configuration.apply()
        now = self._configuration.now
        return self._parts.deployable(now.belief, now.reserve)

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a Planner owns memory and perhaps a foreign solver, and is neither copied nor pickled; make "
            "another with the same arguments, and keep a step with step.copy()"
        )
