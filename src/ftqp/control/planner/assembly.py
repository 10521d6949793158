"""What a planner is made of: its record, filled in once, and the parts that take part in its life."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ftqp.control.drive.joint_drive import Drive, Noise
from ftqp.control.drive.servo_prior import FALSE_ALARMS, fill_loop
from ftqp.control.planner.arm_loop import ArmLoop
from ftqp.control.planner.collision_model import CollisionModel, clearance_rows
from ftqp.control.planner.constraint_list import Constraints, row_names
from ftqp.control.planner.filled_rows import refuse_asking
from ftqp.control.planner.free_joint import KEPT_OF, FreeJoint
from ftqp.control.planner.leading_plan import PlanLeading
from ftqp.control.planner.monitored import MonitorResponse
from ftqp.control.planner.qp_solver import Solver
from ftqp.control.planner.rollout_setup import RolloutSetup
from ftqp.control.planner.settings import LEVELS, Settings
from ftqp.control.planner.stages import CLOCK, FREE, Stage, Tick, staged
from ftqp.control.planner.start import Rest, StartWatch, allow
from ftqp.control.planner.step import Step, parts_in, parts_of_free
from ftqp.control.planner.step_parts import StepHeader
from ftqp.control.planner.task_list import TaskList, held_rows
from ftqp.control.planner.ways.security_watch import SecurityWatch
from ftqp.control.planner.ways.way_out import Remembered
from ftqp.control.scene.placed_shapes import Clearance
from ftqp.control.task.bounds import Bounds, Jin
from ftqp.control.task.compatibility import refuse
from ftqp.control.task.keep import Keep
from ftqp.control.task.task import (
    MODES,
    PRIORITIES,
    EmergencyStop,
    Task,
    axis_frame,
    checked_gains,
    row_indices,
)
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.faults.belief import Belief
from ftqp.faults.calibration import Calibration
from ftqp.faults.kinds import Fault
from ftqp.kernel.entry.planner_commands import LIMITS, PlannerCommands, ReserveSamples
from ftqp.kernel.entry.session import ArmSession, Memory, Session
from ftqp.kernel.layout.criteria import COEFFICIENTS, Criterion
from ftqp.kernel.layout.enums import HISTORY
from ftqp.kernel.layout.record import load_chain
from ftqp.kernel.layout.rows import CLEARANCE, COMPONENTS, HOLD, NOTHING_ASKED, Asked, constraint_labels
from ftqp.kernel.layout.thresholds import RISE_TIME
from ftqp.model.robot import Robot

PATIENCE = 0.1
"""Time [s] of fallback commands in a row after which the arm is stopped."""
STOP_RISE = 0.05
"""A stop brings the deceleration up to the acceleration limit within this time [s]. So that a stop ends at
rest without a step of the acceleration, which makes servos overshoot (docs/theory/feedback.md, "Stops")."""
REMEMBERED = 1.05
"""How long given targets are kept [s]. LATEST, after which the arm is stopped, and 50 ms, so that the oldest
one is still there."""
TOLERANCE = 1e-10
"""Largest violation of a bound that the active set counts as none. Some million units of rounding."""
ACCEPT = 1e-6
"""Largest scaled residual of a QP that counts as solved."""


def make_session(
    robot: Robot,
    task: Task,
    criterion: Criterion,
    bounds: Bounds,
    emergency: EmergencyStop | None,
    *,
    level: str,
    dt: float,
    drive: Drive = Drive(),  # noqa: B008  frozen
    noise: Noise = Noise(),  # noqa: B008  frozen
    asked: Asked = NOTHING_ASKED,
    rate: float = FALSE_ALARMS,
    known: Calibration | None = None,
) -> Session:
    """The session of a healthy robot; what is believed of its joints is another's to write."""
    session = Session(robot.nv)
    K = session.K
    load_chain(K, **robot.chain.constants())
    K.state.dt, K.state.level = dt, LEVELS[level]
    rows = row_indices(robot.default_rows if task.rows is None else task.rows)
    length = robot.length if task.length is None else task.length
    t = K.task
    t.kp, t.kv = checked_gains(task, level, dt)
    t.mode, t.slack_ratio, t.length = MODES[task.mode], task.slack, length
    t.m = len(rows)
    t.rows[: len(rows)] = rows
    t.row_scale[:] = 1.0, 1.0, 1.0, length, length, length
    t.yielding[:] = PRIORITIES[task.priority]
    t.uses_rotation = rows[-1] >= 3
    t.tool_rows = task.rows == "position_axis"
    t.axis[:] = axis_frame(task.axis).ravel()
    K.settling.on = task.calm
    if task.damping is not None:
        K.turned.threshold, K.turned.factor = task.damping.threshold, task.damping.factor
    for name in COEFFICIENTS:
        setattr(K.criteria, name, getattr(criterion, name))
    K.criteria.weight[:] = 1.0
    K.limits.conversion = bounds.code
    if isinstance(bounds, Jin):
        K.limits.jin_p, K.limits.jin_v = bounds.gamma_p, bounds.gamma_v
        K.limits.jin_margin, K.limits.jin_upsilon = bounds.margin, bounds.upsilon
    watch = K.watch
    watch.stop_position = watch.stop_rotation = np.inf
    if emergency is not None:
        watch.stop_position, watch.stop_rotation = emergency.position, emergency.rotation
        watch.stop_samples = emergency.samples
    watch.rise = STOP_RISE
    watch.fallback_limit = max(1, round(PATIENCE / dt))
    K.qp.tolerance, K.qp.max_iterations = TOLERANCE, 50 * (robot.nv + 10)
    K.cascade.accept = ACCEPT
    feedback = K.feedback
    feedback.stride = int(REMEMBERED / ((HISTORY - 2) * dt)) + 1
    feedback.tolerance, feedback.rotation_tolerance = task.tolerance, task.rotation_tolerance
    fill_loop(K, robot, dt, drive, noise, rate, known)
    K.keeps.asked = sum(len(names) for kind, names in asked.items() if kind != CLEARANCE.name)
    K.cascade.p = len(constraint_labels(robot.joints, robot.has_inertia, asked))
    return session


