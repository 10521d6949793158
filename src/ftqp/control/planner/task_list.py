"""A planner's list of tasks: that of the tip, and further ones before it or with what it leaves."""

import logging
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any, final

import numpy as np

from ftqp.control.planner.collision_model import CollisionModel
from ftqp.control.planner.filled_rows import LETTERS, Filled, FilledRows, seen_of
from ftqp.control.planner.running_task import RunningTask, rows_of
from ftqp.control.planner.stages import CLOCK, FREE, LED, Stage
from ftqp.control.planner.step_parts import TIP, Off, StepLabels, no_task
from ftqp.control.planner.target import Target, Targets
from ftqp.control.task.own_task import OwnTask
from ftqp.control.task.soft_tasks import (
    FIRST,
    NEXT,
    TIPS,
    AxisTask,
    CentreOfMass,
    PoseTask,
    PositionTask,
    RelativeTask,
    SoftTask,
)
from ftqp.control.task.task import Task, checked_gains, row_indices
from ftqp.core.checks import FloatArray, frozen, sized
from ftqp.core.errors import InputError
from ftqp.kernel.entry.planner_commands import PlannerCommands
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.rows import COMPONENTS, HELD_ROWS, Asked
from ftqp.kernel.layout.scene_room import BEFORE_SCHEME, BESIDE_TIP, TERMS
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
STANDS = {TIPS: BESIDE_TIP, NEXT: BEFORE_SCHEME}
"""How a task of a level stands in the objective; the others by their weights, or not at all."""

UNKNOWN = frozen(np.array([np.nan]))
"""The error of a task of which nothing is known."""


def split(
    tip: str | None, task: Task | None, tasks: Any
) -> tuple[Task | None, tuple[SoftTask, ...], Target | None]:
    """The task of the tip and the further ones, of what a planner was given, and the tip's target, if any."""
    if tasks is None:
        return task, (), None
    if isinstance(tasks, SoftTask | Task | str | Mapping) or not isinstance(tasks, Sequence):
        raise InputError(f"tasks is {type(tasks).__name__}, expected a list of tasks, [ftqp.Task(), ...]")
    of_tip, given = [one for one in tasks if isinstance(one, Task)], None
    soft = tuple(one for one in tasks if isinstance(one, SoftTask) and not is_of_tip(one, tip))
    for one in tasks:
        if not isinstance(one, Task | SoftTask):
            raise InputError(
                f"tasks has {type(one).__name__}, expected ftqp.Task (of the end effector), PoseTask, "
                "RelativeTask, PositionTask, AxisTask, CentreOfMass, PostureTask, JointTask or LeastSquares"
            )
    for one in (one for one in tasks if is_of_tip(one, tip)):
        found, given = as_of_tip(one)
        of_tip.append(found)
    if len(of_tip) + (task is not None) > 1:
        raise InputError(
            "tasks has two of the end effector, expected one ftqp.Task; give it in tasks or as task"
        )
    if len(soft) > TERMS:
        raise InputError(f"tasks has {len(soft)} next to that of the end effector, expected at most {TERMS}")
    held = len(held_rows(soft))
    if held > HELD_ROWS:
        raise InputError(
            f"tasks on level 0 have {held} rows, expected at most {HELD_ROWS}, those of two poses; put some "
            "on level 1 or 2"
        )
    return (of_tip[0] if of_tip else task), soft, given


def is_of_tip(task: Any, tip: str | None) -> bool:
    """Whether a task of a frame is that of the tip: its frame's, with neither a name nor level 0."""
    mine = isinstance(task, PoseTask | PositionTask) and task.frame == tip and task.level != FIRST
    return mine and task.name is None and not np.any(getattr(task, "point", 0.0))


def as_of_tip(task: SoftTask) -> tuple[Task, Target | None]:
    """The task of the tip that is written as one of its frame, and its target, if it has one."""
    assert isinstance(task, PoseTask | PositionTask)
    if task.weight != 1.0:
        raise InputError(
            f"weight of {task.label} is {task.weight:g}, but it is the task of the end effector, which goes "
            "before all of level 2 and 3, counts 1 next to others on level 1 and has none; leave it out"
        )
    rows = tuple(row for k, row in enumerate(COMPONENTS) if rows_of(task) & (1 << k))
    made = Task(rows, kp=task.kp, kv=task.kv)
    if task.target is None:
        return made, None
    if isinstance(task, PoseTask):
        return made, Target(pose=task.target)
    return made, Target(position=task.target)


