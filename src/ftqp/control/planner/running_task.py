"""A further task of a planner that runs: what of it may change between steps, and how it is written down."""

import logging
from math import isfinite
from typing import Any, Final, final

import numpy as np

from ftqp.control.planner.target import Target, Targets
from ftqp.control.task.own_task import OwnTask
from ftqp.control.task.soft_tasks import (
    AXES,
    FIRST,
    AxisTask,
    CentreOfMass,
    JointTask,
    PoseTask,
    PositionTask,
    PostureTask,
    RelativeTask,
    SoftTask,
    direction,
)
from ftqp.core.checks import FloatArray, array, frozen, perhaps_degrees, sized
from ftqp.core.errors import InputError
from ftqp.core.pose import has_last_row, is_rotation_matrix, transform
from ftqp.kernel.entry.planner_commands import PlannerCommands
from ftqp.kernel.layout.enums import TARGET_HAS_ROTATION, TARGET_SIZE
from ftqp.model.frames import mount_of
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
TARGETS_GIVEN_LATER = (PoseTask, RelativeTask, PositionTask, CentreOfMass, PostureTask)
"""Kinds of tasks whose target may be where the arm begins."""
STILL = np.zeros(12)
"""Twist and acceleration of a target that does not move."""
NOT_FINITE: Final = "is not finite"
NO_ROTATION: Final = "has a rotation part that is none"
TRANSPOSED: Final = "has a last row other than 0 0 0 1, as a transposed pose has"
NO_DIRECTION: Final = "has no direction"
"""Why a target is left out, and the last one stays: the world's doing, and no mistake of the program."""


def rows_of(task: SoftTask) -> int:
    """The rows of a task, a bit for each; 0 of a task of joints, which has none."""
    match task:
        case PoseTask() | RelativeTask():
            return task.bits
        case PositionTask() | CentreOfMass():
            return sum(1 << AXES.index(row) for row in task.rows)
        case AxisTask():
            return 0b11 if task.level == FIRST else 0b111  # as equations those across the axis
        case OwnTask():
            return (1 << task.count) - 1
        case _:
            return 0


def joints_of(task: SoftTask, robot: Robot) -> list[int]:
    """The joints of a task of joints; of those that follow another one that one."""
    if isinstance(task, JointTask):
        return [int(robot.chain.lead[robot.joint(joint)]) for joint in task.joints]
    return list(range(robot.nv))


def joints_off(robot: Robot, at: list[int], target: FloatArray, q: FloatArray) -> FloatArray:
    """From joints to their places, the short way round where a joint turns without end, (k,) [rad or m]."""
    off = target - q
    endless = np.remainder(off + np.pi, 2.0 * np.pi) - np.pi
    found: FloatArray = np.where(robot.chain.continuous, endless, off)[at]
    return found


