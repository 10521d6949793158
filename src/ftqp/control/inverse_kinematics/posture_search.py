"""The search for postures of a goal with the joints that work, in pieces of whatever size."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, final

import numpy as np

from ftqp.control.scene.placed_shapes import Clearance
from ftqp.control.task.task import ROW_SETS, row_indices
from ftqp.core.checks import BoolArray, FloatArray, array, frozen
from ftqp.core.errors import InputError
from ftqp.core.pose import pose as checked_pose
from ftqp.core.pose import transform
from ftqp.kernel.entry.session import ArmSession
from ftqp.kernel.entry.study_session import StudySession
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.kernel.layout.thresholds import FASTEST, NEARER, STRONG
from ftqp.model.robot import Robot

STEP = 0.05
"""Largest step of a traced curve [rad or m]."""

SPAN_BY_LENGTH = 6.0
"""Sliding joints without limits start within so many characteristic lengths of zero: the reach, exactly."""


def robot_session(
    robot: Robot, indices: Sequence[int], *, limited: bool = True, step: float = STEP, axis: bool = False
) -> StudySession:
    """Studies of an arm with some task rows."""
    robot.refuse_tree("a study of an arm's postures needs")
    limits, slides = robot.limits, robot.chain.prismatic
    kept = slides | limited
    low, high = np.where(kept, limits.q_min, -np.inf), np.where(kept, limits.q_max, np.inf)
    return StudySession(
        robot.chain.constants(), indices, robot.length, q_min=low, q_max=high,
        wraps=~slides & np.isinf(low) & np.isinf(high), step=step, axis=axis,
    )  # fmt: skip


def row_names(robot: Robot, rows: Any) -> tuple[str, ...]:
    """Names of task rows."""
    if isinstance(rows, str) and rows == "position_axis":
        raise InputError("rows is 'position_axis', expected 'pose', 'position' or names of rows")
    names = tuple(COMPONENTS[i] for i in row_indices(rows))
    if isinstance(rows, str) and rows not in COMPONENTS:
        names = tuple(name for name in names if name in robot.default_rows)
    if not names:
        raise InputError(
            f"rows {rows!r} leave none of {robot.name}, whose own rows are {', '.join(robot.default_rows)}; "
            "give names of rows"
        )
    return names


def may_have(robot: Robot, rows: str) -> bool:
    """Whether an arm has the joints for a set of rows, and moves in space for a tool axis."""
    own = (
        ROW_SETS[rows] if rows == "position_axis" else [n for n in ROW_SETS[rows] if n in robot.default_rows]
    )
    return robot.nv >= len(own) > 0 and (
        rows != "position_axis" or set(COMPONENTS) <= set(robot.default_rows)
    )


def task_rows(robot: Robot, rows: Any) -> tuple[tuple[str, ...], bool]:
    """Names of task rows, and whether they are those of a position and a tool axis."""
    axis = isinstance(rows, str) and rows == "position_axis"
    names = ROW_SETS["position_axis"] if axis else row_names(robot, rows)
    if axis and not set(COMPONENTS) <= set(robot.default_rows):
        raise InputError(
            f"rows is 'position_axis' and {robot.name} has the rows {', '.join(robot.default_rows)}; "
            "expected an arm that moves in space"
        )
    if robot.nv < len(names):
        raise InputError(
            f"{robot.name} has {robot.nv} joints and the task {len(names)} rows; expected at least as many "
            "joints as rows"
        )
    return names, axis


def goal_pose(goal: Any, rows: tuple[str, ...]) -> FloatArray:
    """The goal as a pose, (4, 4)."""
    shape = np.shape(getattr(goal, "homogeneous", goal))
    if shape == (4, 4):
        return checked_pose(goal, "goal")
    turning = [name for name in rows if name.startswith("r")]
    if shape in ((2,), (3,)):
        if turning:
            raise InputError(
                f"goal has shape {shape} and the task the rows {', '.join(turning)}; give a pose (4, 4)"
            )
        if shape == (2,) and "z" in rows:
            raise InputError("goal has shape (2,) and the task a row z; give a point (3,)")
        point = np.zeros(3)
        point[: shape[0]] = array("goal", goal, shape)
        return transform(np.eye(3), point)
    raise InputError(f"goal has shape {shape}, expected a point (2,) or (3,), or a pose (4, 4)")


def start_box(robot: Robot, limited: bool) -> tuple[FloatArray, FloatArray]:
    """Between which values joints are looked at, (nv,) each [rad or m]."""
    reach = SPAN_BY_LENGTH * robot.length
    span = np.where(robot.chain.prismatic, reach, np.pi)
    low, high = robot.limits.q_min, robot.limits.q_max
    kept = robot.chain.prismatic | limited
    below = np.where(kept & np.isfinite(low), low, np.where(kept & np.isfinite(high), high - 2 * span, -span))
    above = np.where(kept & np.isfinite(high), high, below + 2 * span)
    return below, above


SOLVED = 1e-9
"""Error of a posture that counts as none [m]: a thousand times what Newton steps leave, because near a
singularity they converge slowly, and far below every tolerance of a task."""
SAME = 0.05
"""Two solutions nearer to each other than this in every joint are one posture [rad or m], by convention."""
STRIDE = 0.2
"""Longest step of a joint along a self-motion to larger margins [rad or m]: plain Newton steps come back from
it."""
ROOMY = 0.2
"""A posture with this share of half of every joint's range to its nearest limit is not led further from
limits."""


class Surrounded(Protocol):
    """What knows how near an arm is to itself and to its scene; an ``ftqp.Planner`` does."""

    @property
    def clearance(self) -> Clearance | None:
        """How far the arm keeps; None where it keeps clear of nothing."""

    def distances(self, q: Any) -> dict[tuple[str, str], FloatArray]:
        """The distance of each pair of bodies at postures (S, nv), (S,) each [m]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Posture:
    """A posture of the goal, with what there is to spare.

    Attributes:
        q: Joint positions, (nv,) [rad or m]; joints that have failed are where they were.
        limit: From the joint that is nearest to an end of its range to that end [rad or m]; inf without
            limits. Joints that have failed do not count.
        sigma_min: The smallest singular value of the task's Jacobian over the joints that work, its angular
            rows times the characteristic length [m]; 0 where the end effector cannot move in all rows.
        effort: The largest share of a torque limit that holds the arm there at rest; 0 without masses or
            torque limits. Above 0.98 it is not to be relied on.
        clearance: How far the arm is from what it must not meet [m]; inf where nothing is in the way.
        time: How long the slowest joint takes from ``near`` at full speed [s]; 0 where no ``near`` was given.
        is_held: Whether motors hold the arm there, and it is clear of what it must not meet.
    """

    q: FloatArray
    limit: float
    sigma_min: float
    effort: float
    clearance: float
    time: float
    is_held: bool


