"""A planner's list of tasks: that of the tip, and soft ones that share what it leaves."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, final

import numpy as np

from ftqp.control.planner.own_rows import OwnRows
from ftqp.control.planner.stages import CLOCK, FREE, LED, Stage
from ftqp.control.planner.step_parts import Reference
from ftqp.control.planner.target import Target, Targets
from ftqp.control.planner.wanted import Start, Wanted
from ftqp.control.task.soft_tasks import (
    AXES,
    AxisTask,
    CentreOfMass,
    JointTask,
    LeastSquares,
    PositionTask,
    PostureTask,
    SoftTask,
    direction,
)
from ftqp.control.task.task import Task, checked_gains
from ftqp.core.checks import FloatArray, array, frozen
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.terms_room import TERMS
from ftqp.model.body_frames import centre_of_mass, frame_pose, mount_of
from ftqp.model.robot import Robot

TIP = "tip"
"""What the task of the tip is called beside the name of its frame."""


def split(task: Task | None, tasks: Any) -> tuple[Task | None, tuple[SoftTask, ...]]:
    """The task of the tip and the soft ones, of what a planner was given.

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
                f"tasks has {type(one).__name__}, expected ftqp.Task (of the tip), PositionTask, AxisTask, "
                "CentreOfMass, PostureTask, JointTask or LeastSquares"
            )
    if len(of_tip) + (task is not None) > 1:
        raise InputError("tasks has two of the tip, expected one ftqp.Task; give it in tasks or as task")
    if len(soft) > TERMS:
        raise InputError(f"tasks has {len(soft)} soft tasks, expected at most {TERMS}")
    return (of_tip[0] if of_tip else task), soft


@final
class RunningTask:
    """A soft task of a planner, whose weight and target may be changed between steps.

    Args:
        terms: The room of the planner's record that it is written into.
        at: Its place there.
        task: As it was given.
        name: What it is called.
        nv: Number of joints.

    Attributes:
        given: The task as it was given.
        name: What it is called.
    """

    __slots__ = ("_at", "_nv", "_terms", "given", "name")

    def __init__(self, terms: Any, at: int, task: SoftTask, name: str, nv: int) -> None:
        for slot, value in (("_terms", terms), ("_at", at), ("given", task), ("name", name), ("_nv", nv)):
            object.__setattr__(self, slot, value)

    given: SoftTask
    name: str
    _terms: Any
    _at: int
    _nv: int

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
        """Where the point, the axis or the joints should be, (3,) or (nv,)."""
        terms = self._terms
        by_joint = isinstance(self.given, PostureTask | JointTask)
        return frozen((terms.q_goal[self._at, : self._nv] if by_joint else terms.goal[self._at]).copy())

    @target.setter
    def target(self, value: Any) -> None:
        self.write(self.taken(value))

    @property
    def velocity(self) -> FloatArray:
        """How fast the target of a point moves, (3,) [m/s]."""
        return frozen(self._terms.rate[self._at].copy())

    @velocity.setter
    def velocity(self, value: Any) -> None:
        if not isinstance(self.given, PositionTask | CentreOfMass):
            raise InputError(f"{self.name} has no velocity: its target is no point; set its target")
        self._terms.rate[self._at] = array(f"velocity of {self.name}", value, (3,), "(3,)")

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
            case AxisTask() if self.given.along is not None:
                along: FloatArray = direction(what, value)
                return along
            case _:
                value = getattr(value, "position", value)
                return array(what, value, (3,), "(3,)")

    def write(self, value: FloatArray) -> None:
        """Take a target that ``taken`` has checked."""
        terms = self._terms
        if isinstance(self.given, PostureTask | JointTask):
            terms.q_goal[self._at, : self._nv] = value
        else:
            terms.goal[self._at] = value

    def __repr__(self) -> str:
        return f"RunningTask({self.name!r}, weight={self.weight:g})"


@final
class TaskList(Mapping[str, RunningTask]):
    """The soft tasks of a planner by name.

    Args:
        session: The planner's, whose record they are written into.
        robot: The arm.
        tasks: As they were given.
        level: What the QP decides.
        dt: The sampling period [s].

    Raises:
        InputError: An unknown frame or joint, gains too high for dt, a name that occurs twice, or a centre of
            mass of an arm without masses.
    """

    def __init__(
        self, session: Session, robot: Robot, tasks: Sequence[SoftTask], level: str, dt: float
    ) -> None:
        self._terms, self._robot = session.K.terms, robot
        self._main: Target | Targets | None = None
        found: dict[str, RunningTask] = {}
        terms = self._terms
        for at, task in enumerate(tasks):
            name = task.label
            if name in found or name in (TIP, robot.tip):
                raise InputError(f"two tasks are called {name!r}; give one of them a name=")
            terms.kind[at], terms.weight[at] = task.code, task.weight
            terms.kp[at], terms.kv[at] = checked_gains(task, level, dt, f" of {name}")
            found[name] = RunningTask(terms, at, task, name, robot.nv)
            _write(terms, at, task, robot)
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
    def names(self) -> tuple[str, ...]:
        """Of all, in their order."""
        return tuple(self._by_name)

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
            if isinstance(task, PositionTask) and task.target is None:
                T = frame_pose(robot, task.frame, start.q)
                terms.goal[one._at] = T[:3, :3] @ task.point + T[:3, 3]
            elif isinstance(task, CentreOfMass) and task.target is None:
                terms.goal[one._at] = centre_of_mass(wanted.fitting.robot, start.q)
            elif isinstance(task, PostureTask) and task.target is None:
                terms.q_goal[one._at, : robot.nv] = start.q


def _write(terms: Any, at: int, task: SoftTask, robot: Robot) -> None:
    """What never changes of a task, and its first target."""
    n = robot.nv
    terms.rows[at] = 7
    match task:
        case PositionTask() | AxisTask():
            body, T = mount_of(robot, task.frame)
            point = np.zeros(3) if isinstance(task, AxisTask) else np.array(task.point)
            terms.body[at], terms.place[at] = body, T[:3, :3] @ point + T[:3, 3]
            if isinstance(task, AxisTask):
                terms.axis[at], terms.towards[at] = T[:3, :3] @ task.axis, task.towards is not None
                terms.goal[at] = task.along if task.towards is None else task.towards
                return
        case CentreOfMass():
            if not robot.chain.constants()["mass"].any():
                raise InputError(
                    f"{robot.name} has no masses, so no centre of mass; give the model its masses"
                )
        case PostureTask():
            terms.share[at, :n] = 1.0
            if task.target is not None:
                terms.q_goal[at, :n] = array(f"target of {task.label}", task.target, (n,), "(nv,)")
            return
        case JointTask():
            for joint, where in task.joints.items():
                i = robot.joint(joint)
                terms.share[at, i] = 1.0
                terms.q_goal[at, i] = array(f"{joint} of {task.label}", [where], (1,), "a number")[0]
            return
        case LeastSquares():
            terms.m[at] = task.rows
            return
        case _:
            raise InputError(f"{type(task).__name__} is no kind of task that a planner knows")
    terms.rows[at] = sum(1 << AXES.index(row) for row in task.rows)
    if task.target is not None:
        terms.goal[at] = task.target