def _orders_of(session: Session, arm: ArmSession, given: Settings, solver: Solver) -> PlannerCommands:
    """The orders of a planner."""
    K, robot, kept = session.K, given.robot, given.task.kept_sets
    fewer = kept if solver.sizes_may_change else ()
    allow(K, fewer, given.dt, asked=given.task.degrade is not None)
    facts = {
        **{name: getattr(robot.limits, name) for name in LIMITS},
        "coulomb": robot.coulomb,
        "length": robot.length,
        "jerk": np.minimum(robot.limits.a_max / RISE_TIME, robot.limits.j_max),
        "torque_limits": int(given.limits_torque),
        "dynamic": int(given.dynamic),
        "on_demand": int(given.on_demand),
        "external": int(K.cascade.external),
        "may_swing": int(
            robot.has_inertia and robot.is_serial and not robot.chain.floating and solver.has_qp
        ),
        "allowed": sum(1 << KEPT_OF[name] for name in kept),
    }
    if given.posture is not None:
        facts |= {"has_posture": 1, "posture": given.posture}
    return PlannerCommands(session, arm, facts)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Deployable:
    """The memory of a planner that has not begun."""

    record: Any  # The record, (1,)
    given: Any  # What it was made with, (1,)
    arm: Any  # The arm by itself, (1,)
    states: FloatArray  # Of the samples of its braking reserve, q and v, (samples, 2 nv)
    came_every: int  # After how many ticks a place of the way that is come is kept; 0: none is
    left_out: tuple[str, ...]  # What of the planner a program in C does without, a sentence each


