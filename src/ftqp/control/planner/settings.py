"""What a planner was asked for: every argument checked, named things made, and what follows from them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import update_wrapper
from inspect import Parameter, signature
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np

from ftqp.control.drive.joint_drive import Drive, Noise
from ftqp.control.drive.servo_prior import FALSE_ALARMS
from ftqp.control.planner.arm_loop import accepted_drive
from ftqp.control.planner.constraint_list import (
    Constraint,
    checked_constraints,
    needs_qp,
    refuse_without_effect,
)
from ftqp.control.planner.detector import Detector
from ftqp.control.planner.leading_plan import LeadingPlan, plan_for
from ftqp.control.planner.mounted_robot import warn_of_rotors
from ftqp.control.planner.qp_solver import IN_KERNEL, NETWORK
from ftqp.control.planner.target import Target
from ftqp.control.planner.task_list import split
from ftqp.control.planner.ways.n_minus_one import NMinusOne
from ftqp.control.scene.placed_shapes import Clearance, Scene
from ftqp.control.task import bounds as bound_conversions
from ftqp.control.task import schemes
from ftqp.control.task.bounds import Bounds
from ftqp.control.task.compatibility import refuse
from ftqp.control.task.resolvers import Resolver
from ftqp.control.task.scheme import Scheme
from ftqp.control.task.soft_tasks import SoftTask
from ftqp.control.task.task import EmergencyStop, Task
from ftqp.core.checks import FloatArray, array, frozen, instance, positive
from ftqp.core.errors import InputError, ModelError, nearest, unknown
from ftqp.faults.calibration import Calibration
from ftqp.kernel.layout.enums import JOINTS, Level
from ftqp.model.limits import within_branch
from ftqp.model.robot import Robot
from ftqp.qp.adapters.backend import Backend
from ftqp.qp.adapters.registry import backend as make_backend

P = ParamSpec("P")
S = TypeVar("S")
LEVELS = {level.name.lower(): level for level in Level}
SHORTEST = 1e-6
"""Sampling period of the fastest planner [s], by convention."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """The arguments of a ``Planner`` in force, by their names there, and what follows from them."""

    robot: Robot
    dt: float
    level: str
    task: Task
    tasks: tuple[SoftTask, ...]  # Beside that of the tip
    target: Target | None  # Of the tip, where its task was given with one
    constraints: tuple[Constraint, ...]
    scheme: Scheme | Resolver
    criterion: Any  # The scheme's objective at this level
    bounds: Bounds
    emergency: EmergencyStop | None
    drive: Drive
    noise: Noise
    posture: FloatArray | None
    solver: Backend | None  # None is the kernel's own
    limits_torque: bool  # Whether torque limits are rows of the QP
    plan: LeadingPlan | None
    detector: Detector | bool | None
    scene: Scene | None
    clearance: Clearance | None
    remember: float | None
    n_minus_one: NMinusOne | None
    timing: bool

    @property
    def backend(self) -> str:
        """The name of what solves the QP."""
        return IN_KERNEL if self.solver is None else self.solver.name

    @property
    def finds(self) -> bool:
        """Whether what the monitor finds is believed."""
        return self.detector is not False

    @property
    def rate(self) -> float:
        """How many false alarms an hour are allowed."""
        given = self.detector
        return given.false_alarms_per_hour if isinstance(given, Detector) else FALSE_ALARMS

    @property
    def known(self) -> Calibration | None:
        """What is known of the joints' friction."""
        found = self.detector.calibration if isinstance(self.detector, Detector) else None
        if found is not None:
            found.refuse_others(self.robot.joints)
        return found

    @property
    def keeps_clear(self) -> bool:
        """Whether bodies are kept apart."""
        return self.scene is not None or self.clearance is not None

    @property
    def dynamic(self) -> bool:
        """Whether M and h are needed in every tick, whatever has failed."""
        needed = self.limits_torque or self.drive.kind == "torque" or self.criterion.needs_inertia
        return needed or self.robot.chain.floating > 0

    @property
    def on_demand(self) -> bool:
        """Whether torque rows are left out where the command keeps torque limits without them."""
        return (
            self.backend == IN_KERNEL
            and not self.criterion.needs_inertia
            and self.task.mode != "lexicographic"
            and self.drive.kind != "torque"
            and not self.robot.chain.floating
        )

    def refuse_without_qp(self) -> None:
        """Refuse what a closed form, which solves no QP, has no rows for."""
        self.robot.refuse_floating(f"scheme {self.scheme.name!r}, which solves no QP, needs")
        if self.tasks or self.keeps_clear or needs_qp(self.constraints):
            raise InputError(
                f"scheme {self.scheme.name!r} solves no QP, so that further tasks, constraints and a scene "
                "have no effect on it; take one that does, for example 'mvn'"
            )


def takes(
    options: Callable[P, S],
) -> Callable[[Callable[[Any, S], None]], Callable[Concatenate[Any, P], None]]:
    """Makes a constructor of what a function has made of its arguments one of those arguments."""

    def with_options(make: Callable[[Any, S], None]) -> Callable[Concatenate[Any, P], None]:
        me, given = Parameter("self", Parameter.POSITIONAL_OR_KEYWORD), signature(options)

        def begin(self: Any, /, *args: P.args, **kwargs: P.kwargs) -> None:
            for name in kwargs:
                if name not in given.parameters:
                    raise unknown("keyword", name, f"ftqp.{type(self).__name__}", given.parameters)
            make(self, options(*args, **kwargs))

        asked: Any = update_wrapper(begin, make)
        asked.__signature__ = given.replace(
            parameters=[me, *given.parameters.values()], return_annotation=None
        )
        return begin

    return with_options