def held_rows(tasks: Sequence[SoftTask]) -> tuple[str, ...]:
    """Labels of the rows of those that go before the task of the tip, in their order."""
    return tuple(
        f"{task.label} {COMPONENTS[k]}"
        for task in tasks
        if task.level == FIRST
        for k in range(len(COMPONENTS))
        if rows_of(task) & (1 << k)
    )


def _rows_in_record(at: int, task: SoftTask) -> tuple[tuple[int, ...], tuple[bool, ...]]:
    """Where the rows of a task stand among those of all, and which of them count radians in metres."""
    rows = [k for k in range(len(COMPONENTS)) if rows_of(task) & (1 << k)]
    turns = isinstance(task, PoseTask | RelativeTask)
    return tuple(len(COMPONENTS) * at + k for k in rows), tuple(turns and k >= 3 for k in rows)


def split_rows(bits: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """The rows of a task that are metres, and those that are angles."""
    rows = [k for k in range(len(COMPONENTS)) if bits & (1 << k)]
    return tuple(k for k in rows if k < 3), tuple(k for k in rows if k >= 3)


def target_of_tip(value: Any) -> Any:
    """A target of the tip; a pose (4, 4) or a place (3,) is one that stands still."""
    if value is None or isinstance(value, Target | Targets | str | Mapping):
        return value
    if np.shape(getattr(value, "homogeneous", value)) == (4, 4):
        found = Target(pose=np.eye(4))
        found.pose = value  # whatever it is by now is the world's doing
        return found
    return Target(
        position=sized("target of the end effector", value, (3,), "ftqp.Target(pose=...), (4, 4) or (3,)")
    )


@final
class TaskList(Mapping[str, RunningTask]):
    """The further tasks of a planner by name."""

    def __init__(
        self,
        session: Session,
        commands: PlannerCommands,
        robot: Robot,
        tasks: Sequence[SoftTask],
        level: str,
        dt: float,
        first: Target | None = None,
    ) -> None:
        self._terms, self._robot = session.K.terms, robot
        self._fitted = robot
        self._main: Target | Targets | None = first
        found: dict[str, RunningTask] = {}
        self._failed: dict[str, str] = {}
        terms = self._terms
        terms.length = session.K.task.length
        _refuse_contradictions(tasks)
        for at, task in enumerate(tasks):
            name = task.label
            if name in found or name in (TIP, robot.tip):
                raise InputError(f"two tasks are called {name!r}; give one of them a name=")
            terms.kind[at], terms.weight[at], terms.hard[at] = task.code, task.weight, task.level == FIRST
            terms.shares[at], terms.required[at] = STANDS.get(task.level, 0), task.counts
            terms.rows[at] = rows_of(task)
            terms.kp[at], terms.kv[at] = checked_gains(task, level, dt, f" of {name}")
            found[name] = RunningTask(terms, at, task, name, robot, self._failed, commands)
        terms.count = terms.own = len(tasks)
        terms.shared = sum(task.level == TIPS for task in tasks)
        self._by_name = MappingProxyType(found)
        own = [
            Filled(
                one.label,
                one.filling(robot),
                (terms.J[at, : one.count, : robot.nv], terms.b[at, : one.count]),
            )
            for at, one in enumerate(tasks)
            if isinstance(one, OwnTask)
        ]
        self._own = FilledRows(seen_of(session, robot), robot.neutral, own, self._tell) if own else None
        self._warned: set[str] = set()

    @property
    def stage(self) -> Stage:
        """What they do in a planner's life."""
        fill = None if self._own is None else self._own.fill
        ticks = () if fill is None else (CLOCK, FREE, *LED)
        return Stage(ticks=ticks, before=fill, mount=self._mount, begin=self._begin)

    @property
    def failed(self) -> Mapping[str, str] | None:
        """Why tasks of one's own were left out of the last tick, and targets of others, by name."""
        return self._failed if self._by_name else None

    @property
    def errors(self) -> tuple[tuple[str, int], ...]:
        """Of all, in their order, the name, and how many numbers its error has."""
        return tuple(
            (name, 6 if isinstance(one.given, PoseTask | RelativeTask) else 3) for name, one in self.items()
        )

    def named(self, asked: Asked, around: CollisionModel | None, main: Task) -> StepLabels:
        """What a step says of its tasks."""
        tip = self._robot.tip
        judged = {tip: split_rows(sum(1 << k for k in row_indices(main.rows or self._robot.default_rows)))}
        for name, one in self.items():
            if isinstance(one.given, AxisTask):
                judged[name] = (), (0, 1, 2)
            elif isinstance(one.given, PoseTask | RelativeTask | PositionTask | CentreOfMass):
                judged[name] = split_rows(rows_of(one.given))
        limits = main.tolerance, main.rotation_tolerance
        rows = {name: _rows_in_record(at, one.given) for at, (name, one) in enumerate(self.items())}
        required = tuple(name for name, one in self.items() if one.given.counts)
        held = tuple(name for name, one in self.items() if one.given.level == FIRST)
        measured = {name: partial(self._off, one) for name, one in self.items() if name not in judged}
        pairs = () if around is None else lambda: around.names
        return StepLabels(
            self.errors, asked, self.failed, pairs, tip, judged, limits, rows, self._terms.length, required,
            held, measured,
        )  # fmt: skip

    def _off(self, one: RunningTask, q: FloatArray) -> Off:
        """The error of a task of joints or of one's own, and why nothing is known of it."""
        try:
            return frozen(one.error(self._fitted, q)), None
        except Exception as error:  # whatever a kind of one's own raises
            return UNKNOWN, f"error of {one.name!r} raised {type(error).__name__}: {error!s:.{LETTERS}}"

    def _tell(self, name: str, why: str) -> None:
        """Keep in mind what is wrong with the function of a task of one's own; the first time warn of it."""
        if not why:
            self._failed.pop(name, None)
            return
        self._failed[name] = f"fill {why}, so that {name!r} was left out of the tick"
        if name not in self._warned:
            self._warned.add(name)
            _LOG.warning("%s; this is said once", self._failed[name])

    def refuse_without_target(self) -> None:
        """Refuse those whose target is where the arm is at a reset, before the first one."""
        for one in self.values():
            if getattr(one.given, "target", self) is None:
                raise InputError(
                    f"the task {one.name!r} has no target yet; give it one, or call planner.reset(q) first"
                )

    @property
    def asking(self) -> tuple[str, ...]:
        """Those that ask a Python function in every tick."""
        return tuple(f"task {name!r}" for name, one in self.items() if isinstance(one.given, OwnTask))

    def __getitem__(self, name: str) -> RunningTask:
        try:
            return self._by_name[name]
        except (KeyError, TypeError):
            raise no_task(name, self._by_name) from None

    def __contains__(self, name: object) -> bool:
        return name in self._by_name

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_name)

    def __len__(self) -> int:
        return len(self._by_name)

    def distributed(self, targets: Mapping[str, Any]) -> Target | Targets:
        """The target of the tip, of targets by task; those of soft tasks are written when all are good."""
        main, others = self._main, []
        for name, target in targets.items():
            if name in (TIP, self._robot.tip):
                main = target_of_tip(target)
            else:
                one = self[name]
                others.append((one, one.taken(target)))
        if not isinstance(main, Target | Targets):
            what = "no target so far" if main is None else f"{type(main).__name__}"
            raise InputError(
                f"the target of the end effector is {what}, expected ftqp.Target(pose=...) under "
                f"{self._robot.tip!r}"
            )
        for one, target in others:
            one.write(target)
        self._main = main
        return main

    def _mount(self, robot: Robot) -> None:
        """Errors are those of the arm as it is fitted now."""
        self._fitted = robot

    def _begin(self, *_: object) -> None:
        """None was left out so far."""
        self._failed.clear()


def _refuse_contradictions(tasks: Sequence[SoftTask]) -> None:
    """Refuse two equations for one thing."""
    seen: dict[frozenset[str], tuple[str, int]] = {}
    for task in tasks:
        if task.level != FIRST or not isinstance(task, PoseTask | PositionTask | RelativeTask):
            continue
        pair = frozenset((task.frame, task.to if isinstance(task, RelativeTask) else ""))
        other, bits = seen.get(pair, ("", 0))
        if bits & rows_of(task):
            raise InputError(
                f"{other} and {task.label} are both on level 0 and ask the same of frame {task.frame!r}; "
                "leave one of them out, or put it on level 1 or 2"
            )
        seen[pair] = task.label, bits | rows_of(task)
