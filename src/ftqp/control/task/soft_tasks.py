"""Further tasks: what other frames, axes and joints of the arm should do, before or after the tip's task."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, ClassVar

import numpy as np

from ftqp.control.task.task import DEFAULT_GAINS
from ftqp.core.checks import FloatArray, array, frozen
from ftqp.core.errors import InputError, nearest
from ftqp.core.pose import pose
from ftqp.core.setting import REQUIRED, setting
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.kernel.layout.scene_room import AXIS, FRAME, JOINT_PLACES, MASS, OWN

AXES = "xyz"
GENTLE = {"acceleration": 4.0, "velocity": 2.0}
"""kp at each level: an error decays by 2 1/s, five times as slowly as that of the tip, so that a soft task
does not take the arm into limits that the tip's task needs."""
Three = tuple[float, float, float] | None
Matrix = tuple[tuple[float, ...], ...] | None
SETS = {"pose": 0b111111, "position": 0b000111, "orientation": 0b111000}
"""Rows by the word for them, a bit for each of x, y, z, rx, ry, rz."""
FIRST, TIPS, NEXT, LAST = 0, 1, 2, 3
"""The levels of further tasks, and between them that of the tip's; the last is that of the scheme."""
FIRM = (FIRST, TIPS)
"""Those whose tasks are as fast as the tip's, and count for the status."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SoftTask:
    """What every further task has.

    Args:
        level: Before (0), beside (1) or after (2) the task of the tip, or beside the scheme's objective (3).
            0 is kept as an equation, and where joints and limits cannot do both, the tip gives way. 1 is as
            firm as the tip's: where they cannot both be done, each gives way as its weight says, the tip's
            being 1. 2 has what the tasks on level 1 leave, and the scheme's objective what is left then. 3
            shares that with the scheme.
        weight: How much it counts beside the other tasks on its level, >= 0, and on level 3 beside the
            scheme's objective. A larger one is kept more closely where two of them want different things; 0
            leaves it out. On level 0 it only matters whether it is 0.
        kp: Gain on the error, >= 0 [1/s2 at the acceleration level, 1/s at the velocity level]. A larger one
            comes nearer sooner, and takes the arm into its limits sooner, where the tip's task then misses
            what it needs. None is 4 and 2: five times as slow as the task of the tip; on level 0 and 1 it
            is as fast.
        kv: Gain on the error of the velocity, >= 0 [1/s], at the acceleration level only. A larger one damps
            more. None is 2 sqrt(kp), critical damping.
        required: Whether the planner's status speaks of it, too: RELAXED where the command misses it, LAGGING
            where it is beyond the tolerances of the tip's ``Task``. None: yes of poses, positions and
            relative poses on level 0 and 1, no of others.
        name: What ``planner.tasks``, ``step.tasks`` and the targets of a step call it; None is what it is of.

    Raises:
        InputError: A number is out of its range, or an array has a wrong shape.
    """

    level: int = setting(LAST, least=0, most=3)
    weight: float = setting(1.0, least=0.0)
    kp: float | None = setting(None, unit="1/s2 or 1/s", least=0.0)
    kv: float | None = setting(None, unit="1/s", least=0.0)
    required: bool | None = setting(None)
    name: str | None = setting(None)
    code: ClassVar[int]
    can_go_first: ClassVar[bool] = True
    is_place: ClassVar[bool] = False
    called: ClassVar[str] = "{0.__class__.__name__}"

    def __post_init__(self) -> None:
        for name in ("frame", "to"):
            if not isinstance(getattr(self, name, ""), str):
                raise InputError(
                    f"{name} of {type(self).__name__} is {getattr(self, name)!r:.60}, expected the name of a "
                    "frame, link or joint of the robot's model, such as 'left_hand'"
                )
        if not isinstance(self.level, int) or not FIRST <= self.level <= LAST or self.level is True:
            raise InputError(f"level of {self.label} is {self.level!r:.60}, expected 0, 1, 2 or 3")
        if self.level in FIRM and not self.can_go_first:
            raise InputError(
                f"{self.label} draws joints and cannot be on level {self.level}; expected level=2 or 3, or, "
                "to hold a joint, branch_limits"
            )
        if self.required not in (None, False, True):
            raise InputError(
                f"required of {self.label} is {self.required!r:.60}, expected True, False or None"
            )
        if self.required and (self.level not in FIRM or self.code == OWN):
            own = self.code == OWN
            why = "its error is not known" if own else f"level {self.level} promises nothing"
            raise InputError(
                f"{self.label} cannot be required: {why}; expected a task of a frame, an axis or the centre "
                "of mass on level 0 or 1"
            )
        self.check("weight", self.weight)
        for name in ("kp", "kv"):
            if getattr(self, name) is not None:
                self.check(name, getattr(self, name))
        if self.name is not None and not (isinstance(self.name, str) and self.name):
            raise InputError(f"name is {self.name!r:.60}, expected a word such as 'elbow', or None")

    def check(self, name: str, value: Any) -> float:
        """A number of the task, if it is finite and no less than 0."""
        if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not isfinite(value):
            raise InputError(f"{name} of {self.label} is {value!r:.60}, expected a finite number >= 0")
        if value < 0.0:
            raise InputError(f"{name} of {self.label} is {value:g}, expected >= 0")
        return float(value)

    @property
    def label(self) -> str:
        """What it is called."""
        return self.name or self.called.format(self)

    @property
    def counts(self) -> bool:
        """Whether the planner's status speaks of it."""
        usual = self.is_place and self.level in FIRM
        return usual if self.required is None else bool(self.required)

    def gains(self, level: str) -> tuple[float, float]:
        """kp and kv at a level."""
        usual = DEFAULT_GAINS[level][0] if self.level in FIRM else GENTLE[level]
        kp = usual if self.kp is None else float(self.kp)
        kv = 2.0 * kp**0.5 if self.kv is None else float(self.kv)
        return kp, kv if level == "acceleration" else 0.0


