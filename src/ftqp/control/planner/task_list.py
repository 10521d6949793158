"""A planner's list of tasks: that of the tip, and further ones before it or with what it leaves."""

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from types import MappingProxyType
from typing import Any, final

import numpy as np

from ftqp.control.planner.filled_rows import OwnRows
from ftqp.control.planner.stages import CLOCK, FREE, LED, Stage
from ftqp.control.planner.step_parts import Reference
from ftqp.control.planner.target import Target, Targets
from ftqp.control.planner.wanted import Start, Wanted
from ftqp.control.task.soft_tasks import (
    AXES,
    FIRST,
    LAST,
    AxisTask,
    CentreOfMass,
    JointTask,
    LeastSquares,
    PoseTask,
    PositionTask,
    PostureTask,
    RelativeTask,
    SoftTask,
    direction,
)
from ftqp.control.task.task import Task, checked_gains
from ftqp.core.checks import FloatArray, array, frozen
from ftqp.core.errors import InputError, nearest
from ftqp.core.pose import pose, transform
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import TARGET_HAS_ROTATION
from ftqp.kernel.layout.rows import COMPONENTS, HELD_ROWS
from ftqp.kernel.layout.terms_room import TERMS
from ftqp.model.body_frames import centre_of_mass, frame_pose, mount_of
from ftqp.model.robot import Robot

TIP = "tip"
"""What the task of the tip is called beside the name of its frame."""
STILL = np.zeros(12)
"""Twist and acceleration of a target that does not move."""
NOTHING = np.empty(0)
"""A target that is left out."""


def split(task: Task | None, tasks: Any) -> tuple[Task | None, tuple[SoftTask, ...]]:
    """The task of the tip and the further ones, of what a planner was given.

    Raises:
        InputError: This is no list of tasks, it has two of the tip, or too many.
    """
    if tasks is None:
        return task, ()
    if isinstance(tasks, SoftTask | Task | str | Mapping) or not isinstance(tasks, Sequence):
        raise InputError(f"tasks is {type(tasks).__name__}, expected a list of tasks, [ftqp.Task(), ...]")
    of_tip = [one for one in tasks if isinstance(one, Task)]
    soft = tuple(one for one in tasks if isinstance(one, SoftTask))
    for one in tasks:
        if not isinstance(one, Task | SoftTask):
            raise InputError(
                f"tasks has {type(one).__name__}, expected ftqp.Task (of the tip), PoseTask, RelativeTask, "
                "PositionTask, AxisTask, CentreOfMass, PostureTask, JointTask or LeastSquares"
            )
    if len(of_tip) + (task is not None) > 1:
        raise InputError("tasks has two of the tip, expected one ftqp.Task; give it in tasks or as task")
    if len(soft) > TERMS:
        raise InputError(f"tasks has {len(soft)} beside that of the tip, expected at most {TERMS}")
    held = len(held_rows(soft))
    if held > HELD_ROWS:
        raise InputError(
            f"tasks on level 0 have {held} rows, expected at most {HELD_ROWS}, those of two poses; put some "
            "on level 2"
        )
    return (of_tip[0] if of_tip else task), soft


def rows_of(task: SoftTask) -> int:
    """The rows of a task, a bit for each; 0 of a task of joints, which has none."""
    match task:
        case PoseTask() | RelativeTask():
            return task.bits
        case PositionTask() | CentreOfMass():
            return sum(1 << AXES.index(row) for row in task.rows)
        case AxisTask():
            return 0b111 if task.level == LAST else 0b11  # as equations those across the axis
        case LeastSquares():
            return (1 << task.rows) - 1
        case _:
            return 0


def held_rows(tasks: Sequence[SoftTask]) -> tuple[str, ...]:
    """Labels of the rows of those that go before the task of the tip, in their order."""
    return tuple(
        f"{task.label} {COMPONENTS[k]}"
        for task in tasks
        if task.level == FIRST
        for k in range(len(COMPONENTS))
        if rows_of(task) & (1 << k)
    )


