"""Planner: one arm, one task, one QP a tick."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ftqp.control.drive.drive import Drive
from ftqp.control.drive.noise import Noise
from ftqp.control.planner.arm_loop import ArmLoop
from ftqp.control.planner.braking_reserve import braking_reserve, count_on
from ftqp.control.planner.closed_loop import Blocks
from ftqp.control.planner.degrading import Degrading
from ftqp.control.planner.filling import filled
from ftqp.control.planner.fitting import Fitting, warn_of_weight
from ftqp.control.planner.free_joint import FreeJoint
from ftqp.control.planner.given_arrays import converted_tick, measured_tick, mistake, not_a_target
from ftqp.control.planner.lead import Lead
from ftqp.control.planner.leading_plan import LeadingPlan
from ftqp.control.planner.plan_leading import PlanLeading
from ftqp.control.planner.planner_facts import PlannerFacts
from ftqp.control.planner.probing import probing_of
from ftqp.control.planner.rest_log import Rest
from ftqp.control.planner.settings import settled
from ftqp.control.planner.solver.qp_solver import IN_KERNEL, Solver
from ftqp.control.planner.start import StartWatch
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target, Targets
from ftqp.control.planner.vigilance import Vigilance
from ftqp.control.planner.what_ifs import WhatIfs
from ftqp.control.task.bounds import Bounds
from ftqp.control.task.compatibility import refuse
from ftqp.control.task.emergency import EmergencyStop
from ftqp.control.task.resolvers import Resolver
from ftqp.control.task.scheme import Scheme
from ftqp.control.task.task import Task
from ftqp.core.checks import array, instance
from ftqp.core.clock import now
from ftqp.core.errors import InputError
from ftqp.faults.belief import Belief
from ftqp.faults.detection.detector import Detector
from ftqp.faults.kinds import Fault
from ftqp.kernel.entry.session import BaseMemory, JointsMemory, PathMemory
from ftqp.kernel.layout.enums import RELAXED
from ftqp.kernel.layout.record import load_chain
from ftqp.model.payload import Payload
from ftqp.model.robot import Robot
from ftqp.qp.adapters.backend import Backend


class Planner(PlannerFacts):
    """Redundancy resolution, one QP a tick, with failed joints as bounds.

    Args:
        robot: The arm, of at most 32 joints with finite acceleration limits.
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

    Raises:
        InputError: A parameter is wrong, or two of them exclude each other.
        ModelError: The robot cannot be driven safely.
    """

    def __init__(
        self,
        robot: Robot,
        dt: float = 1e-3,
        *,
        level: str = "acceleration",
        scheme: Scheme | Resolver | str | Mapping[str, Any] | None = None,
        task: Task | None = None,
        bounds: Bounds | str | Mapping[str, Any] = "viability",
        backend: str | Path | Mapping[str, Any] | Backend = IN_KERNEL,
        posture: Any = None,
        torque_limits: bool = True,
        emergency: EmergencyStop | None = EmergencyStop(),  # noqa: B008  frozen
        timing: bool = False,
        branch_limits: Mapping[str | int, Any] | None = None,
        drive: Drive | str | Mapping[str, Any] = "position",
        noise: Noise | None = None,
        detector: Detector | None = None,
        plan: LeadingPlan | None = None,
    ) -> None:
        instance("detector", detector, Detector | None, "an ftqp.Detector or None")
        given = self._given = settled(
            robot, dt, level=level, scheme=scheme, task=task, bounds=bounds, backend=backend, posture=posture,
            torque_limits=torque_limits, emergency=emergency, branch_limits=branch_limits, drive=drive,
            noise=noise, plan=plan,
        )  # fmt: skip
        self.robot = robot = given.robot
        self.dt, self.level, self.task, self.scheme = given.dt, given.level, given.task, given.scheme
        self.bounds, self.emergency, self.posture = given.bounds, given.emergency, given.posture
        self.drive, self.noise = given.drive, given.noise
        self._fitting, self._start = Fitting(robot), StartWatch()
        self._session = filled(
            robot, self.task, given.criterion, self.bounds, emergency,
            level=level, dt=self.dt, drive=self.drive, noise=self.noise,
        )  # fmt: skip
        self._solver = Solver(self._session, robot, self.task, self.scheme, given.solver)
        self._belief = Belief(
            robot, self._session.K.limits, self._session.K.faults, torque_limits=given.limits_torque
        )
        self._reserve = braking_reserve(robot) if given.limits_torque else None
        self._out, self._loop = Step(self._session, robot.joints), ArmLoop(self._session, robot.joints)
        self._rest, self._timing = Rest(self._session), timing
        self._at_rest = np.zeros(robot.nv)
        self._ordinary = self._solver.tick("clock"), None if timing else self._solver.direct("clock")
        self._free: FreeJoint | None = None
        degrades = self.task.degrade is not None and self._solver.sizes_may_change
        self._degrading = Degrading(self._session, self.task.kept_sets) if degrades else None
        self._leading = None if given.plan is None else PlanLeading(given.plan, self._session, robot)
        self._vigilance: Vigilance | None = None
        if detector is not None:
            self._vigilance = Vigilance(
                detector, self._session, robot, self.drive, self.noise, self._loop, self._believe,
                self._disbelieve, probing_of(self._session, given, detector),
            )  # fmt: skip
        for part in (self._degrading, self._leading, self._vigilance):
            if part is not None:
                tick = part.watched(self._ordinary[0])
                self._ordinary = tick, None if timing else tick
        self._adopt_belief()

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
        K, n = self._session.K, self.robot.nv
        q = self.robot.angles(q)
        v = np.zeros(n) if v is None else array("v", v, (n,), "(nv,)")
        state = K.state
        K.gate.q[:n] = state.q_command[:n] = state.q[:n] = q
        K.gate.sent[:n] = q + K.gate.lead * v
        K.gate.v[:n] = state.v_command[:n] = state.v[:n] = v
        state.a_command[:n] = 0.0
        K.criteria.posture[:n] = q if self.posture is None else self.posture
        if self._leading is not None:
            self._leading.begin(q, self.faults)
        self._loop.forget()
        K.qp.warm, state.ticks, state.is_reset = 0, 0, 1
        self._solver.forget()
        if self._degrading is not None:
            self._degrading.restore()
        if self._free is not None:
            self._free.restore()
        self._start.look(self.robot, K, q)
        if self._vigilance is not None:
            self._vigilance.reset(q)

    def stop(self) -> None:
        """Brake every healthy joint from the next step on and hold it, until ``resume`` or ``reset``."""
        self._loop.stop()

    def resume(self) -> bool:
        """Go on from where the arm is after a stop, with the task as it is now.

        Returns:
            Whether the planner goes on; it does not while a lost sensor forbids it, and needs ``reset``.
        """
        goes_on = self._loop.resume()
        if goes_on and self._vigilance is not None:
            self._vigilance.go_on()
        return goes_on

    def step(self, q: Any, v: Any = None, target: Any = None, *, tau: Any = None, tip: Any = None) -> Step:
        """The command for the next ``dt``.

        Args:
            q: Measured configuration, (nv,) joint values or (nq,) [rad or m]. Arrays are copied, and nothing
                of them is remembered.
            v: Measured velocity, (nv,) [rad/s or m/s], or None: the planner observes it from q, and looks at
                a given one only to see whether it is finite.
            target: Where the tip should be now; or ``targets.at(k)`` of a whole trajectory.
            tau: Measured torque, (nv,) [N m or N]; it is checked to be finite.
            tip: Measured pose of the tip, (4, 4), in place of the one of forward kinematics.

        Returns:
            The planner's own step, valid until the next one.

        Raises:
            InputError: A wrong shape or type, a position target for a task with rotation rows, or no
                ``reset`` before. What the world does (NaN, an infeasible task, a failing solver) never
                raises: see ``step.status``.
        """
        if tau is None and tip is None and self._begin is not None:
            try:
                code = self._begin(q, self._at_rest if v is None else v, target.packed, target.row)
            except AttributeError as error:
                raise not_a_target(target) from error
            if code >= 0:
                self._out.code = code
                if code == RELAXED or self._rest.held:
                    self._rest.tell(self._out)
                return self._out
        if not isinstance(target, Target | Targets):
            raise not_a_target(target)
        return self._led(self._tick, q, v, (target.packed, target.row), tau, tip)

    def what_ifs(self) -> WhatIfs:
        """What other arms like this one would begin with, for ``ftqp.batch``; nothing here changes.

        Raises:
            InputError: A foreign solver, a plan, or a task that gives rows up.
        """
        return WhatIfs(self._session, self.robot, self._given, self._solver, self._reserve, self.faults)

    def lead(self, leader: PathMemory | BaseMemory | JointsMemory) -> Lead:
        """The planner's ticks led by a path's progress, an inertial target or a motion of the joints.

        Args:
            leader: The memory of the path, the base or the motion; it stays the leader's own.
        """
        kind = {PathMemory: "path", BaseMemory: "base", JointsMemory: "joints"}[type(leader)]
        refuse(leader=kind, level=self.level, mode=self.task.mode)
        tick = self._solver.tick(kind, *leader.arguments())
        for part in (self._leading, self._vigilance):
            tick = tick if part is None else part.watched(tick)

        def step(q: Any, v: Any, target: tuple[Any, ...], tau: Any, tip: Any) -> Step:
            if self._free is not None and self._free.leads and isinstance(leader, PathMemory):
                held = self._free.held_target(leader)
                if held is not None:
                    return self._led(self._tick, q, v, (held, 0), tau, tip)
            return self._led(tick, q, v, target, tau, tip)

        return Lead(step, self._session, leader)

    def blocks(self) -> Blocks | None:
        """The planner's ticks in closed loop without Python between them, for simulations.

        None where a foreign solver or a clock takes part in every tick.
        """
        return None if self._begin is None else Blocks(self._session, self._begin, self.robot)

    def _led(self, tick: Any, q: Any, v: Any, target: tuple[Any, ...], tau: Any, tip: Any) -> Step:
        """A step of any leader, with measured torques or tip, converted arrays and the clock."""
        began = now() if self._timing else 0
        v = self._at_rest if v is None else v
        if self._vigilance is not None:
            self._vigilance.feel(tau)
        if tau is None and tip is None:
            code = converted_tick(tick, q, v, target)
        else:
            code = measured_tick(self._session, tick, q, v, target, tau, tip)
        if code < 0:
            raise mistake(code, q, v, self.robot.nv, self.robot.nq)
        out = self._out
        out.code = code
        if code == RELAXED or self._rest.held:
            self._rest.tell(out)
        if self._timing:
            out.duration = (now() - began) * 1e-9
        return out

    def report(self, fault: Fault) -> None:
        """Believe ``fault`` from the next step on, of any kind in ``ftqp.faults.kinds.KINDS``.

        Args:
            fault: The fault; it takes the place of another one of the same joint.

        Raises:
            InputError: An unknown joint, or not a fault.
        """
        self._believe(fault)
        if self._vigilance is not None:
            self._vigilance.told(fault)

    def _believe(self, fault: Fault) -> None:
        """Believe a fault, and let the detector look at the other joints."""
        self._belief.report(fault)
        self._adopt_belief()
        if self._vigilance is not None:
            self._vigilance.detector.believe(fault)

    def withdraw(self, joint: str | int) -> None:
        """Believe the joint to be healthy again from the next step on.

        Args:
            joint: Its name or 0-based index; one that is healthy stays so.

        Raises:
            InputError: An unknown joint.
        """
        self._disbelieve(joint)
        if self._vigilance is not None:
            self._vigilance.forget(joint)

    def _disbelieve(self, joint: str | int) -> None:
        """Believe that a joint is healthy."""
        self._belief.withdraw(joint)
        self._adopt_belief()

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
        self._fit(self._fitting.carrying(payload))
        limits, n = self._session.K.limits, self.robot.nv
        if self._given.limits_torque:
            self._reserve = braking_reserve(self.robot)
            self._adopt_reserve()
        if payload is not None:
            state = self._session.K.state
            warn_of_weight(self.robot, state.q_command[:n] if state.is_reset else None, limits.tau_max[:n])

    def tool(self, T: Any) -> None:
        """Control another point from the next step on; targets are then poses of that point.

        State, faults and the solver's memory stay, and so do masses: a tool that weighs something is a
        payload, too. A target that is not moved along with the point is somewhere else for the arm.

        Args:
            T: Pose of the point in the frame of the robot's own tip, (4, 4) [m]; None is that tip.

        Raises:
            InputError: T is no pose, or a plan leads the planner, which is one of its own tip.
        """
        if self._leading is not None:
            raise InputError("the planner follows a plan of another tip; plan for robot.with_tip(T) instead")
        self._fit(self._fitting.holding(T))

    def _fit(self, robot: Robot) -> None:
        """Let the kernel see another arm of the same joints."""
        self._out.leave_arm()
        self.robot = robot
        load_chain(self._session.K, **robot.chain.constants())
        if self._vigilance is not None:
            self._vigilance.detector.fit(robot)

    def _adopt_belief(self) -> None:
        """What follows from the belief: dynamics, braking reserve, a cold start, a new look at rest."""
        K = self._session.K
        K.limits.dynamic = self._given.dynamic or self._belief.needs_dynamics
        self._adopt_reserve()
        K.qp.warm = K.watch.stopped = 0
        self._solver.forget()
        if self._leading is not None and K.state.is_reset:
            self._leading.believe(K.state.q_command[: self.robot.nv].copy(), self.faults)
        self._tick, self._begin = self._ordinary
        if self._belief.needs_dynamics and self._solver.has_qp:
            if self._free is None:
                self._free = FreeJoint(self._session, self.robot, self.task.kept_sets)
            self._free.begin()
            self._tick = self._free.tick
            if self._vigilance is not None:
                self._tick = self._vigilance.watched(self._tick)
            self._begin = None if self._timing else self._tick
        elif self._free is not None:
            self._free.end()

    def _adopt_reserve(self) -> None:
        """The deceleration that viability counts on, and when torque limits are looked at."""
        given, K = self._given, self._session.K
        on_demand = given.on_demand and not self._belief.needs_dynamics
        count_on(self._reserve, K.limits, self.robot.nv, level=given.level, on_demand=on_demand)

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a Planner owns memory and perhaps a foreign solver, and is neither copied nor pickled; make "
            "another with the same arguments, and keep a step with step.copy()"
        )