def _bits(task: SoftTask, rows: Any, names: bool) -> int:
    """The rows of a frame, a bit for each."""
    if isinstance(rows, str) and rows in SETS:
        return SETS[rows]
    if not names or isinstance(rows, str) or not isinstance(rows, Sequence):
        more = " or names among x, y, z, rx, ry, rz" if names else ""
        near = nearest(rows, SETS) if isinstance(rows, str) else ""
        raise InputError(
            f"rows of {task.label} is {rows!r:.60}{near}, expected one of {', '.join(SETS)}{more}"
        )
    if not rows or len(set(rows)) < len(rows) or set(rows) - set(COMPONENTS):
        raise InputError(
            f"rows of {task.label} is {rows!r:.60}, expected names among {', '.join(COMPONENTS)}"
        )
    return sum(1 << COMPONENTS.index(row) for row in rows)


def _place_of(task: "PositionTask | CentreOfMass") -> FloatArray:
    return array(f"target of {task.label}", task.target, (3,), "x, y, z")


def _rows_of(task: SoftTask, rows: Any) -> str:
    if not isinstance(rows, str) or not rows or set(rows) - set(AXES) or len(set(rows)) < len(rows):
        raise InputError(f"rows of {task.label} is {rows!r:.60}, expected some of x, y, z, for example 'z'")
    return rows


@dataclass(frozen=True, slots=True)
class PoseTask(SoftTask):
    """Another frame has a pose, for example the hand of the other arm.

    Args:
        frame: A frame, link or joint of the robot's model.
        rows: ``pose``, ``position``, ``orientation``, or names among x, y, z, rx, ry, rz, along the axes of
            the world. Fewer leave more freedom.
        target: Its pose, (4, 4) [m]; None is where it is at ``planner.reset``.
    """

    frame: str = setting(REQUIRED)
    rows: str | Sequence[str] = setting("pose", of=str | tuple[str, ...], kw_only=True)
    target: Any = setting(None, of=Matrix, kw_only=True)
    code: ClassVar[int] = FRAME
    called: ClassVar[str] = "{0.frame}"
    is_place: ClassVar[bool] = True

    def __post_init__(self) -> None:
        SoftTask.__post_init__(self)
        _bits(self, self.rows, names=True)
        if self.target is not None:
            object.__setattr__(self, "target", frozen(pose(self.target, f"target of {self.label}")))

    @property
    def bits(self) -> int:
        """Its rows, a bit for each."""
        return _bits(self, self.rows, names=True)


@dataclass(frozen=True, slots=True)
class RelativeTask(SoftTask):
    """A frame has a pose in another frame of the arm: two hands hold one thing.

    Args:
        frame: A frame, link or joint of the robot's model.
        to: The frame in which it has its pose.
        rows: ``pose``, ``position`` or ``orientation``.
        target: Pose of ``frame`` in ``to``, (4, 4) [m]; None is the one at ``planner.reset``.
    """

    frame: str = setting(REQUIRED)
    to: str = setting(REQUIRED)
    rows: str = setting("pose", choices=tuple(SETS), kw_only=True)
    target: Any = setting(None, of=Matrix, kw_only=True)
    code: ClassVar[int] = FRAME
    called: ClassVar[str] = "{0.frame} to {0.to}"
    is_place: ClassVar[bool] = True

    def __post_init__(self) -> None:
        SoftTask.__post_init__(self)
        _bits(self, self.rows, names=False)
        if self.frame == self.to:
            raise InputError(f"{self.label} is relative to itself; expected another frame as to")
        if self.target is not None:
            object.__setattr__(self, "target", frozen(pose(self.target, f"target of {self.label}")))

    @property
    def bits(self) -> int:
        """Its rows, a bit for each."""
        return _bits(self, self.rows, names=False)