@final
class PostureSearch:
    """Newton steps from many starts, within the limits that are left, with failed joints where they are.

    dq = V diag(sigma/(sigma² + 0.05 |e|²)) U' e over the joints that work, each stopped at its limits.
    The kernel makes them; a start takes about 0.15 ms for seven joints.

    Source: docs/theory/ways-out.md.
    """

    def __init__(
        self,
        robot: Robot,
        pose: Any,
        rows: Any,
        near: FloatArray,
        *,
        working: BoolArray,
        q_min: FloatArray,
        q_max: FloatArray,
        seed: int = 0,
    ) -> None:
        (names, tool), n = task_rows(robot, rows), robot.nv
        self.m, self._near, self._working, self._low, self._high = len(names), near, working, q_min, q_max
        self._weighs = robot.has_inertia
        self._session = robot_session(robot, [COMPONENTS.index(name) for name in names], axis=tool)
        self._session.aim(goal_pose(pose, names))
        study = self._session.S.study
        study.q_min[:n], study.q_max[:n] = q_min, q_max
        self._session.hold(np.flatnonzero(~working).tolist())
        low, high = start_box(robot, limited=True)
        self._box = np.maximum(low, q_min), np.minimum(high, q_max)
        self._tolerance, self._turns = SOLVED * max(1.0, robot.length), robot.continuous
        self._ranged = working & np.isfinite(q_min) & np.isfinite(q_max)
        self._random = np.random.default_rng(seed)
        self.starts = 0
        self.q, self._sigma = np.zeros((0, n)), np.zeros(0)

    def look(self, count: int) -> int:
        """Try so many further starts; returns how many postures they brought that were not known."""
        low, high = self._box
        starts = low + self._random.random((count, len(low))) * (high - low)
        if self.starts == 0:
            starts[0] = np.clip(self._near, self._low, self._high)
        self.starts += count
        starts[:, ~self._working] = self._near[~self._working]
        q, left, sigma = self._session.solutions(starts, bounded=True)
        known = len(self.q)
        for k in np.flatnonzero(self._good(q, left)):
            self._keep(q[k], float(sigma[k]))
        return len(self.q) - known

    def make_room(self, rounds: int) -> None:
        """Lead every posture so many steps along its self-motion, away from limits.

        The step is the gradient of -sum_i ((q_i - middle_i)/half range_i)² in the null space of the task,
        and it is taken back where the least share of a range to its limit has not grown.
        """
        at, low, high = self._working, self._low[self._ranged], self._high[self._ranged]
        for _ in range(rounds if at.sum() > self.m and len(self.q) else 0):
            room = self._room(self.q)
            going = np.flatnonzero(room < ROOMY)
            if not len(going):
                return
            q = self.q[going]
            A = self._session.values(q)[1][:, :, at]
            V = np.linalg.svd(A)[2][:, A.shape[1] :]
            pull = np.zeros_like(q)
            pull[:, self._ranged] = 2.0 * (low + high - 2.0 * q[:, self._ranged]) / (high - low) ** 2
            d = np.einsum("kri,krj,kj->ki", V, V, pull[:, at])
            d *= STRIDE / np.maximum(np.abs(d).max(axis=1, keepdims=True), 1e-9)
            q[:, at] = np.clip(q[:, at] + d, self._low[at], self._high[at])
            found, left, sigma = self._session.solutions(q, near=True)
            better = self._good(found, left) & (self._room(found) > room[going])
            self.q[going[better]], self._sigma[going[better]] = found[better], sigma[better]
            if not better.any():
                return

    def postures(
        self, count: int, arm: ArmSession, limits: Any, clear_of: Surrounded | None, *, ordered: bool = True
    ) -> tuple[Posture, ...]:
        """So many of the postures that were found, spread, and in the order of time or of room to limits.

        The first is the nearest one, each next one is the farthest from those that were chosen.
        """
        if not len(self.q):
            return ()
        n = len(self._near)
        top = np.where(self._working, np.minimum(limits.v_max[:n], FASTEST), np.inf)
        limit = np.where(self._working, limits.tau_max[:n], np.inf)
        time = (np.abs(self.q - self._near) / top).max(axis=1)  # at full speed
        chosen = _spread(self.q, int(np.argmin(time)), count)
        q = self.q[chosen]
        efforts, clear, kept = np.zeros(len(q)), np.full(len(q), np.inf), None
        for k, one in enumerate(q if self._weighs and np.isfinite(limit).any() else ()):
            arm.dynamics(one)
            efforts[k] = (np.abs(arm.K.kinematics.h[:n]) / limit).max()
        if clear_of is not None and (kept := clear_of.clearance) is not None:
            clear = np.min([clear, *clear_of.distances(q).values()], axis=0)
        held = (efforts <= STRONG) & (clear > (0.0 if kept is None else kept.keep - NEARER))
        at = self._working
        ends = np.minimum(q - self._low, self._high - q)[:, at]
        found = [
            Posture(
                q=frozen(q[k].copy()), limit=float(ends[k].min(initial=np.inf)),
                sigma_min=float(self._sigma[i]), effort=float(efforts[k]), clearance=float(clear[k]),
                time=float(time[i]) if ordered else 0.0, is_held=bool(held[k]),
            )
            for k, i in enumerate(chosen)
        ]  # fmt: skip
        room = self._room(q)
        order = sorted(
            range(len(found)), key=lambda k: (not found[k].is_held, found[k].time if ordered else -room[k])
        )
        return tuple(found[k] for k in order)

    def _room(self, q: FloatArray) -> FloatArray:
        """The least share of half a range that is left to its nearest end, over joints that work, (k,)."""
        at = self._ranged
        half = 0.5 * (self._high - self._low)[at]
        ends = np.minimum(q - self._low, self._high - q)[:, at] / np.maximum(half, 1e-12)
        room: FloatArray = ends.min(axis=1, initial=np.inf)
        return room

    def _good(self, q: FloatArray, left: FloatArray) -> BoolArray:
        """Whether they are solutions within the limits, (k,)."""
        at = self._working
        inside = ((q >= self._low) & (q <= self._high))[:, at].all(axis=1)
        good: BoolArray = (left <= self._tolerance) & inside
        return good

    def _keep(self, q: FloatArray, sigma: float) -> None:
        """Keep a solution that is not known yet; joints that turn without end are as near as they can be."""
        turns = np.round((q - self._near) / (2.0 * np.pi))
        q = np.where(self._turns, q - 2.0 * np.pi * turns, q)
        if len(self.q) and (np.abs(self.q - q).max(axis=1) < SAME).any():
            return
        self.q, self._sigma = np.vstack([self.q, q]), np.append(self._sigma, sigma)


def _spread(q: FloatArray, first: int, count: int) -> list[int]:
    """Indices of at most so many rows of q, (k, nv), each as far from those before it as can be."""
    chosen = [first]
    away = np.abs(q - q[first]).max(axis=1)
    while len(chosen) < min(count, len(q)):
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.abs(q - q[chosen[-1]]).max(axis=1))
    return chosen
