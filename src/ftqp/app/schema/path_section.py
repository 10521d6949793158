"""The table ``[path]``: what the tip follows, starting where the arm stands."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path as File
from typing import Any

import numpy as np

from ftqp.app.schema.reading import Options, Table
from ftqp.app.schema.robot_section import Quaternion, Vector, quaternion_rotation
from ftqp.control.paths import KINDS, Line, Path, PointToPoint, Waypoints
from ftqp.control.paths.path import Repeated
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.core.pose import transform
from ftqp.core.setting import REQUIRED, like, setting
from ftqp.sim.number_files import waypoint_table


@dataclass(frozen=True, slots=True, kw_only=True)
class WaypointFile:
    """A smooth curve through points of a file.

    A CSV file has a header of x, y, z [m] and if wanted t [s] and qx, qy, qz, qw; an NPZ file has the arrays
    positions (N, 3) and if wanted times (N,) and orientations (N, 4).
    """

    file: str = setting(REQUIRED, "a .csv or .npz file, relative to the scenario", file=True)
    relative: bool = setting(False, "whether the points count from the start position")
    duration: float | None = setting(None, "needed when the file has no times, > 0", unit="s", above=0.0)

    def path(self, origin: FloatArray, folder: File) -> Path:
        """The curve from the pose ``origin``, (4, 4)."""
        points = waypoint_table(folder / self.file)
        if self.duration is not None and points.times is not None:
            raise InputError(f"{self.file} has times, so duration cannot hold as well; leave it out")
        return Waypoints(
            origin,
            points.positions,
            orientations=points.orientations,
            times=points.times,
            duration=self.duration,
            relative=self.relative,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """A goal pose, straight to which the tip goes, turning about one axis."""

    duration: float = like(Line, "duration")
    position: Vector | None = setting(
        None, "position of the goal in W; the start position if absent", unit="m"
    )
    orientation: Quaternion | None = setting(
        None, "quaternion x, y, z, w of the goal in W; the start orientation if absent"
    )
    relative: bool = setting(False, "whether the goal counts from the start pose, along W's axes")
    law: Any = like(Line, "law")

    def path(self, origin: FloatArray, folder: File) -> Path:
        """The way to the goal from the pose ``origin``, (4, 4)."""
        position, rotation = origin[:3, 3], origin[:3, :3]
        if self.position is not None:
            position = np.array(self.position) + (position if self.relative else 0.0)
        if self.orientation is not None:
            turn = quaternion_rotation(self.orientation)
            rotation = turn @ rotation if self.relative else turn
        return PointToPoint(origin, transform(rotation, position), duration=self.duration, law=self.law)


WRITTEN: Mapping[str, type[Any]] = {**KINDS, "waypoints": WaypointFile, "point_to_point": Goal}
"""The kinds of path as files have them: those of ``ftqp.paths``, or what makes one of what is in a file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PathTable(Table):
    """What the tip follows."""

    reference: str | None = setting(
        None,
        "'progress': the path waits for the arm, needs task mode scaled; 'time': the clock; "
        "by the task mode if absent",
        choices=("progress", "time"),
    )
    beyond_reach: bool = setting(False, "whether the path may lead farther than the stretched arm is long")
    laps: float | None = setting(
        None,
        "how many times the path is repeated, round and round where it is closed, else there and back, > 0; "
        "followed once if absent",
        above=0.0,
    )
    kind: Options[Any] = setting(REQUIRED, "kind of path", kinds=WRITTEN)

    def path(self, origin: FloatArray, folder: File) -> Path:
        """The path from the pose ``origin``, (4, 4); files are relative to ``folder``."""
        written = self.kind.of in (WaypointFile, Goal)
        once = self.kind.made().path(origin, folder) if written else self.kind.made(origin)
        return once if self.laps is None else Repeated(once, self.laps)
