"""Planner: one arm, one task, one QP a tick."""

from collections.abc import Mapping, Sequence
from pathlib import Path as File
from typing import Any, NoReturn

import numpy as np

from ftqp.control.drive.joint_drive import Drive, Noise
from ftqp.control.planner.arm_loop import ArmLoop
from ftqp.control.planner.braking_reserve import braking_reserve
from ftqp.control.planner.closed_loop import Blocks
from ftqp.control.planner.constraint_list import (
    Constraint,
    Constraints,
    asked_of,
    listed,
    need_a_qp,
    refuse_without_effect,
)
from ftqp.control.planner.degrading import Degrading
from ftqp.control.planner.filling import filled
from ftqp.control.planner.free_joint import FreeJoint
from ftqp.control.planner.given_arrays import converted_tick, is_row, measured_tick, mistake, not_a_target
from ftqp.control.planner.late_ticks import made_up_for, whole_ticks
from ftqp.control.planner.lead import Lead, judged_by
from ftqp.control.planner.leading_plan import LeadingPlan, PlanLeading, Remaining
from ftqp.control.planner.one_thread import OneThread, guarded
from ftqp.control.planner.order_book import orders_of
from ftqp.control.planner.planner_copies import PlannerCopies
from ftqp.control.planner.response.fault_response import FaultResponse
from ftqp.control.planner.response.probing import probing_of
from ftqp.control.planner.settings import settled
from ftqp.control.planner.solver.qp_solver import IN_KERNEL, Solver
from ftqp.control.planner.stages import CLOCK, FREE, Tick, staged
from ftqp.control.planner.start import Rest, StartWatch
from ftqp.control.planner.step import Step
from ftqp.control.planner.step_parts import Said
from ftqp.control.planner.surroundings import Surroundings, clearance_rows, refuse_moving_base
from ftqp.control.planner.target import Target, Targets
from ftqp.control.planner.task_list import TaskList, held_rows, split
from ftqp.control.planner.wanted import Fitting, Wanted
from ftqp.control.planner.ways.n_minus_one import NMinusOne
from ftqp.control.planner.ways.remembered import remembered
from ftqp.control.planner.ways.security_watch import SecurityWatch, refuse_led, scheme_led
from ftqp.control.planner.ways.way_out import WayOut, ways_out
from ftqp.control.scene.keeping_clear import Clearance
from ftqp.control.scene.placed_shapes import Scene
from ftqp.control.task.bounds import Bounds
from ftqp.control.task.compatibility import refuse
from ftqp.control.task.resolvers import Resolver
from ftqp.control.task.scheme import Scheme
from ftqp.control.task.soft_tasks import SoftTask
from ftqp.control.task.task import EmergencyStop, Task
from ftqp.core.checks import FloatArray, instance
from ftqp.core.clock import now
from ftqp.core.errors import InputError
from ftqp.faults.belief import Belief
from ftqp.faults.detection.detector import Detector
from ftqp.kernel.entry.session import BaseMemory, JointsMemory, PathMemory
from ftqp.kernel.layout.enums import RELAXED
from ftqp.kernel.layout.rows import CLEARANCE, HOLD
from ftqp.model.robot import Robot
from ftqp.qp.adapters.backend import Backend


