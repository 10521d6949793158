"""Paths: where the tip should be at each time, starting exactly where the arm is."""

from collections.abc import Mapping

from ftqp.control.paths.figures import Circle, Hold, Line, Lissajous, PointToPoint, Square
from ftqp.control.paths.path import Path, PathSample, mean_acceleration
from ftqp.control.paths.waypoints import Waypoints

KINDS: Mapping[str, type[Path]] = {
    "line": Line,
    "square": Square,
    "circle": Circle,
    "lissajous": Lissajous,
    "waypoints": Waypoints,
    "point_to_point": PointToPoint,
    "hold": Hold,
}
"""The kinds of path by the name a scenario gives them."""

__all__ = [
    "KINDS",
    "Circle",
    "Hold",
    "Line",
    "Lissajous",
    "Path",
    "PathSample",
    "PointToPoint",
    "Square",
    "Waypoints",
    "mean_acceleration",
]