@final
class RunningTask:
    """A further task of a planner, whose weight and target may be changed between steps.

    Args:
        terms: The room of the planner's record that it is written into.
        at: Its place there.
        task: As it was given.
        name: What it is called.
        robot: The arm.

    Attributes:
        given: The task as it was given.
        name: What it is called.
    """

    __slots__ = ("_at", "_goal", "_mount", "_nv", "_other", "_terms", "_turns", "given", "name")

    def __init__(self, terms: Any, at: int, task: SoftTask, name: str, robot: Robot) -> None:
        mounts = _mounts(terms, at, task, robot)
        slots = (("_terms", terms), ("_at", at), ("given", task), ("name", name), ("_nv", robot.nv))
        turns = bool(rows_of(task) >> 3)
        views = terms.goal[at], terms.turn[at].reshape(3, 3), terms.rate[at], terms.rate_change[at]
        for slot, value in (
            *slots,
            ("_mount", mounts[0]),
            ("_other", mounts[1]),
            ("_turns", turns),
            ("_goal", views),
        ):
            object.__setattr__(self, slot, value)

    given: SoftTask
    name: str
    _terms: Any
    _at: int
    _nv: int
    _mount: FloatArray
    _other: FloatArray
    _turns: bool
    _goal: tuple[FloatArray, FloatArray, FloatArray, FloatArray]

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in ("weight", "target", "velocity"):
            raise AttributeError(
                f"{self.name}.{name} cannot be set: weight, target and velocity of a running task can; for "
                "another task make another planner"
            )
        object.__setattr__(self, name, value)

    @property
    def weight(self) -> float:
        """How much it counts, >= 0; 0 leaves it out."""
        return float(self._terms.weight[self._at])

    @weight.setter
    def weight(self, value: float) -> None:
        self._terms.weight[self._at] = self.given.check("weight", value)

    @property
    def target(self) -> FloatArray:
        """Where the frame, the point, the axis or the joints should be, (4, 4), (3,) or (nv,)."""
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
        """How fast the target moves: of a frame (6,) [m/s and rad/s], of a point (3,) [m/s]; along W."""
        return frozen(self._terms.rate[self._at, : self._moving].copy())

    @velocity.setter
    def velocity(self, value: Any) -> None:
        if not isinstance(self.given, PoseTask | PositionTask | CentreOfMass):
            raise InputError(f"{self.name} has no velocity: its target is no place of W; set its target")
        n = self._moving
        self._terms.rate[self._at, :n] = array(f"velocity of {self.name}", value, (n,), f"({n},)")

    @property
    def _moving(self) -> int:
        return 6 if isinstance(self.given, PoseTask) else 3

    def taken(self, value: Any) -> FloatArray:
        """A target as numbers, checked.

        Raises:
            InputError: A wrong shape, numbers that are not finite, or a task without a target.
        """
        what = f"target of {self.name}"
        match self.given:
            case LeastSquares():
                raise InputError(f"{self.name} has no target: its own function says what is asked")
            case JointTask() | PostureTask():
                return array(what, value, (self._nv,), "(nv,)")
            case PoseTask() | RelativeTask():
                return _moving_pose(what, value, self._turns)
            case AxisTask() if isinstance(self.given.towards, str):
                raise InputError(f"{self.name} has no target but the frame {self.given.towards!r}")
            case AxisTask() if self.given.along is not None:
                along: FloatArray = direction(what, value)
                return along
            case _:
                value = getattr(value, "position", value)
                return array(what, value, (3,), "(3,)")

    def write(self, value: FloatArray) -> None:
        """Take a target that ``taken`` has checked."""
        terms, at = self._terms, self._at
        if isinstance(self.given, PostureTask | JointTask):
            terms.q_goal[at, : self._nv] = value
        elif isinstance(self.given, PoseTask | RelativeTask):
            self._write_pose(value)
        else:
            terms.goal[at] = value

    def _write_pose(self, value: FloatArray) -> None:
        if not value.size:
            return
        T, (goal, turn, rate, ahead) = value[:16].reshape(4, 4), self._goal
        if isinstance(self.given, RelativeTask):
            T = self._other @ T
        goal[:] = T[:3, 3]
        np.matmul(T[:3, :3], self._mount[:3, :3].T, out=turn)
        rate[:], ahead[:] = value[16:22], value[22:28]

    def __repr__(self) -> str:
        return f"RunningTask({self.name!r}, weight={self.weight:g})"


