"""The signals of a simulation: what each column of a log holds."""

from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ftqp.control.following.path_follower import PathStatus
from ftqp.control.moving_base.inertial_task import BaseStatus
from ftqp.control.planner.status import StepStatus
from ftqp.core.checks import BoolArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import KINDS
from ftqp.qp.problem import SolveStatus

HEALTHY = 0
"""Code of a joint that works in the columns ``truth`` and ``belief``; a kind of fault has its ``number``."""
CONDITIONS = {HEALTHY: "healthy"} | {kind.number: name.replace("_", "-") for name, kind in KINDS.items()}
"""What each code of these columns means."""


def refuse_unknown_conditions(codes: NDArray[Any], where: str) -> None:
    """Refuse codes of ``truth`` or ``belief`` that nothing could be said of."""
    strange = codes[~np.isin(codes, list(CONDITIONS))]
    if len(strange):
        words = ", ".join(f"{code} {word}" for code, word in CONDITIONS.items())
        raise InputError(
            f"{where} has a joint in condition {strange[0]:g}, expected one of {words}; read it with the "
            "version of ftqp that wrote it"
        )


QP_CODES: dict[SolveStatus | None, int] = {None: -1} | {s: code for code, s in enumerate(SolveStatus)}
"""Code of each outcome of a QP in the column ``qp_status``; None: the step needed no QP."""
PATH_CODES: dict[PathStatus | None, int] = {None: 0} | {s: code for code, s in enumerate(PathStatus, start=1)}
"""Code of each status of a path in the column ``path_status``; None: the path has no progress of its own."""


