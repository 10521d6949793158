"""The tube about a path in which the tip stays while the joints go to another posture."""

from typing import Final, final

import numpy as np

from ftqp.control.inverse_kinematics.posture_search import PostureSearch
from ftqp.control.paths.path import Path
from ftqp.control.planner.planner import Planner
from ftqp.core.checks import FloatArray

SAMPLES: Final = 200
"""Pieces of the path that are taken for straight."""
STRIDE: Final = 0.5
"""A straight way of the joints is at most so many rad times the root of what the tip may leave the path by,
in characteristic lengths: it bends away from a path by about its square."""
FINER: Final = 6.0
"""Places of a way that are looked at are so many times nearer to each other."""
KEPT: Final = 0.8
"""The joints are led within this share of the tube: what is left is for their way between places that were
looked at, and for a motion that limits bend."""
LONGEST: Final = 0.6
"""Longest straight way of the joints within a tube, however wide it is [rad or m]. A convention."""


@final
class PathTube:
    """Says how much room the tip has to the walls of a tube about a path, and leads joints back.

    The tip is within it where its place is nowhere farther from the path than ``leave``, and its rotation, as
    far as the task has rows for it, not farther than ``leave`` over the characteristic length.

    Attributes:
        stride: Longest straight way of the joints within it [rad or m].
        slack: Joints may go along directions that move the tip by less than this, per radian [m].
        spacing: Places of a way that are looked at are nearer to each other than this [rad or m].

    Source: docs/theory/ways-out.md, "Bridges on a path".
    """

    def __init__(self, planner: Planner, path: Path, leave: float) -> None:
        self._view, self._path = planner.view(), path
        own = planner.task.length
        self._leave, self._length = KEPT * leave, planner.robot.length if own is None else own
        self._times = np.linspace(0.0, path.duration, SAMPLES + 1)
        self._poses = path.sample(self._times).pose
        self._ways = np.diff(self._poses[:, :3, 3], axis=0)
        self._sizes = np.maximum((self._ways**2).sum(axis=1), 1e-300)
        rows = planner.kept_rows
        self._axis = np.asarray(planner.task.axis) if rows == "position_axis" else None
        self._turns = rows == "position_axis" or any(row.startswith("r") for row in rows)
        self.stride = min(LONGEST, STRIDE * float(np.sqrt(self._leave / self._length)))
        self.spacing, self.slack = self.stride / FINER, self._leave / self.stride

    def room(self, places: FloatArray) -> FloatArray:
        """How far the tip is from the walls, (k,) [m]; positive inside."""
        poses = self._view.poses(places)
        at, share, away = self._nearest(poses[:, :3, 3])
        room: FloatArray = self._leave - away
        if self._turns:
            R = self._poses[at + (share > 0.5), :3, :3]
            if self._axis is None:
                cosine = 0.5 * (np.einsum("kij,kij->k", R, poses[:, :3, :3]) - 1.0)
            else:
                cosine = np.einsum("ki,ki->k", R @ self._axis, poses[:, :3, :3] @ self._axis)
            turned = np.arccos(np.clip(cosine, -1.0, 1.0))
            room = np.minimum(room, self._leave - self._length * turned)
        return room

    def time_of(self, q: FloatArray) -> float:
        """The path time of the place that is nearest to the tip [s]."""
        at, share, _ = self._nearest(self._view.poses(q[None])[:, :3, 3])
        return float(self._times[at[0]] + share[0] * (self._times[at[0] + 1] - self._times[at[0]]))

    def onto(self, q: FloatArray, search: PostureSearch) -> FloatArray | None:
        """The posture near by with the tip on the path where that comes nearest; None without one."""
        return search.along(q, self._path.sample(self.time_of(q)).pose[0])

    def _nearest(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """For points, (k, 3): the nearest piece, where on it, from 0 to 1, and the distance [m]."""
        starts = points[:, None] - self._poses[:-1, :3, 3]
        share = np.clip(np.einsum("kmi,mi->km", starts, self._ways) / self._sizes, 0.0, 1.0)
        away = np.linalg.norm(starts - share[:, :, None] * self._ways, axis=2)
        at = np.argmin(away, axis=1)
        rows = np.arange(len(points))
        return at, share[rows, at], away[rows, at]