@final
class TaskList(Mapping[str, RunningTask]):
    """The further tasks of a planner by name.

    Args:
        session: The planner's, whose record they are written into.
        robot: The arm.
        tasks: As they were given.
        level: What the QP decides.
        dt: The sampling period [s].
        length: What a radian counts [m].

    Raises:
        InputError: An unknown frame or joint, gains too high for dt, a name that occurs twice, or a centre of
            mass of an arm without masses.
    """

    def __init__(
        self,
        session: Session,
        robot: Robot,
        tasks: Sequence[SoftTask],
        level: str,
        dt: float,
        length: float,
    ) -> None:
        self._terms, self._robot = session.K.terms, robot
        self._main: Target | Targets | None = None
        found: dict[str, RunningTask] = {}
        terms = self._terms
        terms.length = length
        _refuse_contradictions(tasks)
        for at, task in enumerate(tasks):
            name = task.label
            if name in found or name in (TIP, robot.tip):
                raise InputError(f"two tasks are called {name!r}; give one of them a name=")
            terms.kind[at], terms.weight[at], terms.hard[at] = task.code, task.weight, task.level == FIRST
            terms.rows[at] = rows_of(task)
            terms.kp[at], terms.kv[at] = checked_gains(task, level, dt, f" of {name}")
            found[name] = RunningTask(terms, at, task, name, robot)
            _write(found[name], robot)
        terms.count = len(tasks)
        self._by_name = MappingProxyType(found)
        places = (("state", name) for name in ("q_command", "v_command", "a_command"))
        seen = Reference(*(session.view(*place)[: robot.nv] for place in places))
        own = [(at, one.label, one) for at, one in enumerate(tasks) if isinstance(one, LeastSquares)]
        self._own = OwnRows(terms, own, robot.neutral, seen) if own else None

    @property
    def stage(self) -> Stage:
        """What they do in a planner's life."""
        fill = None if self._own is None else self._own.fill
        return Stage(ticks=() if fill is None else (CLOCK, FREE, *LED), before=fill, begin=self._begin)

    @property
    def failed(self) -> Mapping[str, str] | None:
        """Why tasks of one's own were left out of the last tick, by name; None without such tasks."""
        return None if self._own is None else self._own.failed

    @property
    def errors(self) -> tuple[tuple[str, int], ...]:
        """Of all, in their order, the name, and how many numbers its error has."""
        return tuple(
            (name, 6 if isinstance(one.given, PoseTask | RelativeTask) else 3) for name, one in self.items()
        )

    @property
    def begin_where_they_are(self) -> tuple[str, ...]:
        """Names of those whose target is where the arm is at a reset."""
        return tuple(one.name for one in self.values() if getattr(one.given, "target", self) is None)

    @property
    def calls_python(self) -> bool:
        """Whether a tick needs the interpreter."""
        return self._own is not None

    def __getitem__(self, name: str) -> RunningTask:
        try:
            return self._by_name[name]
        except (KeyError, TypeError):
            known = ", ".join(self._by_name) or "none beside that of the tip"
            raise InputError(
                f"there is no task {name!r:.60}{nearest(str(name), self._by_name)}; the planner's: {known}"
            ) from None

    def __contains__(self, name: object) -> bool:
        return name in self._by_name

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_name)

    def __len__(self) -> int:
        return len(self._by_name)

    def distributed(self, targets: Mapping[str, Any]) -> Target | Targets:
        """The target of the tip, of targets by task; those of the soft tasks are written when all are good.

        Raises:
            InputError: An unknown task, a wrong target, or none of the tip so far.
        """
        main, others = self._main, []
        for name, target in targets.items():
            if name in (TIP, self._robot.tip):
                main = target
            else:
                one = self[name]
                others.append((one, one.taken(target)))
        if not isinstance(main, Target | Targets):
            what = "no target so far" if main is None else f"{type(main).__name__}"
            raise InputError(
                f"the target of the tip is {what}, expected ftqp.Target(pose=...) under {self._robot.tip!r}"
            )
        for one, target in others:
            one.write(target)
        self._main = main
        return main

    def _begin(self, start: Start, wanted: Wanted) -> None:
        """Targets that nobody has given are where the arm is."""
        robot, terms = self._robot, self._terms
        for one in self._by_name.values():
            task = one.given
            if isinstance(task, PoseTask | RelativeTask) and task.target is None:
                T = frame_pose(robot, task.frame, start.q)
                if isinstance(task, RelativeTask):
                    T = np.asarray(np.linalg.solve(frame_pose(robot, task.to, start.q), T), dtype=np.float64)
                one.write(np.concatenate([T.ravel(), STILL]))
            elif isinstance(task, PositionTask) and task.target is None:
                T = frame_pose(robot, task.frame, start.q)
                terms.goal[one._at] = T[:3, :3] @ task.point + T[:3, 3]
            elif isinstance(task, CentreOfMass) and task.target is None:
                terms.goal[one._at] = centre_of_mass(wanted.fitting.robot, start.q)
            elif isinstance(task, PostureTask) and task.target is None:
                terms.q_goal[one._at, : robot.nv] = start.q