@final
class Assembly:
    """A planner's record and parts; ``fast`` is the tick of the clock where nothing else takes part in it."""

    def __init__(
        self,
        given: Settings,
        believe: Callable[[Fault], None],
        disbelieve: Callable[[str], None],
        what_ifs: Callable[[], RolloutSetup],
    ) -> None:
        robot, task, soft, constraints = given.robot, given.task, given.tasks, given.constraints
        self.given = given
        asked = {
            **row_names(constraints),
            HOLD.name: held_rows(soft),
            CLEARANCE.name: clearance_rows(given.keeps_clear),
        }
        self.session = session = make_session(
            robot, task, given.criterion, given.bounds, given.emergency,
            level=given.level, dt=given.dt, drive=given.drive, noise=given.noise, asked=asked,
            rate=given.rate, known=given.known,
        )  # fmt: skip
        self.solver = solver = Solver(session, robot, task, given.scheme, given.solver, bool(soft))
        if not solver.has_qp:
            given.refuse_without_qp()
        self.arm = ArmSession(robot.chain.constants())
        self.commands = _orders_of(session, self.arm, given, solver)
        self.surroundings = around = None
        if given.keeps_clear:
            around = CollisionModel(session, robot, given.scene, given.clearance or Clearance())
            self.surroundings = around
        self.tasks = TaskList(session, self.commands, robot, soft, given.level, given.dt, given.target)
        self.said = StepHeader(int(session.K.cascade.status))
        labels, parts = self.tasks.named(asked, around, task), parts_in(session, robot.nv)
        self.out = Step(session, robot.joints, parts, self.said, labels)
        self.loop = ArmLoop(session, self.commands, robot, around)
        self.constraints = Constraints(session, robot, constraints, self.loop.stop)
        self.rest = Rest(session, task.kept_sets, robot)
        self.free = FreeJoint(session, robot, parts_of_free(session, robot.nv)) if solver.has_qp else None
        self.leading = None if given.plan is None else PlanLeading(given.plan, session, robot)
        self.response: MonitorResponse | None = None
        if given.finds:
            session.K.monitor.names = 1
            self.response = MonitorResponse(session, robot, self.loop, believe, disbelieve)
        seconds, ahead = given.remember, given.n_minus_one
        self.remembered = None if seconds is None else Remembered(session, robot.nv, seconds, given.dt)
        self.watch = None if ahead is None else SecurityWatch(ahead, session, robot, given.dt, what_ifs)
        members = (
            self.watch, self.tasks, self.constraints, solver, self.leading, self.rest, self.free,
            self.response, around, self.remembered, StartWatch(session.K, around),
        )  # fmt: skip
        self.stages: tuple[Stage, ...] = tuple(one.stage for one in members if one is not None)
        self.tick = self._ordinary = solver.tick(CLOCK)
        self.fast: Tick | None = None

    def believe(self, belief: Belief) -> None:
        """Let every part know which joints have failed; ``tick`` and ``fast`` are then those of that."""
        for stage in self.stages:
            if stage.believe is not None:
                stage.believe(belief)
        free = None if self.free is None else self.free.tick
        tick = self._ordinary if free is None else free
        self.tick = staged(tick, CLOCK if free is None else FREE, self.stages)
        alone = self.tick is self._ordinary and self.solver.is_compiled and not self.given.timing
        self.fast = self.tick if alone else None

    def led_tick(self, leader: Memory) -> Tick:
        """The tick that a path's progress, an inertial target or a motion of the joints leads."""
        kind = leader.kind
        refuse(leader=kind, level=self.given.level, mode=self.given.task.mode)
        if kind == "base" and self.surroundings is not None:
            raise InputError(
                "a scene stands where the base does, and an inertial task has a base that moves; make a "
                "planner without scene and clearance, or put the arm on its base, robot.on_planar_base(...)"
            )
        return staged(self.solver.tick(kind, *leader.arguments()), kind, self.stages)

    @property
    def task_rows(self) -> tuple[str, ...]:
        """The rows of the pose that the task has now."""
        task = self.session.K.task
        return tuple(COMPONENTS[c] for c in task.rows[: int(task.m)])

    @property
    def keeps(self) -> list[Keep]:
        """The points and axes that are kept somewhere."""
        return [one.given for one in self.constraints.values() if isinstance(one.given, Keep)]

    @property
    def asking(self) -> tuple[str, ...]:
        """Tasks and constraints that ask a Python function in every tick."""
        return self.tasks.asking + self.constraints.asking

    def kept_clear(self) -> CollisionModel:
        """What the planner keeps clear of; InputError where it is nothing."""
        if self.surroundings is None:
            raise InputError("the planner keeps clear of nothing; give it a scene, Planner(robot, scene=...)")
        return self.surroundings

    def refuse_looking_ahead(self, reserve: ReserveSamples | None) -> None:
        """Refuse at once what ``n_minus_one`` would refuse when it looks ahead."""
        try:
            self.what_ifs(self.given.robot, Belief(self.given.robot), reserve)
        except InputError as error:
            raise InputError(
                f"n_minus_one looks ahead in a batch: {error}; or leave n_minus_one out"
            ) from error

    def what_ifs(self, robot: Robot, belief: Belief, reserve: ReserveSamples | None) -> RolloutSetup:
        """What other arms like this one would begin with; nothing here changes."""
        refuse_asking(self.asking, "a batch", "make a planner without {them}")
        self._refuse_foreign("a batch is compiled as a whole; make a planner with backend='active_set'")
        if self.leading is not None:
            raise InputError("this planner follows a plan, which a batch does not; make one without plan=")
        return RolloutSetup(self.session, self.commands, robot, reserve, belief)

    def _refuse_foreign(self, why: str) -> None:
        """Refuse a planner whose ticks are not the active set's, for somebody who has no other solver."""
        if not self.solver.sizes_may_change:
            raise InputError(
                f"this planner is solved by {self.given.backend!r}, expected the backend 'active_set' and a "
                f"scheme with a QP: {why}"
            )

    def deployable(self, belief: Belief, reserve: ReserveSamples | None) -> Deployable:
        """What the planner is without Python; nothing here changes."""
        if self.surroundings is not None and len(self.surroundings.scene.balls):
            raise InputError(
                "the scene has a cloud of balls, which a library in C does not have; give what stands there "
                "names, scene.add(...), or take the cloud away, scene.update(np.zeros((0, 4)))"
            )
        self._refuse_foreign("a library in C has no other solver")
        if self.leading is not None:
            raise InputError("this planner follows a plan, which a library in C does not; leave the plan out")
        refuse_asking(self.asking, "a library in C", "leave {them} out")
        if belief.faults:
            raise InputError(
                "this planner already believes in faults; build a healthy one, and report them to it"
            )
        new = "new things in the scene: those that stood there when the library was built can be moved"
        copy = self.session.copy()
        copy.K.state.is_reset = 0
        memory, n = self.commands.on(copy).memory, self.given.robot.nv
        rows = np.zeros((0, 2 * n)) if reserve is None else reserve.rows
        memory["samples"] = len(rows)
        return Deployable(
            record=copy.memory,
            given=memory,
            arm=self.commands.arm,
            states=rows[:, : 2 * n].copy(),
            came_every=0 if self.remembered is None else int(self.remembered.facts[0]),
            left_out=() if self.surroundings is None else (new,),
        )