@final
class RunningTask:
    """A further task of a planner, whose weight and target may be changed between steps.

    Attributes:
        given: The task as it was given.
        name: What it is called.
    """

    def __init__(
        self, terms: Any, at: int, task: SoftTask, name: str, robot: Robot, failed: dict[str, str],
        commands: PlannerCommands,
    ) -> None:  # fmt: skip
        mount, other = _mounts(terms, commands.given, at, task, robot)
        vars(self).update(
            given=task, name=name, _terms=terms, _at=at, _nv=robot.nv, _mount=mount, _other=other,
            _turns=bool(rows_of(task) >> 3), _goal=(terms.goal[at], terms.rate[at], terms.rate_change[at]),
            _commands=commands, _failed=failed, _warned=False,
        )  # fmt: skip
        _write(self, robot)

    given: SoftTask
    name: str
    _terms: Any
    _at: int
    _nv: int
    _mount: FloatArray
    _other: FloatArray
    _turns: bool
    _goal: tuple[FloatArray, FloatArray, FloatArray]
    _commands: PlannerCommands
    _failed: dict[str, str]
    _warned: bool

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in ("weight", "target", "velocity"):
            raise AttributeError(
                f"{self.name}.{name} cannot be set: weight, target and velocity of a running task can; for "
                "another task make another planner"
            )
        object.__setattr__(self, name, value)

    @property
    def weight(self) -> float:
        """How much it counts, >= 0; 0 leaves it out, and on level 0 nothing else of it matters."""
        return float(self._terms.weight[self._at])

    @weight.setter
    def weight(self, value: float) -> None:
        number = self.given.check("weight", value)
        if self.given.level == FIRST and number not in (0.0, 1.0, self.given.weight):
            raise InputError(
                f"weight of {self.name} is {number:g}, but a task of level 0 is an equation, which no weight "
                "makes firmer; expected 0, which leaves it out, or 1"
            )
        self._terms.weight[self._at] = number

    @property
    def target(self) -> FloatArray:
        """Where the frame, the point, the axis or the joints should be, (4, 4), (3,) or (nv,).

        One that is not finite is left out, and the last one stays: ``step.tasks[name].failed`` says so.
        """
        terms = self._terms
        if isinstance(self.given, PoseTask | RelativeTask):
            R, p = self._other[:3, :3].T, self._other[:3, 3]
            turn = terms.turn[self._at].reshape(3, 3)
            return frozen(transform(R @ turn @ self._mount[:3, :3], R @ (terms.goal[self._at] - p)))
        by_joint = isinstance(self.given, PostureTask | JointTask)
        return frozen((terms.q_goal[self._at, : self._nv] if by_joint else terms.goal[self._at]).copy())

    @target.setter
    def target(self, value: Any) -> None:
        self.write(self.taken(value))

    @property
    def velocity(self) -> FloatArray:
        """How fast the target moves: of a frame (6,) [m/s and rad/s], of a point (3,) [m/s]; along W.

        As of a target, one that is not finite is left out.
        """
        return frozen(self._terms.rate[self._at, : self._moving].copy())

    @velocity.setter
    def velocity(self, value: Any) -> None:
        if not isinstance(self.given, PoseTask | PositionTask | CentreOfMass):
            raise InputError(f"{self.name} has no velocity: its target is no place of W; set its target")
        n = self._moving
        rate = sized(f"velocity of {self.name}", value, (n,))
        if np.isfinite(rate).all():
            self._terms.rate[self._at, :n] = rate
        else:
            self._leave_out("velocity", NOT_FINITE)

    @property
    def _moving(self) -> int:
        return 6 if isinstance(self.given, PoseTask) else 3

    def taken(self, value: Any) -> FloatArray | str:
        """A target as numbers, checked; or why it is left out, which is the world's doing."""
        what = f"target of {self.name}"
        match self.given:
            case OwnTask():
                raise InputError(f"{self.name} has no target: its own function says what is asked")
            case JointTask() | PostureTask():
                found = sized(what, value, (self._nv,), "(nv,)")
            case PoseTask() | RelativeTask():
                return _moving_pose(what, value, self._turns)
            case AxisTask() if isinstance(self.given.towards, str):
                raise InputError(f"{self.name} has no target but the frame {self.given.towards!r}")
            case PositionTask() if isinstance(value, Target | Targets):
                found = _moving_place(value)
            case _:
                found = sized(what, getattr(value, "position", value), (3,))
        if not isfinite(found.sum()):
            return NOT_FINITE
        if isinstance(self.given, AxisTask) and self.given.along is not None:
            if not found.any():
                return NO_DIRECTION
            direction(what, found)
        return found

    def write(self, value: FloatArray | str) -> None:
        """Take a target that ``taken`` has checked; one that is left out is named, and the last one stays."""
        terms, at = self._terms, self._at
        if isinstance(value, str):
            self._leave_out("target", value)
            return
        if self._failed:
            self._failed.pop(self.name, None)
        if isinstance(self.given, PostureTask | JointTask):
            terms.q_goal[at, : self._nv] = value
        elif isinstance(self.given, PoseTask | RelativeTask):
            self._commands.aim(at, value)
        elif value.shape == (9,):
            goal, rate, ahead = self._goal
            goal[:], rate[:3], ahead[:3] = value[:3], value[3:6], value[6:]
        elif isinstance(self.given, AxisTask):
            row = np.zeros(TARGET_SIZE)
            row[[3, 7, 11]] = value
            self._commands.aim(at, row)
        else:
            terms.goal[at] = value

    def _leave_out(self, what: str, why: str) -> None:
        """Say that the last target, or its velocity, stays; the first time by a warning, too."""
        self._failed[self.name] = f"{what} {why}, so that the last one of {self.name!r} stays"
        if not self._warned:
            vars(self)["_warned"] = True
            _LOG.warning("%s; this is said once", self._failed[self.name])

    def error(self, robot: Robot, q: FloatArray) -> FloatArray:
        """How far a task of joints is from its places, (k,) [rad or m]; of one's own what it says, (1,).

        Args:
            robot: The arm as it is loaded now.
            q: Joint positions, (nv,) [rad or m].
        """
        if isinstance(self.given, OwnTask):
            return np.array([float(self.given.error(robot, q))])
        return joints_off(robot, joints_of(self.given, robot), self.target, q)

    def __repr__(self) -> str:
        return f"RunningTask({self.name!r}, weight={self.weight:g})"