def _moving_pose(what: str, value: Any, turns: bool) -> FloatArray:
    """A pose by rows, its twist and its acceleration, of a target or of a pose that does not move.

    Of a target that is not finite, which is the world's doing, nothing: the last one stays.
    """
    if not isinstance(value, Target | Targets):
        return np.concatenate([pose(value, what).ravel(), STILL])
    row: FloatArray = value.packed if value.packed.ndim == 1 else value.packed[value.row]
    if turns and row[TARGET_HAS_ROTATION] <= 0.0:
        raise InputError(f"{what} has no rotation, expected ftqp.Target(pose=...)")
    return row if isfinite(row.sum()) else NOTHING


def _refuse_contradictions(tasks: Sequence[SoftTask]) -> None:
    """Refuse two equations for one thing.

    Raises:
        InputError: Two tasks of level 0 ask the same rows of one frame.
    """
    seen: dict[tuple[str, str], tuple[str, int]] = {}
    for task in tasks:
        if task.level != FIRST or not isinstance(task, PoseTask | PositionTask | RelativeTask):
            continue
        pair = (task.frame, task.to if isinstance(task, RelativeTask) else "")
        other, bits = seen.get(pair, ("", 0))
        if bits & rows_of(task):
            raise InputError(
                f"{other} and {task.label} are both on level 0 and ask the same of frame {task.frame!r}; "
                "leave one of them out, or put it on level 2"
            )
        seen[pair] = task.label, bits | rows_of(task)


def _mounts(terms: Any, at: int, task: SoftTask, robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Poses of the frame of a task, and of the frame that its goal moves with, in those of their joints.

    Raises:
        InputError: A frame is unknown, does not move, or moves with the other.
    """
    frame, other = getattr(task, "frame", None), None
    if isinstance(task, RelativeTask):
        other = task.to
    elif isinstance(task, AxisTask) and isinstance(task.towards, str):
        other = task.towards
    terms.body[at], mount = (-1, np.eye(4)) if frame is None else mount_of(robot, frame)
    terms.other[at], on_other = (-1, np.eye(4)) if other is None else mount_of(robot, other)
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
                i = robot.joint(joint)
                terms.share[at, i] = 1.0
                terms.q_goal[at, i] = array(f"{joint} of {task.label}", [where], (1,), "a number")[0]
        case LeastSquares():
            terms.m[at] = task.rows
        case _:
            raise InputError(f"{type(task).__name__} is no kind of task that a planner knows")
