"""The signals of a simulation: what each column of a log holds."""

from collections.abc import Sequence
from dataclasses import dataclass

from ftqp.core.checks import BoolArray

BELIEFS = ("healthy", "locked", "free-swinging", "degraded")
"""What the codes of the columns ``belief`` and ``truth`` mean, by position."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column of a log.

    Attributes:
        name: for example ``q.panda_joint1``; columns with the same part before the dot stack to an array.
        unit: SI, or ``-`` without unit.
        description: one sentence for a reader of the file.
        integer: whether the values are whole numbers (codes and counts).
    """

    name: str
    unit: str
    description: str
    integer: bool = False


_SCALARS = (
    Column("position_error", "m", "distance from the tip to its target"),
    Column("rotation_error", "rad", "angle between the tip and its target"),
    Column("slack", "-", "norm of what the command leaves undone of the task, in the units of the task rows"),
    Column("scale", "-", "fraction of the demanded motion along the path, 1 unless the task is slowed"),
    Column("status", "-", "status of the step: 0 OK, 1 RELAXED, 2 SCALED, 3 FALLBACK, 4 STOPPING, 5 STOPPED, "
           "6 INVALID_INPUT", True),
    Column("qp_status", "-", "outcome of the QP: 0 solved, 1 iteration limit, 2 infeasible, 3 failed, "
           "-1 none was needed", True),
    Column("qp_iterations", "-", "iterations of the solver", True),
    Column("qp_residual", "-", "largest recomputed residual of the optimality conditions"),
    Column("step_time", "us", "wall time of planner.step()"),
    Column("sigma_min", "-", "smallest singular value of the task's Jacobian over the joints believed "
           "healthy, lengths in characteristic lengths"),
    Column("manipulability", "-", "product of the singular values of that Jacobian"),
    Column("condition", "-", "largest by smallest singular value of that Jacobian"),
    Column("kappa", "-", "damping of a singularity-robust inverse, 0 where nothing is damped"),
    Column("off_path", "m", "distance of the tip from its target across the direction of the path"),
    Column("progress", "s", "path time reached"),
    Column("path_status", "-", "0 no progress reference, 1 FOLLOWING, 2 SCALED, 3 ESCAPING, 4 BLOCKED, "
           "5 DONE", True),
)  # fmt: skip


def base_columns(coordinates: Sequence[str]) -> tuple[Column, ...]:
    """The columns that a moving base adds, in their order.

    Args:
        coordinates: names of the base's coordinates.
    """
    where = "of the base in the inertial frame"
    result = [Column(f"base.{axis}", "m", f"true position {where}") for axis in "xyz"]
    result += [Column(f"base.q{axis}", "-", f"true attitude {where}, unit quaternion") for axis in "xyzw"]
    slides = ("track", "x", "y", "z")
    result += [
        Column(f"disturbance.{name}", "m" if name in slides else "rad", "true coordinate of the base")
        for name in coordinates
    ]
    error = "true error of the tip along the inertial axes"
    result += [Column(f"inertial_error.{axis}", "m", error) for axis in "xyz"]
    result += [Column(f"inertial_error.r{axis}", "rad", f"{error}, rotation vector") for axis in "xyz"]
    status = Column("base_status", "-", "status of the inertial task: 0 TRACKING, 1 SATURATED, "
                    "2 RANK_DEFICIENT, 3 UNREACHABLE, 4 STALE, 5 HALTED", True)  # fmt: skip
    return (*result, status)


def columns(joints: Sequence[str], prismatic: BoolArray, level: str) -> tuple[Column, ...]:
    """All columns of the log of one robot, in their order.

    Args:
        joints: names, base to tip.
        prismatic: which joints slide, (nv,).
        level: ``"acceleration"`` or ``"velocity"``, of the joint intervals.
    """
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
    codes = ", ".join(f"{code} {meaning}" for code, meaning in enumerate(BELIEFS))
    for group, whose in (
        ("belief", "what the planner believes of the joint"),
        ("truth", "what the joint really is"),
    ):
        result += [Column(f"{group}.{joint}", "-", f"{whose}: {codes}", True) for joint in joints]
    for group, what in (("target", "desired"), ("tip", "actual")):
        result += [
            Column(f"{group}.{axis}", "m", f"{what} position of the tip in the base frame") for axis in "xyz"
        ]
        result += [
            Column(f"{group}.q{axis}", "-", f"{what} orientation of the tip, unit quaternion")
            for axis in "xyzw"
        ]
    return (*result, *_SCALARS)


def _unit(derivative: int, slides: bool) -> str:
    if derivative < 0:
        return "N" if slides else "N m"
    return ("m" if slides else "rad") + ("", "/s", "/s2")[derivative]