def planner_settings(
    robot: Robot,
    dt: float = 1e-3,
    *,
    level: str = "acceleration",
    scheme: Scheme | Resolver | str | Mapping[str, Any] | None = None,
    task: Task | None = None,
    bounds: Bounds | str | Mapping[str, Any] = "viability",
    backend: str | Path | Mapping[str, Any] | Backend = "active_set",
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
) -> Settings:
    """The arguments of a ``Planner``, which explains them, checked in their order."""
    instance("n_minus_one", n_minus_one, NMinusOne | None, "an ftqp.NMinusOne or None")
    instance("detector", detector, Detector | bool | None, "an ftqp.Detector, False or None")
    of_tip, soft, target = split(getattr(robot, "tip", None), task, tasks)
    asked = checked_constraints(constraints)
    instance("scene", scene, Scene | None, "an ftqp.Scene, filled by scene.add(name, shape), or None")
    instance("clearance", clearance, Clearance | None, "an ftqp.Clearance(keep=0.02) or None")
    if level not in LEVELS:
        raise InputError(
            f"level is {level!r}{nearest(str(level), LEVELS)}, expected one of {', '.join(LEVELS)}"
        )
    robot = accepted(robot)
    plan = None if plan is None else plan_for(plan, robot)
    robot = robot if branch_limits is None else within_branch(robot, branch_limits)
    dt = positive("dt", dt, "s")
    if dt < SHORTEST:
        raise InputError(f"dt is {dt:g} s, expected at least {SHORTEST:g} s; no arm takes commands so often")
    task = Task() if of_tip is None else of_tip
    instance("task", task, Task, 'an ftqp.Task or None, ftqp.Task(rows="position")')
    is_led = plan is not None or (n_minus_one is not None and n_minus_one.leads)
    made = schemes.by_name("rmp" if scheme is None and is_led else scheme)
    intervals = bound_conversions.by_name(bounds)
    instance("emergency", emergency, EmergencyStop | None, "an ftqp.EmergencyStop or None")
    taken, noise = accepted_drive(robot, drive, noise)
    detector = Detector() if detector is True else detector
    if taken.kind == "torque":
        robot.refuse_floating("drive 'torque' needs")
        warn_of_rotors(robot)
    posture = None if posture is None else frozen(array("posture", posture, (robot.nv,), "(nv,)"))
    solver = None if isinstance(backend, str) and backend == IN_KERNEL else make_backend(backend)
    name = IN_KERNEL if solver is None else solver.name
    refuse(
        {"scheme": made.name, "backend": name},
        level=level,
        scheme="closed form" if isinstance(made, Resolver) else "criterion",
        backend=name if name in (IN_KERNEL, NETWORK) else "external",
        mode=task.mode,
        damping="none" if task.damping is None else "directional",
    )
    criterion = made.at(level)
    if criterion.needs_inertia and not robot.has_inertia:
        raise InputError(
            f"scheme {made.name!r} needs inertia, which {robot.name} has not; use mvn, man or rmp"
        )
    refuse_without_effect(asked, robot, torque_limits)
    _refuse_led(made.name, criterion, posture, plan, n_minus_one)
    return Settings(
        robot=robot, dt=dt, level=level, task=task, tasks=soft, target=target, constraints=asked,
        scheme=made, criterion=criterion, bounds=intervals, emergency=emergency, drive=taken, noise=noise,
        posture=posture, solver=solver, plan=plan, detector=detector, scene=scene, clearance=clearance,
        remember=remember, n_minus_one=n_minus_one, timing=timing,
        limits_torque=torque_limits and robot.has_inertia and bool(np.isfinite(robot.limits.tau_max).any()),
    )  # fmt: skip


def _refuse_led(
    scheme: str, criterion: Any, posture: FloatArray | None, plan: Any, n_minus_one: NMinusOne | None
) -> None:
    """Refuse a null space that cannot be led, or that two would lead."""
    n_minus_one_leads = n_minus_one is not None and n_minus_one.leads
    if plan is not None and n_minus_one_leads:
        raise InputError(
            "plan and n_minus_one both lead the null space; take NMinusOne(leads=False) with the plan"
        )
    if plan is not None and posture is not None:
        raise InputError("posture and plan both say where the null space leads; leave one of them out")
    if (plan is not None or n_minus_one_leads) and not getattr(criterion, "norm_q", 0.0) > 0.0:
        leader, instead = "a plan", ""
        if n_minus_one_leads:
            leader, instead = "n_minus_one", ", or NMinusOne(leads=False)"
        raise InputError(
            f"scheme {scheme!r} leads to no posture, so that {leader} has no effect on it; use rmp, dlsm "
            f"or a mix with one of them{instead}"
        )


EXAMPLE = 'ftqp.robots.load("panda")'


def accepted(robot: Robot) -> Robot:
    """The robot, if a planner can drive it."""
    instance("robot", robot, Robot, f"an ftqp.Robot, for example {EXAMPLE} or ftqp.Robot.from_urdf(file)")
    if robot.nv > JOINTS:
        raise ModelError(
            f"{robot.name} has {robot.nv} joints between base and end effector; ftqp drives at most {JOINTS}"
        )
    endless = [j for j, a in zip(robot.joints, robot.limits.a_max, strict=True) if not np.isfinite(a)]
    if endless:
        missing = "a_max" if np.isfinite(robot.limits.v_max).all() else "v_max"
        says = "acceleration limit" if missing == "a_max" else "velocity limit, and so no acceleration limit,"
        raise ModelError(
            f"{robot.name} has no {says} on {', '.join(endless)}; braking needs one: "
            f"robot.with_limits({missing}=...)"
        )
    return robot