def _moving_pose(what: str, value: Any, turns: bool) -> FloatArray | str:
    """A pose by rows, its twist and its acceleration, of a target or of a pose that does not move."""
    if not isinstance(value, Target | Targets):
        row = np.concatenate([sized(what, getattr(value, "homogeneous", value), (4, 4)).ravel(), STILL])
    else:
        row = value.packed if value.packed.ndim == 1 else value.packed[value.row]
        if turns and row[TARGET_HAS_ROTATION] <= 0.0:
            raise InputError(f"{what} has no rotation, expected ftqp.Target(pose=...)")
    if not isfinite(row.sum()):
        return NOT_FINITE
    T = row[:16].reshape(4, 4)
    if not is_rotation_matrix(T[:3, :3]):
        return NO_ROTATION
    return row if has_last_row(T) else TRANSPOSED


def _moving_place(value: Target | Targets) -> FloatArray:
    """A place, its velocity and its acceleration, (9,), of a target."""
    row: FloatArray = value.packed if value.packed.ndim == 1 else value.packed[value.row]
    return np.concatenate([row[[3, 7, 11]], row[16:19], row[22:25]])


def _mounts(terms: Any, given: Any, at: int, task: SoftTask, robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Poses of the frame of a task, and of the frame that its goal moves with, in those of their joints."""
    frame, other = getattr(task, "frame", None), None
    if isinstance(task, RelativeTask):
        other = task.to
    elif isinstance(task, AxisTask) and isinstance(task.towards, str):
        other = task.towards
    terms.body[at], mount = (-1, np.eye(4)) if frame is None else mount_of(robot, frame)
    terms.other[at], on_other = (-1, np.eye(4)) if other is None else mount_of(robot, other)
    given.mount[at], given.onto[at] = mount[:3, :3].ravel(), on_other[:3].ravel()
    begins = isinstance(task, TARGETS_GIVEN_LATER) and task.target is None
    has_none = isinstance(task, OwnTask) or (isinstance(task, AxisTask) and other is not None)
    given.begins[at] = -1 if has_none else int(begins)
    if frame is not None and terms.body[at] == terms.other[at]:
        what = "does not move with any joint" if other is None else f"does not move against {other!r}"
        raise InputError(f"frame {frame!r} of {task.label} {what}")
    return mount, on_other


def _write(one: RunningTask, robot: Robot) -> None:
    """What never changes of a task, and its first target."""
    terms, at, task, n, mount = one._terms, one._at, one.given, robot.nv, one._mount
    match task:
        case PoseTask() | RelativeTask():
            terms.place[at] = mount[:3, 3]
            if task.target is not None:
                one.write(np.concatenate([task.target.ravel(), STILL]))
        case PositionTask():
            terms.place[at] = mount[:3, :3] @ task.point + mount[:3, 3]
            if task.target is not None:
                terms.goal[at] = task.target
        case AxisTask():
            terms.place[at], terms.axis[at] = mount[:3, 3], mount[:3, :3] @ task.axis
            terms.towards[at] = task.towards is not None
            if isinstance(task.towards, str):
                terms.goal[at] = one._other[:3, 3]
            else:
                terms.goal[at] = task.along if task.towards is None else task.towards
        case CentreOfMass():
            if not robot.chain.constants()["mass"].any():
                raise InputError(
                    f"{robot.name} has no masses, so no centre of mass; give the model its masses"
                )
            if task.target is not None:
                terms.goal[at] = task.target
        case PostureTask():
            terms.share[at, :n] = 1.0
            if task.target is not None:
                terms.q_goal[at, :n] = array(f"target of {task.label}", task.target, (n,), "(nv,)")
        case JointTask():
            for joint, where in task.joints.items():
                place = array(f"{joint} of {task.label}", [where], (1,), "a number")[0]
                m = robot.joint(joint)
                least, most = robot.limits.q_min[m], robot.limits.q_max[m]
                if not least <= place <= most:
                    raise InputError(
                        f"{robot.joints[m]} of {task.label} is {place:g}, expected a place within its "
                        f"limits, {least:g} to {most:g}{perhaps_degrees(max(least - place, place - most))}"
                    )
                i = robot.chain.lead[m]  # where its leader has to be for it
                terms.share[at, i] = 1.0
                terms.q_goal[at, i] = (place - robot.chain.offset[m]) / robot.chain.ratio[m]
        case OwnTask():
            terms.m[at] = task.count
        case _:
            raise InputError(f"{type(task).__name__} is no kind of task that a planner knows")
