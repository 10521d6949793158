"""What a planner was asked for: every argument checked, named things made, and what follows from them."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.control.drive.joint_drive import Drive, Noise
from ftqp.control.planner.arm_loop import accepted_drive
from ftqp.control.planner.configuration import warn_of_rotors
from ftqp.control.planner.leading_plan import LeadingPlan, plan_for
from ftqp.control.planner.qp_solver import IN_KERNEL, NETWORK
from ftqp.control.task import bounds as bound_conversions
from ftqp.control.task import schemes
from ftqp.control.task.bounds import Bounds
from ftqp.control.task.compatibility import refuse
from ftqp.control.task.resolvers import Resolver
from ftqp.control.task.scheme import Scheme
from ftqp.control.task.task import EmergencyStop, Task
from ftqp.core.checks import FloatArray, array, frozen, instance, positive
from ftqp.core.errors import InputError, ModelError, nearest
from ftqp.kernel.layout.enums import JOINTS, Level
from ftqp.model.limits import within_branch
from ftqp.model.robot import Robot
from ftqp.qp.adapters.backend import Backend
from ftqp.qp.adapters.registry import backend as make_backend

LEVELS = {level.name.lower(): level for level in Level}
SHORTEST = 1e-6
"""Sampling period of the fastest planner [s], by convention."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """The arguments of a ``Planner`` in force, and what follows from them.

    Attributes:
        robot: The arm, within its branch.
        dt: The sampling period [s].
        level: ``acceleration`` or ``velocity``.
        task: What is followed, and how.
        scheme: What the arm does with its redundancy.
        criterion: The scheme's objective at this level.
        bounds: How limits become intervals.
        emergency: When the planner stops the arm of its own accord, or None.
        drive: What the arm takes.
        noise: How noisy the measurements are.
        posture: Where ``rmp`` and ``dlsm`` return to, (nv,) [rad or m], or None.
        solver: The foreign backend; None is the kernel's own.
        backend: The name of either.
        limits_torque: Whether torque limits are rows of the QP.
        dynamic: Whether M and h are needed in every tick, whatever has failed.
        on_demand: Whether torque rows are left out where the command keeps torque limits without them.
        plan: What leads the null space, or None.
    """

    robot: Robot
    dt: float
    level: str
    task: Task
    scheme: Scheme | Resolver
    criterion: Any
    bounds: Bounds
    emergency: EmergencyStop | None
    drive: Drive
    noise: Noise
    posture: FloatArray | None
    solver: Backend | None
    backend: str
    limits_torque: bool
    dynamic: bool
    on_demand: bool
    plan: LeadingPlan | None


def settled(
    robot: Robot,
    dt: float,
    *,
    level: str,
    scheme: Scheme | Resolver | str | Mapping[str, Any] | None,
    task: Task | None,
    bounds: Bounds | str | Mapping[str, Any],
    backend: str | Path | Mapping[str, Any] | Backend,
    posture: Any,
    torque_limits: bool,
    emergency: EmergencyStop | None,
    branch_limits: Mapping[str | int, Any] | None,
    drive: Drive | str | Mapping[str, Any],
    noise: Noise | None,
    plan: LeadingPlan | None = None,
) -> Settings:
    """The arguments of a ``Planner``, checked in their order; see there."""
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
    task = Task() if task is None else task
    instance("task", task, Task, 'an ftqp.Task or None, ftqp.Task(rows="position")')
    made = schemes.by_name(scheme if plan is None or scheme is not None else "rmp")
    intervals = bound_conversions.by_name(bounds)
    instance("emergency", emergency, EmergencyStop | None, "an ftqp.EmergencyStop or None")
    taken, noise = accepted_drive(robot, drive, noise)
    torque_drive = taken.kind == "torque"
    if torque_drive:
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
    if plan is not None:
        _refuse_plan(made, criterion, posture)
    limits_torque = torque_limits and robot.has_inertia and bool(np.isfinite(robot.limits.tau_max).any())
    return Settings(
        robot=robot,
        dt=dt,
        level=level,
        task=task,
        scheme=made,
        criterion=criterion,
        bounds=intervals,
        emergency=emergency,
        drive=taken,
        noise=noise,
        posture=posture,
        solver=solver,
        backend=name,
        limits_torque=limits_torque,
        dynamic=limits_torque or torque_drive or criterion.needs_inertia or robot.chain.floating > 0,
        on_demand=(
            name == IN_KERNEL
            and not criterion.needs_inertia
            and task.mode != "lexicographic"
            and not torque_drive
            and not robot.chain.floating
        ),
        plan=plan,
    )


def _refuse_plan(scheme: Scheme | Resolver, criterion: Any, posture: FloatArray | None) -> None:
    """Refuse what a plan cannot lead."""
    if not getattr(criterion, "norm_q", 0.0) > 0.0:
        raise InputError(
            f"scheme {scheme.name!r} leads to no posture, so that a plan has no effect on it; use rmp, dlsm "
            "or a mix with one of them"
        )
    if posture is not None:
        raise InputError("posture and plan both say where the null space leads; leave one of them out")


EXAMPLE = 'ftqp.robots.load("panda")'


def accepted(robot: Robot) -> Robot:
    """The robot, if a planner can drive it."""
    instance("robot", robot, Robot, f"an ftqp.Robot, for example {EXAMPLE} or ftqp.Robot.from_urdf(file)")
    if robot.nv > JOINTS:
        raise ModelError(
            f"{robot.name} has {robot.nv} joints between base and tip; ftqp drives at most {JOINTS}"
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
