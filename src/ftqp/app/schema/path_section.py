"""The table ``[path]``: what the tip follows, starting where the arm stands."""

from typing import Annotated, Literal

from pydantic import Field

from ftqp.app.schema.strict import NAMES_A_FILE, Finite, Named, Quaternion, Table, Vector, unit

Axis = Literal["x", "y", "z", "-x", "-y", "-z"] | list[Finite]
Pair = Annotated[list[Finite], Field(min_length=2, max_length=2)]

_LAW = "law of motion: quintic, cycloid, sine_squared, constant, trapezoid, or a table such as { name, ramp }"
_AXES = "two perpendicular directions in W, each x, y, z, -x, -y, -z or a vector"


class _Path(Table):
    reference: Literal["progress", "time"] | None = Field(
        None,
        description="'progress': the path waits for the arm, needs task mode scaled; 'time': the clock; "
        "by the task mode if absent",
    )
    beyond_reach: bool = Field(
        False, description="whether the path may lead farther than the stretched arm is long"
    )
    laps: Finite | None = Field(
        None,
        gt=0,
        description="how many times the path is repeated, round and round where it is closed, else there and "
        "back, > 0; followed once if absent",
    )


class _Timed(_Path):
    duration: Finite = Field(gt=0, description="how long the motion lasts, > 0", json_schema_extra=unit("s"))


class LineTable(_Timed):
    """A straight line."""

    kind: Literal["line"]
    displacement: Vector = Field(
        description="the way from start to end along W's axes", json_schema_extra=unit("m")
    )
    law: Named = Field({"name": "quintic"}, description=_LAW)


class SquareTable(_Timed):
    """A square whose first corner is the start; the sides go along +a, +b, -a, -b from rest to rest."""

    kind: Literal["square"]
    side: Finite = Field(gt=0, description="length of a side, > 0", json_schema_extra=unit("m"))
    axes: list[Axis] = Field(["x", "y"], min_length=2, max_length=2, description=_AXES)
    law: Named = Field({"name": "quintic"}, description=_LAW)


class CircleTable(_Timed):
    """A circle; the start is its point farthest along the first axis."""

    kind: Literal["circle"]
    radius: Finite = Field(gt=0, description="radius, > 0", json_schema_extra=unit("m"))
    axes: list[Axis] = Field(["x", "y"], min_length=2, max_length=2, description=_AXES)
    turns: Finite = Field(1.0, gt=0, le=1e6, description="how many times round, > 0, at most 1e6")
    law: Named = Field({"name": "quintic"}, description=_LAW)


class LissajousTable(_Timed):
    """A Lissajous figure through the start."""

    kind: Literal["lissajous"]
    amplitudes: Pair = Field(description="how far each direction swings, >= 0", json_schema_extra=unit("m"))
    cycles: Pair = Field([1.0, 2.0], description="how often each direction swings, > 0")
    phase: Finite = Field(0.0, description="phase of the second direction", json_schema_extra=unit("rad"))
    axes: list[Axis] = Field(["x", "y"], min_length=2, max_length=2, description=_AXES)
    law: Named = Field({"name": "quintic"}, description=_LAW)


class WaypointsTable(_Path):
    """A smooth curve through points of a file.

    A CSV file has a header of x, y, z [m] and if wanted t [s] and qx, qy, qz, qw; an NPZ file has the arrays
    positions (N, 3) and if wanted times (N,) and orientations (N, 4).
    """

    kind: Literal["waypoints"]
    file: str = Field(
        description="a .csv or .npz file, relative to the scenario", json_schema_extra=NAMES_A_FILE
    )
    relative: bool = Field(False, description="whether the points count from the start position")
    duration: Finite | None = Field(
        None, gt=0, description="needed when the file has no times, > 0", json_schema_extra=unit("s")
    )


class PointToPointTable(_Timed):
    """Straight to a goal pose, turning about one axis."""

    kind: Literal["point_to_point"]
    position: Vector | None = Field(
        None,
        description="position of the goal in W; the start position if absent",
        json_schema_extra=unit("m"),
    )
    orientation: Quaternion | None = Field(
        None, description="quaternion x, y, z, w of the goal in W; the start orientation if absent"
    )
    relative: bool = Field(False, description="whether the goal counts from the start pose, along W's axes")
    law: Named = Field({"name": "quintic"}, description=_LAW)


class HoldTable(_Timed):
    """The start pose, kept."""

    kind: Literal["hold"]


PathTable = Annotated[
    LineTable | SquareTable | CircleTable | LissajousTable | WaypointsTable | PointToPointTable | HoldTable,
    Field(discriminator="kind"),
]
