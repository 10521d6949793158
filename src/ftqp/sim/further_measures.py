"""How far an arm truly is from what its soft tasks ask, and from the planes that it keeps to."""

from collections.abc import Callable
from typing import Any, final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.control.task.soft_tasks import (
    AXES,
    AxisTask,
    CentreOfMass,
    JointTask,
    LeastSquares,
    PositionTask,
    PostureTask,
    SoftTask,
)
from ftqp.core.checks import FloatArray
from ftqp.model.placed_frames import PlacedFrames
from ftqp.model.robot import Robot
from ftqp.sim.log.further_signals import PLANES, TASKS, Measured


@final
class FurtherMeasures:
    """Errors of the soft tasks and distances of the kept points of a planner, at any posture.

    A task of the user's own has no error that could be known here, and is left out.

    Args:
        planner: The planner, whose targets may change from call to call.
    """

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._tasks = [
            task for task in planner.tasks.values() if not isinstance(task.given, LeastSquares)
        ]  # fmt: skip
        self._keeps = [kept.given for kept in planner.constraints.values()]
        self._errors = [_error_of(task.given, planner.robot) for task in self._tasks]
        self._names = [str(getattr(task.given, "frame", planner.robot.tip)) for task in self._tasks]
        self._names += [keep.frame for keep in self._keeps]
        self._robot: Robot | None = None

    def __len__(self) -> int:
        return len(self._names)

    @property
    def all(self) -> tuple[Measured, ...]:
        """What is measured, in the order of the numbers."""
        robot = self._planner.robot
        tasks = [Measured(TASKS, task.name, *_meaning(task.given, robot)) for task in self._tasks]
        about = "distance of the point from its plane, positive on its side"
        return (*tasks, *(Measured(PLANES, keep.label, "m", about) for keep in self._keeps))

    def at(self, q: FloatArray) -> FloatArray:
        """The numbers at a posture, (count,) [m or rad]; NaN where the posture is no numbers.

        Args:
            q: Joint positions, (nv,) [rad or m].
        """
        if not np.isfinite(q).all():
            return np.full(len(self), np.nan)
        robot = self._planner.robot
        if robot is not self._robot:  # it may have taken up a load
            self._robot, self._frames = robot, PlacedFrames(robot, self._names)
        poses, count = self._frames.at(q), len(self._tasks)
        result = np.empty(len(self))
        for k, (task, error) in enumerate(zip(self._tasks, self._errors, strict=True)):
            where = self._frames.centre_of_mass(q) if isinstance(task.given, CentreOfMass) else poses[k]
            result[k] = error(task.target, q, where)
        for k, keep in enumerate(self._keeps):
            T = poses[count + k]
            result[count + k] = keep.normal @ (T[:3, :3] @ keep.point + T[:3, 3]) - keep.offset
        return result

    def places(self, q: FloatArray) -> dict[str, FloatArray]:
        """Where the targets of the tasks are that have a place, by name, (3,) [m].

        Along axes that do not count it is that of the point itself.

        Args:
            q: Joint positions, (nv,) [rad or m].
        """
        found: dict[str, FloatArray] = {}
        poses = PlacedFrames(self._planner.robot, self._names)
        for task, T in zip(self._tasks, poses.at(q), strict=False):
            match task.given:
                case PositionTask():
                    place = T[:3, :3] @ task.given.point + T[:3, 3]
                case CentreOfMass():
                    place = poses.centre_of_mass(q)
                case AxisTask() if task.given.towards is not None:
                    found[task.name] = task.target
                    continue
                case _:
                    continue
            rows = _rows(task.given.rows)
            place[rows] = task.target[rows]
            found[task.name] = place
        return found

    def along(self, q: FloatArray) -> FloatArray:
        """The numbers at many postures with the targets as they are now, (K, count).

        Args:
            q: Joint positions, (K, nv) [rad or m].
        """
        return np.array([self.at(one) for one in q]).reshape(len(q), len(self))


_Error = Callable[[FloatArray, FloatArray, FloatArray], float]
"""An error's size, of the target, of the joint positions, and of the frame's pose or the centre of mass."""


def _error_of(task: SoftTask, robot: Robot) -> _Error:
    """How the error of a task is measured."""
    match task:
        case PositionTask():
            rows, point = _rows(task.rows), task.point
            return lambda target, q, T: _length((target - T[:3, :3] @ point - T[:3, 3])[rows])
        case CentreOfMass():
            rows = _rows(task.rows)
            return lambda target, q, centre: _length((target - centre)[rows])
        case AxisTask():
            axis, towards = task.axis, task.towards is not None
            return lambda target, q, T: _angle(T[:3, :3] @ axis, target - T[:3, 3] if towards else target)
        case _:
            at, endless = _joints(task, robot), robot.chain.continuous

            def joints(target: FloatArray, q: FloatArray, _: FloatArray) -> float:
                off = target - q
                off = np.where(endless, np.remainder(off + np.pi, 2.0 * np.pi) - np.pi, off)
                return _length(off[at])

            return joints


def _meaning(task: SoftTask, robot: Robot) -> tuple[str, str]:
    """Unit and sentence of an error."""
    match task:
        case PositionTask():
            return "m", f"distance of the point from its target along {', '.join(task.rows)}"
        case CentreOfMass():
            return "m", f"distance of the centre of mass from its target along {', '.join(task.rows)}"
        case AxisTask():
            return "rad", "angle between the axis and where it should point"
        case _:
            slides = robot.chain.prismatic[_joints(task, robot)]
            unit = "m" if slides.all() else "rad or m" if slides.any() else "rad"
            return unit, "root of the sum of the squared distances of its joints from their places"


def _joints(task: Any, robot: Robot) -> list[int]:
    """The joints of a task of joints."""
    if isinstance(task, PostureTask):
        return list(range(robot.nv))
    assert isinstance(task, JointTask)
    return [robot.joint(joint) for joint in task.joints]


def _rows(names: str) -> list[int]:
    return [AXES.index(name) for name in names]


def _length(error: FloatArray) -> float:
    return float(np.linalg.norm(error))


def _angle(axis: FloatArray, direction: FloatArray) -> float:
    """Between two directions [rad]; 0 where one of them has no length."""
    return float(np.arctan2(np.linalg.norm(np.cross(axis, direction)), axis @ direction))