class Planner(PlannerCopies):
    """Redundancy resolution, one QP a tick, with failed joints as bounds.

    Args:
        robot: The arm, of at most 64 joints with finite acceleration limits.
        dt: The sampling period [s]. A longer one needs smaller gains, and braking begins earlier.
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
        detector: Looks for failures that nobody reports, and makes the planner believe them; None is none.
        plan: One of ``ftqp.analysis.plan`` or ``load_plan``: its postures lead the null space, in the place
            of ``posture``; the scheme is ``rmp`` unless another is named.
        tasks: That of the tip, if it is not given as ``task``, as ``ftqp.Task`` or as a ``PoseTask`` or
            ``PositionTask`` of its frame, and up to 8 of further frames and joints, ``PoseTask``,
            ``RelativeTask`` and others. Those on level 0 go before it, those on level 1 are as firm as it,
            and the others share what these leave of the arm's freedom, as their weights say.
        remember: For how long the way that the joints have come is kept for ``ways_out``, > 0 [s], the time
            not counted in which they stand; longer is coarser. None keeps none, and costs nothing.
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

    __slots__ = ("_at_rest", "_free", "_ordinary", "_remembered", "_rest", "_said", "_timing")

    def __init__(
        self,
        robot: Robot,
        dt: float = 1e-3,
        *,
        level: str = "acceleration",
        scheme: Scheme | Resolver | str | Mapping[str, Any] | None = None,
        task: Task | None = None,
        bounds: Bounds | str | Mapping[str, Any] = "viability",
        backend: str | File | Mapping[str, Any] | Backend = IN_KERNEL,
        posture: Any = None,
        torque_limits: bool = True,
        emergency: EmergencyStop | None = EmergencyStop(),  # noqa: B008  frozen
        timing: bool = False,
        branch_limits: Mapping[str | int, Any] | None = None,
        drive: Drive | str | Mapping[str, Any] = "position",
        noise: Noise | None = None,
        detector: Detector | None = None,
        plan: LeadingPlan | None = None,
        tasks: Sequence[Task | SoftTask] | None = None,
        constraints: Sequence[Constraint] | None = None,
        scene: Scene | None = None,
        clearance: Clearance | None = None,
        remember: float | None = None,
        n_minus_one: NMinusOne | None = None,
    ) -> None:
        instance("n_minus_one", n_minus_one, NMinusOne | None, "an ftqp.NMinusOne or None")
        scheme = scheme_led(scheme, plan, n_minus_one)
        instance("detector", detector, Detector | None, "an ftqp.Detector or None")
        task, soft, first = split(getattr(robot, "tip", None), task, tasks)
        given_constraints = listed(constraints)
        instance("scene", scene, Scene | None, "an ftqp.Scene or None")
        instance("clearance", clearance, Clearance | None, "an ftqp.Clearance or None")
        keeps_clear = scene is not None or clearance is not None
        asked = {
            **asked_of(given_constraints),
            HOLD.name: held_rows(soft),
            CLEARANCE.name: clearance_rows(keeps_clear),
        }
        given = self._given = settled(
            robot, dt, level=level, scheme=scheme, task=task, bounds=bounds, backend=backend, posture=posture,
            torque_limits=torque_limits, emergency=emergency, branch_limits=branch_limits, drive=drive,
            noise=noise, plan=plan,
        )  # fmt: skip
        robot, self._inside = given.robot, OneThread()
        refuse_without_effect(given_constraints, robot, torque_limits)
        self._session = filled(
            robot, given.task, given.criterion, given.bounds, emergency,
            level=level, dt=given.dt, drive=given.drive, noise=given.noise, asked=asked,
        )  # fmt: skip
        self._solver = Solver(self._session, robot, given.task, given.scheme, given.solver, bool(soft))
        if not self._solver.has_qp:
            robot.refuse_floating(f"scheme {given.scheme.name!r}, which solves no QP, needs")
        if (soft or keeps_clear or need_a_qp(given_constraints)) and not self._solver.has_qp:
            raise InputError(
                f"scheme {given.scheme.name!r} solves no QP, so that further tasks, constraints and a scene "
                "have no effect on it; take one that does, for example 'mvn'"
            )
        self._orders = orders_of(self._session, given, self._solver)
        self._surroundings = None
        if keeps_clear:
            self._surroundings = Surroundings(self._session, robot, scene, clearance or Clearance())
        length = float(self._session.K.task.length)
        self._tasks = TaskList(self._session, robot, soft, level, given.dt, length, first)
        self._wanted = Wanted(
            Belief(robot),
            Fitting(robot),
            braking_reserve(robot) if given.limits_torque else None,
        )
        self._adopted, self._step_arm = None, self._wanted.fitting
        self._said = Said(int(self._session.K.cascade.status))
        self._out, self._loop = (
            Step(
                self._session,
                robot.joints,
                self._said,
                self._tasks.named(asked, self._surroundings, given.task),
            ),
            ArmLoop(self._session, self._orders, robot.joints, self._surroundings),
        )
        self._constraints = Constraints(self._session, robot, given_constraints, self._loop.stop)
        degrading = Degrading(self._session, given.task.kept_sets)
        self._rest, self._timing = Rest(self._session, degrading, robot), timing
        self._at_rest = np.zeros(robot.nv)
        self._free = FreeJoint(self._session, robot) if self._solver.has_qp else None
        self._leading = None if given.plan is None else PlanLeading(given.plan, self._session, robot)
        self._fault_response = None
        if detector is not None:
            self._fault_response = FaultResponse(
                detector, self._session, robot, given.drive, given.noise, self._loop, self._believe,
                self._disbelieve, probing_of(self._session, given, detector),
            )  # fmt: skip
        self._remembered = remembered(self._session, robot.nv, remember, given.dt)
        self._watch = None
        if n_minus_one is not None:
            refuse_led(n_minus_one, given.criterion, given.scheme.name, plan)
            self._watch = SecurityWatch(n_minus_one, self._session, robot, given.dt, self.what_ifs)
        parts = (
            self._watch, self._tasks, self._constraints, self._solver, self._leading, degrading, self._free,
            self._fault_response, self._surroundings, self._remembered,
            StartWatch(self._session.K, None if self._surroundings is None else self.distances),
        )  # fmt: skip
        self._stages = tuple(part.stage for part in parts if part is not None)
        self._ordinary = self._solver.tick(CLOCK)
        self._heal()
        if n_minus_one is not None:
            self._refuse_looking_ahead()

    def _ticks(self) -> tuple[Tick, Tick | None]:
        free = None if self._free is None else self._free.tick
        if free is not None:
            return staged(free, FREE, self._stages), None
        tick = staged(self._ordinary, CLOCK, self._stages)
        alone = tick is self._ordinary and self._solver.is_compiled and not self._timing
        return tick, tick if alone else None

    def stop(self) -> None:
        """Brake every healthy joint from the next step on and hold it, until ``resume`` or ``reset``."""
        self._loop.stop()

    def resume(self) -> bool:
        """Go on from where the arm is after a stop, with the task as it is now.

        Returns:
            Whether the planner goes on; it does not while a lost sensor forbids it, and needs ``reset``.
        """
        goes_on = self._loop.resume()
        if goes_on and self._fault_response is not None:
            self._fault_response.go_on()
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
                    return self.step(q, v, self._tasks.distributed(target))
                raise not_a_target(target) from error
            if code >= 0:
                self._said.code = code
                if code == RELAXED or self._rest.held:
                    self._rest.tell(self._out)
                return self._out
        if isinstance(target, Mapping):
            target = self._tasks.distributed(target)
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
        return ways_out(self, Planner, None if self._remembered is None else self._remembered.q, home)

    def options(self) -> tuple[Remaining, ...]:
        """What can still be done after faults, least lost first; without a plan the clear ``ways_out()``.

        With one, of its path: all of it, with fewer rows, a part of it, the way back, and to stop. A plan is
        looked ahead on without constraints: a planner that has some answers as one without a plan.
        """
        if self._leading is None or self._constraints:
            return tuple(way.remaining for way in self.ways_out() if way.clear or way.kind == "stop")
        q = self._session.K.state.q_command[: self.robot.nv].copy()
        return self._leading.options(q, self.faults)

    def lead(self, leader: PathMemory | BaseMemory | JointsMemory, meant: FloatArray | None = None) -> Lead:
        """The planner's ticks led by a path's progress, an inertial target or a motion of the joints.

        Args:
            leader: The memory of the path, the base or the motion; it stays the leader's own.
            meant: Where the tip is meant to be meanwhile, (4, 4), for errors and statuses; None: as led.

        Raises:
            InputError: They do not go together.
        """
        kind = {PathMemory: "path", BaseMemory: "base", JointsMemory: "joints"}[type(leader)]
        refuse(leader=kind, level=self.level, mode=self.task.mode)
        refuse_moving_base(kind, self._surroundings)
        tick = staged(self._solver.tick(kind, *leader.arguments()), kind, self._stages)
        path = leader if isinstance(leader, PathMemory) else None

        def step(q: Any, v: Any, target: tuple[Any, ...], tau: Any, tip: Any) -> Step:
            out = self._led(tick, q, v, target, tau, tip, path)
            return out if meant is None else judged_by(self._session.K, self._said, out, meant)

        return Lead(step, self._session, leader, self._orders.give_up)

    def blocks(self) -> Blocks | None:
        """The planner's ticks in closed loop without Python between them, for simulations.

        None where a foreign solver or a clock takes part in every tick.
        """
        self._heal()
        whole = self._solver.is_compiled and not self._timing and not self._asking
        return Blocks(self._session, self._tick, self.robot) if whole else None

    @guarded("step")
    def _led(
        self,
        tick: Any,
        q: Any,
        v: Any,
        target: tuple[Any, ...],
        tau: Any,
        tip: Any,
        path: PathMemory | None = None,
        ticks: int = 1,
    ) -> Step:
        """A step of any leader, None the clock, with measured torques or tip, converted arrays and times."""
        self._heal()
        self._begin = None  # so that another thread's step comes here, too, where it is refused
        # a joint that swings freely leads in the place of a path, which stands
        if path is not None and self._free is not None and self._free.leads:
            held = self._free.held_target(path)
            if held is not None:
                tick, target = None, (held, 0)
        tick = self._tick if tick is None else tick
        began = now() if self._timing else 0
        v = self._at_rest if v is None else v
        if ticks != 1:
            made_up_for(self._orders, tick, target, whole_ticks(ticks), self._at_rest)
        if self._fault_response is not None:
            self._fault_response.feel(tau)
        if tau is None and tip is None:
            code = converted_tick(tick, q, v, target)
        else:
            code = measured_tick(self._session, tick, q, v, target, tau, tip)
        if code < 0:
            raise mistake(code, q, v, self.robot.nv, self.robot.nq)
        out, said = self._out, self._said
        said.code = code
        if code == RELAXED or self._rest.held:
            self._rest.tell(out)
        if self._timing:
            said.duration = (now() - began) * 1e-9
        self._begin = self._fast
        return out

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a Planner owns memory and perhaps a foreign solver, and is neither copied nor pickled; make "
            "another with the same arguments, and keep a step with step.copy()"
        )