@dataclass(frozen=True, slots=True)
class PositionTask(SoftTask):
    """A point of the arm is somewhere, for example its elbow above the table.

    Args:
        frame: A frame, link or joint of the robot's model, whose origin is meant.
        rows: Along which axes of the world, some of x, y, z. Fewer leave more freedom.
        target: Where it should be, (3,) [m]; None is where it is at ``planner.reset``.
        point: Another point of that frame, (3,) [m].
    """

    frame: str = setting(REQUIRED)
    rows: str = setting("xyz", kw_only=True)
    target: Any = setting(None, of=Three, unit="m", kw_only=True)
    point: Any = setting((0.0, 0.0, 0.0), of=Three, unit="m", kw_only=True)
    code: ClassVar[int] = FRAME
    called: ClassVar[str] = "{0.frame}"
    is_place: ClassVar[bool] = True

    def __post_init__(self) -> None:
        SoftTask.__post_init__(self)
        _rows_of(self, self.rows)
        object.__setattr__(self, "point", frozen(array("point", self.point, (3,), "(3,)")))
        if self.target is not None:
            object.__setattr__(self, "target", frozen(_place_of(self)))


@dataclass(frozen=True, slots=True)
class AxisTask(SoftTask):
    """An axis of a frame points along a direction, or at a place: a camera looks at the work.

    Args:
        frame: A frame, link or joint of the robot's model.
        axis: The axis, in that frame, (3,); its length does not matter.
        along: What it should point along, in the world, (3,); its length does not matter.
        towards: In place of ``along`` what it should point at from the frame's origin: a place, (3,) [m], or
            the name of a frame of the arm, for example the hand that a camera looks at.
    """

    frame: str = setting(REQUIRED)
    axis: Any = setting((0.0, 0.0, 1.0), of=Three, kw_only=True)
    along: Any = setting(None, of=Three, kw_only=True)
    towards: Any = setting(None, of=tuple[float, float, float] | str | None, unit="m", kw_only=True)
    code: ClassVar[int] = AXIS
    called: ClassVar[str] = "{0.frame} axis"

    def __post_init__(self) -> None:
        SoftTask.__post_init__(self)
        if (self.along is None) == (self.towards is None):
            raise InputError(
                f"{self.label} has along {self.along!r:.40} and towards {self.towards!r:.40}, "
                "expected one of them: a direction, or a place to point at"
            )
        object.__setattr__(self, "axis", direction("axis", self.axis))
        if self.along is not None:
            object.__setattr__(self, "along", direction("along", self.along))
        elif not isinstance(self.towards, str):
            object.__setattr__(self, "towards", frozen(array("towards", self.towards, (3,), "(3,)")))
        elif self.towards == self.frame:
            raise InputError(f"{self.label} points at its own frame; expected another frame or a place")


def direction(name: str, value: Any) -> Any:
    """A unit vector along ``value``."""
    found = array(name, value, (3,), "(3,)")
    length = float(np.linalg.norm(found))
    if not 1e-12 < length < np.inf:
        raise InputError(f"{name} is {found.tolist()}, expected a direction: (3,) numbers that are not all 0")
    return frozen(found / length)


@dataclass(frozen=True, slots=True)
class CentreOfMass(SoftTask):
    """The centre of mass of the arm's bodies, its load included, is somewhere.

    Args:
        rows: Along which axes of the world, some of x, y, z.
        target: Where it should be, (3,) [m]; None is where it is at ``planner.reset``.
    """

    rows: str = setting("xyz")
    target: Any = setting(None, of=Three, unit="m", kw_only=True)
    code: ClassVar[int] = MASS

    def __post_init__(self) -> None:
        SoftTask.__post_init__(self)
        _rows_of(self, self.rows)
        if self.target is not None:
            object.__setattr__(self, "target", frozen(_place_of(self)))


@dataclass(frozen=True, slots=True)
class PostureTask(SoftTask):
    """All joints are drawn to a posture.

    Args:
        target: The posture, (nv,) [rad or m]; None is where the arm is at ``planner.reset``.
    """

    target: Any = setting(None, of=tuple[float, ...] | None, unit="rad or m")
    code: ClassVar[int] = JOINT_PLACES
    can_go_first: ClassVar[bool] = False


@dataclass(frozen=True, slots=True)
class JointTask(SoftTask):
    """Some joints are drawn to places of their own.

    Args:
        joints: Where each should be, by name or 0-based index [rad or m].
    """

    joints: Mapping[str | int, float] = setting(REQUIRED, of=dict[str, float], unit="rad or m")
    code: ClassVar[int] = JOINT_PLACES
    can_go_first: ClassVar[bool] = False

    def __post_init__(self) -> None:
        SoftTask.__post_init__(self)
        if not isinstance(self.joints, Mapping) or not self.joints:
            raise InputError(
                f"joints of {self.label} is {self.joints!r:.60}, expected places by joint, for example "
                "{'panda_joint2': 0.5}"
            )
