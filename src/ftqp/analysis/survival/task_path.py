"""A task on its time grid: the poses that a robot's tip passes, sample by sample."""

import hashlib
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self, final

import numpy as np

from ftqp.control.inverse_kinematics.posture_search import robot_session, task_rows
from ftqp.control.paths import Path
from ftqp.control.planner.planner import Planner
from ftqp.control.scene.placed_shapes import Clearance, Scene
from ftqp.core.checks import BoolArray, FloatArray, array, frozen, instance, positive
from ftqp.core.errors import InputError
from ftqp.core.pose import pose as checked_pose
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.robot import Robot

BY_CAPSULE = ("body", "end_a", "end_b", "wide")
BY_OBSTACLE = ("solid", "place", "turn", "extent")
BY_PAIR = ("first", "second")
"""Fields of the room that say what is to be kept apart, by what they count."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Around:
    """What an arm keeps clear of, as it stood when this was made; made by ``around_of``."""

    scene: Scene  # What stands around it
    clearance: Clearance  # How far it keeps
    room: Any  # The room of a planner that keeps clear of it, a copy, (1,)

    def on(self, robot: Robot) -> Self:
        """The same around another arm."""
        planner = Planner(robot, scene=self.scene, clearance=self.clearance)
        room = np.array(planner.what_ifs().session.K["scene"]).reshape(1)
        return type(self)(scene=self.scene, clearance=self.clearance, room=room)

    def moved(self, robot: Robot, by: FloatArray) -> Self:
        """The same arm, with everything around it moved."""
        scene = self.scene.copy()
        for name, placed in self.scene.items():
            scene.move(name, placed.place[:3, 3] + by)
        return type(self)(scene=scene, clearance=self.clearance, room=None).on(robot)

    @property
    def numbers(self) -> list[Any]:
        """All that decides which postures are clear."""
        room = self.room[0]
        shapes = int(room["obstacles"])
        counts = (
            (BY_CAPSULE, int(room["capsules"])),
            (BY_OBSTACLE, shapes),
            (BY_PAIR, int(room["pairs"])),
            (("face",), int(room["faces_of"][:shapes].max(initial=0))),
        )
        return [room["keep"], *(room[name][:count] for names, count in counts for name in names)]


def around_of(robot: Robot, scene: Scene | None, clearance: Clearance | None) -> Around | None:
    """What an arm keeps clear of, as it stands now."""
    instance("scene", scene, Scene | None, "an ftqp.Scene or None")
    instance("clearance", clearance, Clearance | None, "an ftqp.Clearance or None")
    if scene is None and clearance is None:
        return None
    stands = Scene() if scene is None else scene.copy()
    if len(stands.balls):
        raise InputError(
            f"the scene has a cloud of {len(stands.balls)} balls, and failures are studied among shapes that "
            "have a name; add them as balls or boxes, or take the cloud away, scene.update(np.zeros((0, 4)))"
        )
    moving = [name for name, placed in stands.items() if placed.twist.any()]
    if moving:
        raise InputError(
            f"{moving[0]!r} in the scene moves, and which failures a path survives is known among things "
            f"that stand; say where it stands, scene.move({moving[0]!r}, place)"
        )
    kept = Around(scene=stands, clearance=Clearance() if clearance is None else clearance, room=None)
    return kept.on(robot)


SAMPLES = 400
"""Samples of a path whose sample time is not given."""
DIGITS = 9
"""Decimals that a digest looks at, so that the last bits of a sine do not change it."""
START_TOLERANCE = 1e-3
"""How far from the first goal the tip may start [m, or rad]."""


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class TaskPath:
    """A path of a robot's tip on an even time grid, and which rows of it count; made by ``task_path``.

    Attributes:
        robot: The arm.
        rows: Names of the task rows; of ``position_axis`` x, y, z, rx and ry, the last two of which turn
            about the x and y axes of the goal.
        axis: Whether of the orientation only the direction of the goal's z axis counts.
        goals: Poses of the samples, (N + 1, 4, 4) [m]; rows that do not count are arbitrary.
        dt: The time between samples [s].
        around: What the arm keeps clear of; None is nothing.
    """

    robot: Robot
    rows: tuple[str, ...]
    axis: bool
    goals: FloatArray
    dt: float
    around: Around | None = None

    @cached_property
    def t(self) -> FloatArray:
        """Times of the samples, (N + 1,) [s]."""
        return frozen(self.dt * np.arange(len(self.goals), dtype=np.float64))

    @cached_property
    def digest(self) -> str:
        """A hash of robot, rows, samples and what stands around: equal for the same task."""
        counted = np.array([name in self.rows for name in COMPONENTS] + [self.axis])
        parts = self.goals[:, :3, 3] * counted[:3]
        turns = self.goals[:, :3, :3] if counted[3:].any() else np.zeros(0)
        kept = [] if self.around is None else self.around.numbers
        return _hash([*_robot_numbers(self.robot), counted, np.array([self.dt]), parts, turns, *kept])

    @property
    def m(self) -> int:
        """Number of task rows."""
        return len(self.rows)

    @property
    def N(self) -> int:
        """The number of the last sample; there are N + 1."""
        return len(self.goals) - 1

    @property
    def redundancy(self) -> int:
        """r = nv - m, the dimension of self-motions."""
        return self.robot.nv - self.m

    @property
    def named_rows(self) -> str | tuple[str, ...]:
        """The rows as ``task_path`` takes them."""
        return "position_axis" if self.axis else self.rows

    @property
    def indices(self) -> tuple[int, ...]:
        """Which of x, y, z, rx, ry, rz the rows are, by index, (m,)."""
        return tuple(COMPONENTS.index(name) for name in self.rows)

    def every(self, stride: int) -> Self:
        """This task with every stride-th sample only, the first and the last one among them."""
        if stride < 1 or self.N % stride:
            raise InputError(
                f"stride is {stride}, expected a divisor of N = {self.N}, so that the grid stays even"
            )
        at = np.arange(0, self.N + 1, stride)
        return self.through(self.goals[at], self.dt * stride)

    def coarse(self, K: int) -> Self:
        """This task on a grid of K + 1 samples, or more where N is no multiple of K."""
        stride = max(1, self.N // max(1, K))
        while self.N % stride:
            stride -= 1
        return self.every(stride)

    def with_rows(self, rows: Any) -> Self:
        """This task with other rows of the same samples, as ``task_path`` takes them."""
        names, axis = task_rows(self.robot, rows)
        return replace(self, rows=names, axis=axis)

    def with_robot(self, robot: Robot) -> Self:
        """The same samples and rows of another arm."""
        around = None if self.around is None else self.around.on(robot)
        return replace(self, robot=robot, around=around)

    def among(self, around: Around | None) -> Self:
        """The same path of the same arm among other things."""
        return replace(self, around=around)

    def through(self, goals: FloatArray, dt: float | None = None) -> Self:
        """The same arm and rows among the same things on other samples, (K + 1, 4, 4) [m], dt apart [s]."""
        return replace(self, goals=frozen(goals.copy()), dt=self.dt if dt is None else dt)

    def clear(self, q: FloatArray) -> BoolArray:
        """Whether the arm is as far from everything as it is to keep at postures (k, nv), (k,)."""
        return np.asarray(self.clearances(q) >= (0.0 if self.around is None else self.around.clearance.keep))

    def clearances(self, q: FloatArray) -> FloatArray:
        """The least distance of bodies that are to be kept apart at postures (k, nv), (k,) [m]; or inf."""
        if self.around is None:
            return np.full(len(q), np.inf)
        session = robot_session(self.robot, self.indices, axis=self.axis)
        session.keep_clear(self.around.room)
        return session.clearances(q)


class MotionOnPath(ABC):
    """The role of a motion that brings its own path, as a plan does."""

    q: FloatArray

    @property
    @abstractmethod
    def task(self) -> TaskPath:
        """The path on its samples."""

    @abstractmethod
    def of(self, robot: Robot, path: Any = None) -> Self:
        """The motion with its robot, for a path if one is given."""


def task_path(
    robot: Robot,
    path: Any,
    *,
    rows: Any = "pose",
    dt: float | None = None,
    q0: Any = None,
    scene: Scene | None = None,
    clearance: Clearance | None = None,
) -> TaskPath:
    """A task on its time grid.

    Args:
        robot: The arm.
        path: A path of ``ftqp.paths``, poses (N + 1, 4, 4), or points (N + 1, 2) or (N + 1, 3), one each dt
            [m]; or a task of the same arm, whose rows and samples stay.
        rows: ``"pose"`` or ``"position"``, which are those of the robot's own rows, ``"position_axis"`` for
            position and tool axis, or names of rows.
        dt: The time between samples, > 0 [s]; None is a 400th of a path's duration; poses or points need it.
        q0: Where the arm starts, (nv,) [rad or m]; it must be at the first sample and within the limits.
            Points of a task with rotation keep the orientation that the end effector has there.
        scene: What stands around the arm, as it stands now; None is nothing.
        clearance: How far the arm keeps from it and from itself; None is ``Clearance()`` with a scene.

    Raises:
        InputError: The path is empty, too short or not finite, the rows do not fit it, the arm has too few
            joints, the start is elsewhere or outside the limits, or something in the scene moves.
    """
    instance("robot", robot, Robot, "a Robot")
    around = around_of(robot, scene, clearance)
    if isinstance(path, TaskPath):
        if path.robot is not robot and path.digest != path.with_robot(robot).digest:
            raise InputError(
                f"path is a task of another {path.robot.name} than robot, or with another tool, load or "
                "limits; expected the same arm"
            )
        if q0 is not None:
            _refuse_other_start(robot, path.rows, path.axis, path.goals[0], robot.angles(q0))
        return replace(path, robot=robot, around=path.around if around is None else around)
    robot.refuse_tree("a study of failures along a path needs")
    names, axis = task_rows(robot, rows)
    start = None if q0 is None else robot.angles(q0)
    if isinstance(path, Path):
        step = path.duration / SAMPLES if dt is None else positive("dt", dt, "s")
        count = max(1, int(np.ceil(path.duration / step - 1e-6)))
        goals = path.sample(step * np.arange(count + 1)).pose
    else:
        if dt is None:
            raise InputError("dt is None, expected the time between the given samples [s]")
        step = positive("dt", dt, "s")
        goals = _given_goals(path, names, robot, start)
    if start is not None:
        _refuse_other_start(robot, names, axis, goals[0], start)
    return TaskPath(robot=robot, rows=names, axis=axis, goals=frozen(goals), dt=step, around=around)


def robot_digest(robot: Robot) -> str:
    """A hash of the chain with its tool and load, and of the limits: equal for the same arm."""
    return _hash(_robot_numbers(robot))


def _robot_numbers(robot: Robot) -> list[Any]:
    limits = robot.limits
    bounds = [limits.q_min, limits.q_max, limits.v_max, limits.a_max]
    return [*(value for _, value in sorted(robot.chain.constants().items())), *bounds]


def _hash(numbers: list[Any]) -> str:
    whole = hashlib.sha256()
    for value in numbers:
        rounded = np.round(np.asarray(value, dtype=np.float64), DIGITS) + 0.0
        whole.update(np.int64(rounded.size).tobytes() + np.ascontiguousarray(rounded).tobytes())
    return whole.hexdigest()[:32]


def _given_goals(path: Any, names: tuple[str, ...], robot: Robot, start: FloatArray | None) -> FloatArray:
    """Goals that are given sample by sample, as poses (N + 1, 4, 4)."""
    try:
        given = np.array(path, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(
            f"path is {path!r:.60}, expected an ftqp path, poses (N + 1, 4, 4) or points (N + 1, 2 or 3)"
        ) from error
    if given.size == 0 or len(given) < 2:
        count = 0 if given.size == 0 else len(given)
        raise InputError(f"path has {count} samples, expected at least 2")
    if given.ndim not in (2, 3) or given.shape[1:] not in ((4, 4), (2,), (3,)):
        raise InputError(
            f"path has shape {given.shape}, expected poses (N + 1, 4, 4) or points (N + 1, 2) or (N + 1, 3)"
        )
    if not np.isfinite(given).all():
        at = int(np.argwhere(~np.isfinite(given))[0][0])
        raise InputError(f"sample {at} of the path is not finite: {given[at].ravel()}; expected numbers")
    if given.ndim == 3:
        for k, goal in enumerate(given):
            checked_pose(goal, f"sample {k} of the path")
        return given
    if given.shape[1] == 2 and "z" in names:
        raise InputError("path has points (N + 1, 2) and the task a row z; give points (N + 1, 3)")
    turning = [name for name in names if name.startswith("r")]
    if turning and start is None:
        raise InputError(
            f"path has points and the task the rows {', '.join(turning)}; give poses (N + 1, 4, 4), or q0, "
            "whose orientation is kept"
        )
    goals = np.tile(np.eye(4) if start is None else robot.pose(start), (len(given), 1, 1))
    goals[:, : given.shape[1], 3] = given
    return goals


def _refuse_other_start(
    robot: Robot, names: tuple[str, ...], axis: bool, goal: FloatArray, q0: FloatArray
) -> None:
    """Refuses a start outside the limits or away from the first sample."""
    limits = robot.limits
    for i, joint in enumerate(robot.joints):
        if not limits.q_min[i] <= q0[i] <= limits.q_max[i]:
            raise InputError(
                f"q0 has {q0[i]:.6g} for {joint!r}, outside its limits [{limits.q_min[i]:.6g}, "
                f"{limits.q_max[i]:.6g}]; start within them, or give the robot other limits"
            )
    off = array("error", task_errors(names, axis, goal[None], robot.pose(q0)[None])[0], (len(names),))
    if np.abs(off).max() > START_TOLERANCE:
        k = int(np.abs(off).argmax())
        raise InputError(
            f"the end effector at q0 is {abs(off[k]):.4g} off in row {names[k]} at sample 0 of the path; "
            "expected q0 at the start of the path"
        )


def task_errors(names: tuple[str, ...], axis: bool, goals: FloatArray, poses: FloatArray) -> FloatArray:
    """Errors p_d - p and the rotation vector of R_d R', of an axis its shortest turn, (K, m) [m, rad]."""
    from scipy.spatial.transform import Rotation  # slow to load

    errors = np.zeros((len(goals), 6))
    errors[:, :3] = goals[:, :3, 3] - poses[:, :3, 3]
    if axis:
        tool, wanted = poses[:, :3, 2], goals[:, :3, 2]
        across = np.cross(tool, wanted)
        sine = np.linalg.norm(across, axis=1)
        angle = np.arctan2(sine, np.einsum("ki,ki->k", tool, wanted))
        turn = across * (angle / np.where(sine > 0.0, sine, 1.0))[:, None]
        errors[:, 3:] = np.einsum("kij,ki->kj", goals[:, :3, :3], turn)
    elif any(name.startswith("r") for name in names):
        turned = goals[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], 1, 2)
        errors[:, 3:] = Rotation.from_matrix(turned).as_rotvec()
    return np.asarray(errors[:, [COMPONENTS.index(name) for name in names]])