def named(codes: Iterable[tuple[Enum | None, int]], none: str = "") -> str:
    """Codes and their names, for the description of a column; ``none`` says what None stands for."""
    return ", ".join(f"{code} {none if member is None else member.name}" for member, code in codes)


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a log."""

    name: str  # for example ``q.panda_joint1``; columns with the same part before the dot stack to an array
    unit: str  # SI, or ``-`` without unit
    description: str  # one sentence for a reader of the file
    integer: bool = False  # whether the values are whole numbers (codes and counts)


_SCALARS = (
    Column("position_error", "m", "distance from the end effector to its target"),
    Column("rotation_error", "rad", "angle between the end effector and its target"),
    Column("slack", "-", "norm of what the command leaves undone of the task, in the units of the task rows"),
    Column("scale", "-", "fraction of the demanded motion along the path, 1 unless the task is slowed"),
    Column("status", "-", f"status of the step: {named((s, k) for k, s in enumerate(StepStatus))}", True),
    Column("qp_status", "-", f"outcome of the QP: {named(QP_CODES.items(), 'none was needed')}", True),
    Column("qp_iterations", "-", "iterations of the solver", True),
    Column("qp_residual", "-", "largest recomputed residual of the optimality conditions"),
    Column("step_time", "us", "wall time of planner.step()"),
    Column("sigma_min", "-", "smallest singular value of the task's Jacobian over the joints believed "
           "healthy, lengths in characteristic lengths"),
    Column("manipulability", "-", "product of the singular values of that Jacobian"),
    Column("condition", "-", "largest by smallest singular value of that Jacobian"),
    Column("kappa", "-", "damping of a singularity-robust inverse, 0 where nothing is damped"),
    Column("off_path", "m", "distance of the end effector from its target across the direction of the path"),
    Column("progress", "s", "path time reached"),
    Column("path_status", "-", f"where the path stands: {named(PATH_CODES.items(), 'no progress')}", True),
)  # fmt: skip


def base_columns(coordinates: Sequence[str]) -> tuple[Column, ...]:
    """The columns that a moving base adds, in their order."""
    where = "of the base in the inertial frame"
    result = [Column(f"base.{axis}", "m", f"true position {where}") for axis in "xyz"]
    result += [Column(f"base.q{axis}", "-", f"true attitude {where}, unit quaternion") for axis in "xyzw"]
    slides = ("track", "x", "y", "z")
    result += [
        Column(f"disturbance.{name}", "m" if name in slides else "rad", "true coordinate of the base")
        for name in coordinates
    ]
    error = "true error of the end effector along the inertial axes"
    result += [Column(f"inertial_error.{axis}", "m", error) for axis in "xyz"]
    result += [Column(f"inertial_error.r{axis}", "rad", f"{error}, rotation vector") for axis in "xyz"]
    codes = named((status, code) for code, status in enumerate(BaseStatus))
    return (*result, Column("base_status", "-", f"status of the inertial task: {codes}", True))


def sensed_columns(names: Sequence[str], joints: Sequence[str], prismatic: BoolArray) -> tuple[Column, ...]:
    """The columns that an arm with a drive or sensors of its own adds, in their order."""
    groups = (
        ("q_measured", 0, "joint position that the planner was given"),
        ("v_measured", 1, "joint velocity that the planner was given"),
        ("q_command", 0, "joint position that was sent to the arm, for the end of the step"),
        ("v_command", 1, "joint velocity that was sent to the arm, for the end of the step"),
        ("q_reference", 0, "joint position of the planner's reference, for the end of the step"),
        ("v_reference", 1, "joint velocity of the planner's reference, for the end of the step"),
        ("tau_measured", -1, "motor torque that the planner was given"),
        ("tau_demand", -1, "torque that the drive asked of the motor when the sample was taken"),
    )
    return tuple(
        Column(f"{group}.{joint}", _unit(derivative, bool(slides)), about)
        for group, derivative, about in groups
        if group in names
        for joint, slides in zip(joints, prismatic, strict=True)
    )


def columns(joints: Sequence[str], prismatic: BoolArray, level: str) -> tuple[Column, ...]:
    """All columns of the log of one robot, in their order."""
    order = 2 if level == "acceleration" else 1
    groups = (
        ("q", 0, "joint position at the start of the step"),
        ("v", 1, "joint velocity at the start of the step"),
        ("a", 2, "commanded joint acceleration, held until the next step"),
        ("tau", -1, "motor torque of the command; 0 for a joint that is believed to have failed"),
        ("tau_brake", -1, "torque carried by the brake of a joint that is believed to be locked"),
        ("lb", order, "lower end of the interval of the command"),
        ("ub", order, "upper end of the interval of the command"),
    )
    result = [Column("t", "s", "time")]
    for group, derivative, description in groups:
        for joint, slides in zip(joints, prismatic, strict=True):
            result.append(Column(f"{group}.{joint}", _unit(derivative, bool(slides)), description))
    codes = ", ".join(f"{code} {word}" for code, word in CONDITIONS.items())
    for group, whose in (
        ("belief", "what the planner believes of the joint"),
        ("truth", "what the joint really is"),
    ):
        result += [Column(f"{group}.{joint}", "-", f"{whose}: {codes}", True) for joint in joints]
    for group, what in (("target", "desired"), ("tip", "actual")):
        result += [
            Column(f"{group}.{axis}", "m", f"{what} position of the end effector in the base frame")
            for axis in "xyz"
        ]
        result += [
            Column(f"{group}.q{axis}", "-", f"{what} orientation of the end effector, unit quaternion")
            for axis in "xyzw"
        ]
    return (*result, *_SCALARS)


def _unit(derivative: int, slides: bool) -> str:
    if derivative < 0:
        return "N" if slides else "N m"
    return ("m" if slides else "rad") + ("", "/s", "/s2")[derivative]


TASKS: Final = "task_error"
"""Group of the errors of soft tasks."""
PLANES: Final = "distance"
"""Group of the distances of kept points from their planes and boxes, and of axes from their cones."""
BODIES: Final = "clearance"
"""Group of the distances of the arm from itself and from what stands around it."""
ITSELF: Final = "itself"
"""What stands for the arm's own bodies in that group."""
ROTATION: Final = " rotation"
"""What stands behind the name of a task of a pose where its angle is meant."""
FACTS: Final = {TASKS: "tasks", PLANES: "constraints", BODIES: "scene"}
"""Where the metadata of a log list what a group is of."""


def names_in(rows: Container[str], about: Mapping[str, Any], group: str) -> list[str]:
    """Names of what a log has a signal of, in the order of its soft tasks, or of its kept points."""
    named = [one["name"] for one in about.get(FACTS[group], [])]
    every = dict.fromkeys(name for one in named for name in (one, one + ROTATION))
    return [name for name in every if f"{group}.{name}" in rows]
