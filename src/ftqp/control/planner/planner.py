"""Planner: one arm, one task, one QP a tick."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial, update_wrapper
from itertools import count
from pathlib import Path as File
from threading import get_ident
from types import FrameType
from typing import Any, Concatenate, NoReturn, ParamSpec, TypeVar

import numpy as np

from ftqp.control.drive.joint_drive import Drive, Noise
from ftqp.control.drive.learned_servos import LearnedServos
from ftqp.control.inverse_kinematics.passable import MotionValidity
from ftqp.control.paths.path import Path
from ftqp.control.planner.arm_loop import Learned, learned
from ftqp.control.planner.assembly import Assembly, Deployable
from ftqp.control.planner.constraint_list import Constraint, Constraints
from ftqp.control.planner.draft import Draft, write_call
from ftqp.control.planner.given_arrays import (
    converted_tick,
    is_row,
    made_up_for,
    measured_tick,
    mistake,
    not_a_target,
    whole_ticks,
)
from ftqp.control.planner.lead import Blocks, Lead, with_error_to
from ftqp.control.planner.leading_plan import LeadingPlan, Remaining
from ftqp.control.planner.mounted_robot import BrakingReserve, MountedRobot, braking_reserve, warn_of_weight
from ftqp.control.planner.planner_view import PlannerView, planner_html
from ftqp.control.planner.response.detector import Detector
from ftqp.control.planner.rollout_setup import RolloutSetup
from ftqp.control.planner.settings import settled
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target, Targets
from ftqp.control.planner.task_list import TaskList
from ftqp.control.planner.ways.n_minus_one import NMinusOne, Security
from ftqp.control.planner.ways.way_out import WayOut, ways_out
from ftqp.control.scene.placed_shapes import Clearance, Scene
from ftqp.control.task.bounds import Bounds
from ftqp.control.task.resolvers import Resolver
from ftqp.control.task.scheme import Scheme
from ftqp.control.task.soft_tasks import SoftTask
from ftqp.control.task.task import EmergencyStop, Task
from ftqp.core.checks import FloatArray, array, frozen, positive
from ftqp.core.clock import now
from ftqp.core.errors import InputError
from ftqp.core.fixed import Fixed
from ftqp.faults.belief import Belief
from ftqp.faults.detection.diagnosis import Diagnosis, Finding
from ftqp.faults.kinds import Fault, FreeSwinging, Locked
from ftqp.kernel.entry.orders import Orders
from ftqp.kernel.entry.session import Memory, Session
from ftqp.kernel.entry.way_session import WaySession
from ftqp.kernel.layout.enums import NEWS, RELAXED
from ftqp.kernel.layout.record import load_chain
from ftqp.model.capsules import Capsule
from ftqp.model.payload import Payload
from ftqp.model.robot import Robot
from ftqp.qp.adapters.backend import Backend

P = ParamSpec("P")
R = TypeVar("R")
NUMBERS = count()
"""Of configurations: none occurs twice, so that a number says which one it is."""
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
        detector: Detects failures that nobody reports, and makes the planner count on them. On drives
            ``position`` and ``velocity`` that is so without a word, at 0.1 false alarms an hour; an
            ``ftqp.Detector`` sets another rate, and nothing else, and with False the arm is guarded and no
            joint is named. On ``torque`` None and False are none.
        plan: One of ``ftqp.analysis.plan`` or ``load_plan``: its postures lead the null space, in the place
            of ``posture``; the scheme is ``rmp`` unless another is named.
        tasks: That of the tip, if it is not given as ``task``, as ``ftqp.Task`` or as a ``PoseTask`` or
            ``PositionTask`` of its frame, and up to 8 of further frames and joints, ``PoseTask``,
            ``RelativeTask`` and others. Those on level 0 go before it, those on level 1 are as firm as it,
            and the others share what these leave of the arm's freedom, as their weights say.
        remember: For how long the way that the joints have come is kept for ``ways_out``, > 0 [s], the time
            not counted in which they stand; longer is coarser. None: not at all, which costs nothing.
        n_minus_one: Looks ahead at what the lock of each joint would cost, see ``security``, and leads the
            null space to where it costs least, by scheme ``rmp`` unless another is named; None does not.
        constraints: What goes before the task of the tip: up to 8 sides of planes, boxes and cones that
            points and axes are kept to, ``ftqp.Keep``, up to 8 rows of your own, ``ftqp.Rows``, and the
            torque limits that are there anyway, ``ftqp.TorqueLimits``.
        scene: What stands around the arm, an ``ftqp.Scene``; the arm keeps clear of it and of itself. None
            keeps clear of nothing, unless ``clearance`` is given.
        clearance: How far it keeps, an ``ftqp.Clearance``; None is ``Clearance()`` beside a scene.

    Raises:
        InputError: A parameter is wrong, or two of them exclude each other.
        ModelError: The robot cannot be driven safely.
    """

    __slots__ = (
        "__weakref__", "_applied", "_at_rest", "_begin", "_fast", "_given", "_inside", "_known", "_loop",
        "_number", "_out", "_parts", "_rest", "_said", "_session", "_tick",
    )  # fmt: skip
    _applied: Configuration | None
    _begin: Callable[..., int] | None
    _inside: tuple[int, str, FrameType] | None
    _known: dict[int, Configuration]

    robot: Fixed[Robot] = Fixed(
        "_configuration.arm.robot",
        "The arm as it is fitted now, with its load and tool.",
        "planner.carry(payload) mounts a load, planner.tool(T) a tool; for another arm make another planner",
    )
    dt: Fixed[float] = Fixed("_given.dt", remedy=ANEW)
    level: Fixed[str] = Fixed("_given.level", remedy=ANEW)
    task: Fixed[Task] = Fixed("_given.task", remedy=ANEW)
    tasks: Fixed[TaskList] = Fixed(
        "_parts.tasks",
        "The further tasks by name; their weights and targets may be changed between steps.",
        ANEW,
    )
    constraints: Fixed[Constraints] = Fixed(
        "_parts.constraints",
        "Points that are kept on their side of a plane, and rows of your own, by name.",
        ANEW,
    )
    scheme: Fixed[Scheme | Resolver] = Fixed("_given.scheme", remedy=ANEW)
    bounds: Fixed[Bounds] = Fixed("_given.bounds", remedy=ANEW)
    emergency: Fixed[EmergencyStop | None] = Fixed("_given.emergency", remedy=ANEW)
    posture: Fixed[FloatArray | None] = Fixed("_given.posture", remedy=ANEW)
    drive: Fixed[Drive] = Fixed("_given.drive", remedy=ANEW)
    noise: Fixed[Noise] = Fixed("_given.noise", remedy=ANEW)
    backend: Fixed[str] = Fixed("_given.backend", remedy=ANEW)
    plan: Fixed[LeadingPlan | None] = Fixed("_given.plan", remedy=ANEW)
    faults: Fixed[dict[str, Fault]] = Fixed(
        "_configuration.belief.faults",
        "The faults believed now, by joint name; a copy.",
        "planner.report(fault) believes one more, planner.withdraw(joint) one less",
    )
    payload: Fixed[Payload | None] = Fixed(
        "_configuration.arm.payload",
        "The load that is carried beside the robot's own bodies; None is none.",
        "planner.carry(payload) mounts a load, planner.carry(None) puts it down",
    )
    stopped_because: Fixed[str | None] = Fixed(
        "_loop.stopped_because",
        "Why a stop is latched, in a sentence that names the joint; None while none is.",
        "planner.stop() stops the arm, planner.resume() lets it go on",
    )
    pace: Fixed[float] = Fixed(
        "_loop.speed",
        "How fast the arm is led, in (0, 1]: ``speed``.",
        "planner.speed = share asks for another one",
    )

    def __init__(
        self,
        robot: Robot,
        dt: float = 1e-3,
        *,
        level: str = "acceleration",
        scheme: Scheme | Resolver | str | Mapping[str, Any] | None = None,
        task: Task | None = None,
        bounds: Bounds | str | Mapping[str, Any] = "viability",
        backend: str | File | Mapping[str, Any] | Backend = "active_set",
        posture: Any = None,
        torque_limits: bool = True,
        emergency: EmergencyStop | None = EmergencyStop(),  # noqa: B008  frozen
        timing: bool = False,
        branch_limits: Mapping[str | int, Any] | None = None,
        drive: Drive | str | Mapping[str, Any] = "position",
        noise: Noise | None = None,
        detector: Detector | bool | None = None,
        plan: LeadingPlan | None = None,
        tasks: Sequence[Task | SoftTask] | None = None,
        constraints: Sequence[Constraint] | None = None,
        scene: Scene | None = None,
        clearance: Clearance | None = None,
        remember: float | None = None,
        n_minus_one: NMinusOne | None = None,
    ) -> None:
        given = self._given = settled(
            robot, dt, level=level, scheme=scheme, task=task, bounds=bounds, backend=backend, posture=posture,
            torque_limits=torque_limits, emergency=emergency, timing=timing, branch_limits=branch_limits,
            drive=drive, noise=noise, detector=detector, plan=plan, tasks=tasks, constraints=constraints,
            scene=scene, clearance=clearance, remember=remember, n_minus_one=n_minus_one,
        )  # fmt: skip
        robot, self._inside = given.robot, None
        parts = self._parts = Assembly(given, self._believe, self._disbelieve, self.what_ifs)
        self._session, self._loop = parts.session, parts.loop
        self._out, self._said, self._rest = parts.out, parts.said, parts.rest
        self._at_rest = np.zeros(robot.nv)
        reserve = braking_reserve(robot) if given.limits_torque else None
        told = Configuration(next(NUMBERS), Belief(robot), MountedRobot(robot), reserve)
        self._number, self._known = np.array([told.number]), {told.number: told}
        self._applied = None
        told.tell(self._session.K, parts.orders, None)
        self._apply()
        if n_minus_one is not None:
            self._refuse_looking_ahead()

    def __repr__(self) -> str:
        failed = ", ".join(self.faults)
        return (
            f"Planner({self.robot.name}, {self.robot.nv} joints, dt={self.dt:g} s, {self.level} level, "
            f"failed: {failed or 'none'})"
        )

    def _repr_html_(self) -> str:
        """What it was made with and what it believes, for notebooks."""
        return planner_html(self)

    @property
    def scene(self) -> Scene | None:
        """What stands around the arm; None where it keeps clear of nothing."""
        return None if self._parts.surroundings is None else self._parts.surroundings.scene

    @property
    def clearance(self) -> Clearance | None:
        """How far it keeps from itself and from the scene; None where it keeps clear of nothing."""
        return None if self._parts.surroundings is None else self._parts.surroundings.clearance

    @property
    def pairs_left_out(self) -> tuple[tuple[str, str], ...]:
        """Pairs of the arm's own bodies that are built too near to each other to be kept apart, by name."""
        return () if self._parts.surroundings is None else self._parts.surroundings.left_out

    def distances(self, q: Any) -> dict[tuple[str, str], FloatArray]:
        """The distance of each pair of bodies that are kept apart [m], by their names.

        Args:
            q: A configuration, (nv,) or (nq,), for a number each, or several of them, (S, nv), for (S,) each
                [rad or m].

        Raises:
            InputError: A wrong shape, or a planner without a scene.
        """
        known = self._parts.kept_clear()
        if np.ndim(q) == 2:
            return known.distances(array("q", q, (len(q), self.robot.nv), "(S, nv)"))
        return {names: d[0] for names, d in known.distances(self.robot.angles(q)[None]).items()}

    @property
    def task_rows(self) -> tuple[str, ...]:
        """The rows of the pose that the task has, of x, y, z, rx, ry, rz."""
        return self._parts.task_rows

    @property
    def kept_rows(self) -> str | tuple[str, ...]:
        """The rows that are asked for now: ``position_axis``, or names, as searches take them."""
        return "position_axis" if self._session.K.task.tool_rows else self.task_rows

    @property
    def given_up(self) -> str | None:
        """What of the task is given up now, as it cannot be held, in a sentence; None while all counts."""
        return self._parts.degrading.given_up

    @property
    def tick(self) -> int:
        """Number of the step, from 0 at the first one after ``reset``; -1 before it."""
        return int(self._session.K.state.ticks) - 1

    @property
    def disturbance(self) -> FloatArray:
        """Torque that acts on the joints beside the model, as observed, (nv,) [N m or N]; a copy.

        It is known of a torque arm only, 0 for failed joints, and NaN with another drive.
        """
        return self._loop.disturbance

    @property
    def learned(self) -> Learned | LearnedServos | None:
        """What the planner has learned of the arm: of position servos, or beside the model of a torque arm.

        On drive ``position`` lag, droop, friction and noise of each joint with standard deviations, in
        numbers and ``sentences``; None before the arm has moved, and of one whose samples are its commands.
        On drive ``torque`` rotors, friction and a load, since ``reset``: what is known by now may be told,
        ``planner.carry(planner.learned.payload)``, ``robot.with_rotors(...)``; None before the first step,
        and with ``inertia_error=0``. None with drive ``velocity``.
        """
        return learned(self._session, self.robot)

    @property
    def touch(self) -> FloatArray | None:
        """The force that seems to push the tip of a torque arm, (3,) [N], along the base's axes.

        A force at the tip shows up in many joints at once, a motor that does not obey in its own: where the
        force explains what is unusual much better no joint is suspected. None while nothing pushes, with
        another drive, and while a joint is known to have failed. What lasts longer than 1 s is a load.
        """
        return self._loop.touch

    @property
    def diagnosis(self) -> Diagnosis | None:
        """What the detector holds for likely; None without one."""
        return None if self._parts.response is None else self._parts.response.diagnosis

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What the detector has found since ``reset`` and the planner acted upon, in order."""
        return () if self._parts.response is None else tuple(self._parts.response.findings)

    def view(self) -> PlannerView:
        """The planner's own state and belief, to be read: for what is built around it."""
        return PlannerView(self._session, self.robot)

    def passable(self) -> MotionValidity:
        """What says where the arm may be, as believed now: its motors, kept points, itself and its scene."""
        view = self.view()
        return MotionValidity(self.robot, view.limits.tau, view.working, self._parts.keeps, self)

    def way_session(self) -> WaySession:
        """The arm, its limits and what stands around it as believed now, for a search for ways."""
        around = self._parts.surroundings
        return WaySession(self._session, 0 if around is None else around.whole)

    @property
    def avoids(self) -> bool:
        """Whether bodies are kept apart, or points and axes where they may be."""
        return bool(self._parts.keeps) or bool(self.watched_pairs)

    @property
    def watched_pairs(self) -> tuple[tuple[str, str], ...]:
        """The bodies of each pair that are kept apart, by name, those of ends of bodies as well."""
        return () if self._parts.surroundings is None else self._parts.surroundings.names

    def session(self) -> Session:
        """A copy of all that the planner knows, for studies of what is in it."""
        return self._session.copy()

    @property
    def plan_time(self) -> float | None:
        """The time of the plan at which the tip is [s]; None without a plan."""
        return None if self._parts.leading is None else self._parts.leading.at

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
        n = self.robot.nv
        q = frozen(self.robot.angles(q))
        v = frozen(np.zeros(n) if v is None else array("v", v, (n,), "(nv,)"))
        self._change(lambda told: replace(told, start=(q, v)))

    @guarded("report")
    def report(self, fault: Fault) -> None:
        """Believe ``fault`` from the next step on, of any kind in ``ftqp.faults.kinds.KINDS``.

        Args:
            fault: The fault; it takes the place of another one of the same joint.

        Raises:
            InputError: An unknown joint, or not a fault.
        """
        response = self._parts.response
        self._change(
            lambda told: replace(told, belief=told.belief.reported(fault)),
            response and partial(response.told, fault),
        )

    def brake(self, joint: str | int) -> None:
        """Let the brake of a joint that swings freely be closed, and believe that it stands where it is.

        ``step.brakes`` names it from the next step on, on an arm that has a brake for each joint.

        Args:
            joint: Its name or 0-based index.

        Raises:
            InputError: An unknown joint, or one that does not swing freely.
        """
        i = self.robot.joint(joint)
        name = self.robot.joints[i]
        if not isinstance(self.faults.get(name), FreeSwinging):
            raise InputError(
                f"{name} is not believed to swing freely, so that no brake of it is asked for; report it as "
                "ftqp.Locked if it stands"
            )
        self._loop.ask_for_brake(i)
        self.report(Locked(name, mode="instant"))

    @guarded("withdraw")
    def withdraw(self, joint: str | int) -> None:
        """Believe the joint to be healthy again from the next step on.

        Args:
            joint: Its name or 0-based index; one that is healthy stays so.

        Raises:
            InputError: An unknown joint.
        """
        response = self._parts.response
        self._change(
            lambda told: replace(told, belief=told.belief.without(joint)),
            response and partial(response.forget, joint),
        )

    @guarded("carry")
    def carry(self, payload: Payload | None) -> None:
        """Count on this load at the tip from the next step on, in the place of the last one.

        State, faults and the solver's memory stay; ``planner.robot`` is then the loaded arm, which brakes
        earlier. A load that it cannot hold where it is gets one warning on the logger ``ftqp``. This takes
        some ten milliseconds: call it while the arm rests.

        Args:
            payload: The load, in the frame of the robot's own tip, whatever the tool is; None is none.

        Raises:
            InputError: This is no payload, or a robot without masses.
        """
        limited = self._given.limits_torque

        def loaded(told: Configuration) -> Configuration:
            arm = told.arm.carrying(payload)
            load = None if payload is None else arm.load
            reserve = braking_reserve(arm.unloaded, load) if limited else None
            return replace(told, arm=arm, reserve=reserve)

        self._change(loaded)
        if payload is not None:
            K, n = self._session.K, self.robot.nv
            q = K.state.q_command[:n] if K.state.is_reset else None
            warn_of_weight(self.robot, q, K.limits.tau_max[:n])

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
        if self._parts.leading is not None:
            raise InputError("the planner follows a plan of another tip; plan for robot.with_tip(T) instead")
        self._change(lambda told: replace(told, arm=told.arm.holding(T)))

    @guarded("attach")
    def attach(self, name: str, shapes: Capsule | Sequence[Capsule]) -> None:
        """Keep more bodies clear that move with the arm: a tool, a load that sticks out.

        From the next step on they are kept clear of the scene and of the arm, as its links are. Their weight
        counts only where ``carry`` was told of it, too.

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
        """How fast the arm is led, in (0, 1] of full speed; it may be changed at every step.

        A smaller number slows the path of a ``PathFollower`` down, and the way of a ``GoTo`` or a
        ``TargetFollower`` by as much, an operator's twist included. Targets that the user's own clock gives
        to ``step`` are not changed by it.
        """
        return self._configuration.speed

    @speed.setter
    @guarded("speed")
    def speed(self, share: float) -> None:
        if not 0.0 < positive("speed", share) <= 1.0:
            raise InputError(f"speed is {share:g}, expected a share of full speed in (0, 1]")
        self._change(lambda told: replace(told, speed=float(share)))

    def _believe(self, fault: Fault) -> None:
        """Believe a fault that the detector has found, and let it look at the other joints."""
        response = self._parts.response
        self._change(
            lambda told: replace(told, belief=told.belief.reported(fault)),
            response and partial(response.believed, fault),
        )

    def _disbelieve(self, joint: str | int) -> None:
        """Believe that a joint is healthy, as the detector has found."""
        self._change(lambda told: replace(told, belief=told.belief.without(joint)))

    @property
    def _configuration(self) -> Configuration:
        """What the planner was told last, by the number that its record was written with."""
        return self._known[int(self._number[0])]

    def _change(
        self, change: Callable[[Configuration], Configuration], then: Callable[[], None] | None = None
    ) -> None:
        """Tell the planner something else: all is worked out first, then one compiled call writes it."""
        written = False
        while not written:
            self._apply()
            before = self._configuration
            after = replace(change(before), number=next(NUMBERS), then=then)
            draft = Draft.taken(self._parts.arm)
            changes = self._worked_out(before, after, draft)
            write = write_call(changes)
            self._known[after.number] = after
            self._begin = None  # until its parts have followed, steps look at what the planner was told
            # as one expression: no signal handler comes between the look and the call
            written = self._number[0] == before.number and write() == 0
            draft.give_back()
            self._known.pop((before if written else after).number, None)
        self._apply()

    def _worked_out(self, before: Configuration, after: Configuration, draft: Draft) -> list[tuple[Any, Any]]:
        """What makes the record that of another configuration, its number included."""
        changes = [(self._number, np.array([after.number]))]
        if not after.tells_as(before):
            if before.arm is not after.arm:
                self._out.fill_in()  # steps that are kept stay with the arm that they had
            draft.begin(self._session, self._parts.arm, self._parts.orders)
            after.tell(draft.K, draft.orders, before)
            if draft.K.state.is_reset:
                for i in after.weakened(before):
                    self._loop.find_overload(i, draft.K, draft.orders)
            changes += draft.changes
        if after.speed != before.speed:
            changes.append((self._session.field("feedback", "speed"), np.array([after.speed])))
        return changes

    def _apply(self) -> None:
        """Let the planner's parts follow what it was told as far as they have not; begun, it begins again."""
        while self._applied is not self._configuration:
            before, told = self._applied, self._configuration
            if before is not None and before.arm is not told.arm:
                for stage in self._parts.stages:
                    if stage.mount is not None:
                        stage.mount(told.arm.robot)
            if before is None or before.belief is not told.belief:
                for stage in self._parts.stages:
                    if stage.believe is not None:
                        stage.believe(told.belief)
                self._tick, self._fast = self._parts.ticks()
            if before is not None and before.speed != told.speed:
                self._loop.speed = told.speed
            if told.start is not None and (before is None or before.start is not told.start):
                for stage in self._parts.stages:
                    if stage.begin is not None:
                        stage.begin(told.start[0], told.arm.robot, told.belief)
            if told.then is not None:
                told.then()
            self._applied = told
        self._begin = self._fast

    def stop(self) -> None:
        """Brake every healthy joint from the next step on and hold it, until ``resume`` or ``reset``."""
        self._loop.stop()

    def resume(self) -> bool:
        """Go on from where the arm is after a stop, with the task as it is now.

        Returns:
            Whether the planner goes on; it does not while a lost sensor forbids it, and needs ``reset``.
        """
        goes_on = self._loop.resume()
        if goes_on and self._parts.response is not None:
            self._parts.response.go_on()
        return goes_on

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
            target: Where the tip should be now; or ``targets.at(k)`` of a whole trajectory; or a table of
                targets by task, ``{"tip": target, "elbow": position}``, in which a task that is left out
                keeps its last one.
            _: Nothing; what follows is given by name.
            tau: Measured torque, (nv,) [N m or N]; it is checked to be finite.
            tip: Measured pose of the tip, (4, 4), in place of the one of forward kinematics.
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
            except (AttributeError, TypeError, ValueError, OverflowError) as error:
                if isinstance(target, Mapping):
                    return self.step(q, v, self._parts.tasks.distributed(target))
                raise not_a_target(target) from error
            if 0 <= code < NEWS:
                self._said.code = code
                if code == RELAXED or self._rest.held:
                    self._rest.tell(self._out)
                return self._out
            if code >= NEWS:
                self._parts.respond()
                self._said.code = code - NEWS
                return self._out
        if isinstance(target, Mapping):
            target = self._parts.tasks.distributed(target)
        if _ is not None or not isinstance(target, Target | Targets) or not is_row(target.row):
            raise not_a_target(target, _)
        return self._led(None, q, v, (target.packed, target.row), tau, tip, ticks=ticks)

    def ways_out(self, home: Any = None) -> tuple[WayOut, ...]:
        """Where the arm can go from here with the joints that work, tried in thought, what is clear first.

        It takes some 0.05 s; ``ftqp.GoTo(planner, way=...)`` goes one. Source: docs/theory/ways-out.md.

        Args:
            home: Where the arm belongs, (nv,) [rad or m]; None is ``posture``, or the robot's neutral one.

        Raises:
            InputError: There was no ``reset``, home has a wrong shape, or the robot floats.
        """
        return ways_out(
            self, Planner, None if self._parts.remembered is None else self._parts.remembered.q, home
        )

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
            meant: Where the tip is meant to be meanwhile, (4, 4), for errors and statuses; None: as led.

        Raises:
            InputError: They do not go together.
        """
        tick, path = self._parts.led_tick(leader), leader if leader.kind == "path" else None

        def step(q: Any, v: Any, target: tuple[Any, ...], tau: Any, tip: Any) -> Step:
            out = self._led(tick, q, v, target, tau, tip, path)
            return out if meant is None else with_error_to(self._session.K, self._said, out, meant)

        return Lead(step, self._session, leader, self._parts.orders.give_up)

    def blocks(self) -> Blocks | None:
        """The planner's ticks in closed loop without Python between them, for simulations.

        None where a foreign solver or a clock takes part in every tick.
        """
        self._apply()
        return Blocks(self._session, self._tick, self.robot) if self._parts.is_compiled else None

    @guarded("step")
    def _led(
        self,
        tick: Any,
        q: Any,
        v: Any,
        target: tuple[Any, ...],
        tau: Any,
        tip: Any,
        path: Memory | None = None,
        ticks: int = 1,
    ) -> Step:
        """A step of any leader, None the clock, with measured torques or tip, converted arrays and times."""
        self._apply()
        self._begin = None  # so that another thread's step comes here, too, where it is refused
        # a joint that swings freely leads in the place of a path, which stands
        if path is not None and self._parts.free is not None and self._parts.free.leads:
            held = self._parts.free.held_target(path)
            if held is not None:
                tick, target = None, (held, 0)
        tick = self._tick if tick is None else tick
        began = now() if self._given.timing else 0
        v = self._at_rest if v is None else v
        if ticks != 1:
            made_up_for(self._parts.orders, tick, target, whole_ticks(ticks), self._at_rest)
        if self._parts.response is not None:
            self._parts.response.feel(tau)
        if tau is None and tip is None:
            code = converted_tick(tick, q, v, target)
        else:
            code = measured_tick(self._session, tick, q, v, target, tau, tip)
        if code < 0:
            raise mistake(code, q, v, self.robot.nv, self.robot.nq)
        if code >= NEWS:
            self._parts.respond()
            code -= NEWS
        out, said = self._out, self._said
        said.code = code
        if code == RELAXED or self._rest.held:
            self._rest.tell(out)
        if self._given.timing:
            said.duration = (now() - began) * 1e-9
        self._begin = self._fast
        return out

    def _refuse_looking_ahead(self) -> None:
        """Refuse at once what ``n_minus_one`` would refuse when it looks ahead."""
        try:
            self._what_ifs()
        except InputError as error:
            raise InputError(
                f"n_minus_one looks ahead in a batch: {error}; or leave n_minus_one out"
            ) from error

    def what_ifs(self) -> RolloutSetup:
        """What other arms like this one would begin with, for ``ftqp.batch``; nothing here changes.

        Raises:
            InputError: A foreign solver, or a plan.
        """
        if not self._session.K.state.is_reset:
            self._parts.tasks.refuse_without_target()
        return self._what_ifs()

    def _what_ifs(self) -> RolloutSetup:
        told = self._configuration
        return self._parts.what_ifs(self.robot, self.faults, told.reserve)

    @property
    def security(self) -> Security | None:
        """What the lock of each joint would cost, as it was looked at last; None without ``n_minus_one``."""
        return None if self._parts.watch is None else self._parts.watch.security

    def foresee(self, path: Path | None, at: float = 0.0) -> None:
        """Say what the tip will follow, for ``n_minus_one``; a ``PathFollower`` says it by itself.

        Args:
            path: What it follows by the clock; None goes on with the target's twist.
            at: The time of the path at the next step [s].
        """
        if self._parts.watch is not None:
            self._parts.watch.foresee(path, at)

    def deployable(self) -> Deployable:
        """What this planner is without Python, for ``ftqp build``; nothing here changes.

        Raises:
            InputError: A foreign solver, a network, a closed form, a plan, further tasks, functions in
                Python, a cloud of balls, or faults that it already believes in.
        """
        self._apply()
        return self._parts.deployable(self._configuration.belief, self._configuration.reserve)

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a Planner owns memory and perhaps a foreign solver, and is neither copied nor pickled; make "
            "another with the same arguments, and keep a step with step.copy()"
        )
