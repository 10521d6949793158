"""How far an arm truly is from what its further tasks ask, and from what it keeps to."""

from collections.abc import Callable
from typing import NamedTuple, final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.control.planner.running_task import joints_of, joints_off
from ftqp.control.scene.placed_shapes import CLOUD
from ftqp.control.task.keep import BOX, CONE, PLANE, Keep
from ftqp.control.task.own_task import OwnConstraint, OwnTask
from ftqp.control.task.soft_tasks import (
    AXES,
    AxisTask,
    CentreOfMass,
    PoseTask,
    PositionTask,
    RelativeTask,
    SoftTask,
)
from ftqp.core.checks import FloatArray, array
from ftqp.core.pose import rotation_vector
from ftqp.model.frames import PlacedFrames, centre_of_mass
from ftqp.model.robot import Robot
from ftqp.sim.log.signals import BODIES, ITSELF, PLANES, ROTATION, TASKS, Column

_DISTANCES = {
    PLANE: "distance of the point from its plane, positive on its side",
    BOX: "distance of the point from the nearest side of its box, positive inside",
    CONE: "angle between the axis and its cone, positive inside",
}
"""What the distance of something kept is, by its shape."""


@final
class FurtherMeasures:
    """Errors of further tasks, distances of kept points, clearances at any posture, if they have a unit."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._tasks = [
            task for task in planner.tasks.values() if not isinstance(task.given, OwnTask) or task.given.unit
        ]
        every = [kept.given for kept in planner.constraints.values()]
        self._keeps = [given for given in every if isinstance(given, Keep)]
        self._own = [given for given in every if isinstance(given, OwnConstraint) and given.unit]
        self._errors = [
            (k, error)
            for k, task in enumerate(self._tasks)
            for error in _errors_of(task.given, planner.robot)
        ]
        self._names = [str(getattr(task.given, "frame", planner.robot.tip)) for task in self._tasks]
        self._names += [_other(task.given) or planner.robot.tip for task in self._tasks]
        self._names += [keep.frame for keep in self._keeps]
        self._bodies = _met(planner)
        self._robot: Robot | None = None

    def __len__(self) -> int:
        return len(self._errors) + len(self._keeps) + len(self._own) + len(self._bodies)

    @property
    def columns(self) -> tuple[Column, ...]:
        """What is measured, in the order of the numbers."""
        tasks = [
            Column(f"{TASKS}.{self._tasks[k].name}{error.suffix}", error.unit, error.about)
            for k, error in self._errors
        ]
        return (
            *tasks,
            *(Column(f"{PLANES}.{keep.label}", keep.unit, _DISTANCES[keep.shape]) for keep in self._keeps),
            *(Column(f"{PLANES}.{own.label}", own.unit, own.about) for own in self._own),
            *(Column(f"{BODIES}.{name}", "m", _apart(name)) for name in self._bodies),
        )

    def at(self, q: FloatArray) -> FloatArray:
        """The numbers at a posture, (count,) [m or rad]; NaN where the posture is no numbers."""
        if not np.isfinite(q).all():
            return np.full(len(self), np.nan)
        robot = self._planner.robot
        if robot is not self._robot:  # it may have taken up a load
            self._robot, self._frames = robot, PlacedFrames(robot, self._names)
        poses, count, first = self._frames.at(q), len(self._tasks), len(self._errors)
        result = np.empty(len(self))
        for at, (k, error) in enumerate(self._errors):
            task = self._tasks[k]
            where = centre_of_mass(robot, q) if isinstance(task.given, CentreOfMass) else poses[k]
            goal = task.target
            if isinstance(task.given, RelativeTask):
                goal = poses[count + k] @ goal
            elif _other(task.given) is not None:
                goal = poses[count + k][:3, 3]
            result[at] = error.size(goal, q, where)
        for k, keep in enumerate(self._keeps):
            result[first + k] = keep.distance(poses[2 * count + k])
        first += len(self._keeps)
        for k, own in enumerate(self._own):
            result[first + k] = own.distance(robot, q)
        if self._bodies:
            result[first + len(self._own) :] = self._clearances(q)
        return result

    def _clearances(self, q: FloatArray) -> FloatArray:
        """How far the arm is from each thing of the scene that it can meet, and from itself [m]."""
        least, scene = dict.fromkeys(self._bodies, np.inf), self._planner.scene
        assert scene is not None
        for (_, other), d in self._planner.distances(q).items():
            if other == CLOUD:
                continue
            name = other if other in scene else ITSELF
            least[name] = min(least[name], float(d))
        return np.array(list(least.values()))

    def places(self, q: FloatArray) -> dict[str, FloatArray]:
        """Where the targets of the tasks are that have a place, by name, (3,) [m]."""
        found: dict[str, FloatArray] = {}
        robot, count = self._planner.robot, len(self._tasks)
        placed = PlacedFrames(robot, self._names).at(q)
        for k, task in enumerate(self._tasks):
            T, S, given = placed[k], placed[count + k], task.given
            place: FloatArray | None = None
            match given:
                case PoseTask():
                    place = task.target[:3, 3]
                case RelativeTask():
                    place = (S @ task.target)[:3, 3]
                case AxisTask() if given.towards is not None:
                    place = S[:3, 3] if isinstance(given.towards, str) else task.target
                case PositionTask() | CentreOfMass():
                    if isinstance(given, PositionTask):
                        place = T[:3, :3] @ given.point + T[:3, 3]
                    else:
                        place = centre_of_mass(robot, q)
                    rows = _rows(given.rows)
                    place[rows] = task.target[rows]
                case OwnTask() if (marked := given.place(robot, q)) is not None:
                    place = array(f"place of {task.name}", marked, (3,), "(3,)")
            if place is not None:
                found[task.name] = place
        return found


def _met(planner: Planner) -> list[str]:
    """What an arm keeps clear of and can meet, in the order of the scene, itself last."""
    if planner.scene is None:
        return []
    others = {other for _, other in planner.distances(planner.robot.neutral)}
    return [name for name in planner.scene if name in others] + [ITSELF] * bool(others - {*planner.scene})


def _apart(name: str) -> str:
    """What a clearance is, in a sentence."""
    of = "its own bodies from each other" if name == ITSELF else f"the arm from {name}"
    return f"distance of {of}, at the nearest; negative where they are in each other"


class _Error(NamedTuple):
    """A number that says how far a task is from its target."""

    unit: str  # Its unit
    about: str  # What it is, in a sentence
    # It, of the target, of the joint positions, and of the frame's pose or the centre of mass
    size: Callable[[FloatArray, FloatArray, FloatArray], float]
    suffix: str = ""  # What stands behind the task's name


def _other(task: SoftTask) -> str | None:
    """The frame that the target of a task moves with."""
    if isinstance(task, RelativeTask):
        return task.to
    return task.towards if isinstance(task, AxisTask) and isinstance(task.towards, str) else None


def _errors_of(task: SoftTask, robot: Robot) -> list[_Error]:
    """How the errors of a task are measured."""
    match task:
        case PoseTask() | RelativeTask():
            return _pose_errors(task)
        case PositionTask():
            rows, point = _rows(task.rows), task.point
            about = f"distance of the point from its target along {', '.join(task.rows)}"
            return [_Error("m", about, lambda p, q, T: _length((p - T[:3, :3] @ point - T[:3, 3])[rows]))]
        case CentreOfMass():
            rows = _rows(task.rows)
            about = f"distance of the centre of mass from its target along {', '.join(task.rows)}"
            return [_Error("m", about, lambda target, q, centre: _length((target - centre)[rows]))]
        case AxisTask():
            axis, at_place = task.axis, task.towards is not None
            about = "angle between the axis and where it should point"
            return [
                _Error(
                    "rad", about, lambda p, q, T: _angle(T[:3, :3] @ axis, p - T[:3, 3] if at_place else p)
                )
            ]
        case OwnTask():
            return [_Error(task.unit, task.about, lambda target, q, T: task.error(robot, q))]
        case _:
            at = joints_of(task, robot)
            slides = robot.chain.prismatic[at]
            unit = "m" if slides.all() else "rad or m" if slides.any() else "rad"
            about = "root of the sum of the squared distances of its joints from their places"
            return [_Error(unit, about, lambda target, q, T: _length(joints_off(robot, at, target, q)))]


def _pose_errors(task: PoseTask | RelativeTask) -> list[_Error]:
    """Of place and orientation, as far as they are asked for."""
    bits = task.bits
    rows = [k for k in range(3) if bits & (1 << k)]
    turns = [k for k in range(3) if bits & (1 << 3 + k)]
    found = []
    if rows:
        along = ", ".join(AXES[k] for k in rows)
        about = f"distance of the frame from its target along {along}"
        found.append(_Error("m", about, lambda D, q, T: _length((D - T)[:3, 3][rows])))
    if turns:
        about = "angle that turns the frame onto its target"

        def angle(D: FloatArray, q: FloatArray, T: FloatArray) -> float:
            return _length(rotation_vector(D[:3, :3] @ T[:3, :3].T)[turns])

        found.append(_Error("rad", about, angle, ROTATION if rows else ""))
    return found


def _rows(names: str) -> list[int]:
    return [AXES.index(name) for name in names]


def _length(error: FloatArray) -> float:
    return float(np.linalg.norm(error))


def _angle(axis: FloatArray, direction: FloatArray) -> float:
    """Between two directions [rad]; 0 where one of them has no length."""
    return float(np.arctan2(np.linalg.norm(np.cross(axis, direction)), axis @ direction))
