"""The table ``[base]``: what carries the arm, what moves it, what is measured of it."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_serializer

from ftqp.app.schema.strict import NAMES_A_FILE, Finite, Table, Vector, unit

Coordinate = Literal["track", "rotation", "tilt", "x", "y", "z", "rx", "ry", "rz"]
_COORDINATE = "track, rotation or tilt of a platform; x, y, z, rx, ry or rz of a free base"


def _off(value: Any) -> Any:
    return None if value == "off" else value


class StepTable(Table):
    """A step of one coordinate, at once or along a ramp."""

    kind: Literal["step"]
    coordinate: Coordinate = Field(description=_COORDINATE)
    size: Finite = Field(description="where it ends", json_schema_extra=unit("m or rad"))
    at: Finite = Field(0.0, ge=0, description="when it begins, >= 0", json_schema_extra=unit("s"))
    rate: Finite | None = Field(
        None,
        gt=0,
        description="slope of a ramp, > 0; a jump if absent",
        json_schema_extra=unit("m/s or rad/s"),
    )


class SinusoidTable(Table):
    """A sine wave that starts at 0."""

    kind: Literal["sinusoid"]
    coordinate: Coordinate = Field(description=_COORDINATE)
    amplitude: Finite = Field(description="amplitude", json_schema_extra=unit("m or rad"))
    frequency: Finite = Field(gt=0, description="frequency, > 0", json_schema_extra=unit("Hz"))
    phase: Finite = Field(0.0, description="phase", json_schema_extra=unit("rad"))


class RandomTable(Table):
    """Noise through a first-order low-pass, by the scenario's seed."""

    kind: Literal["random"]
    coordinate: Coordinate = Field(description=_COORDINATE)
    rms: Finite = Field(ge=0, description="root mean square, >= 0", json_schema_extra=unit("m or rad"))
    corner: Finite = Field(gt=0, description="corner frequency, > 0", json_schema_extra=unit("Hz"))


class RecordedTable(Table):
    """A recorded motion, read from a CSV file with a header.

    The columns are t [s] and the coordinates of the base; a free base has qx, qy, qz, qw for its attitude.
    """

    kind: Literal["recorded"]
    file: str = Field(description="a .csv file, relative to the scenario", json_schema_extra=NAMES_A_FILE)


DisturbanceTable = Annotated[
    StepTable | SinusoidTable | RandomTable | RecordedTable, Field(discriminator="kind")
]


class ObserverTable(Table):
    """The disturbance observer: its low-pass factor, or what to choose it from."""

    lowpass: Finite | None = Field(
        None, gt=0, le=1, description="low-pass factor, 0 < x <= 1; 1 if all is absent"
    )
    noise: Finite | None = Field(
        None,
        gt=0,
        description="noise of the measured tip, to choose the factor, > 0",
        json_schema_extra=unit("m"),
    )
    acceleration: Finite | None = Field(
        None,
        gt=0,
        description="acceleration of the tip by the base, to choose the factor, > 0",
        json_schema_extra=unit("m/s2"),
    )
    frozen: bool = Field(False, description="whether it stands still after a step that limits have cut")


class NoiseTable(Table):
    """White noise of every measured pose."""

    position: Finite = Field(0.0, ge=0, description="of each axis, >= 0", json_schema_extra=unit("m"))
    rotation: Finite = Field(0.0, ge=0, description="about each axis, >= 0", json_schema_extra=unit("rad"))


class _BaseTable(Table):
    disturbances: list[DisturbanceTable] = Field([], description="what moves the base")
    sensing: Literal["unknown", "known", "late"] = Field(
        "unknown", description="what is known of the base's motion; unknown: the tip is measured"
    )
    attitude: Literal["estimated", "nominal", "measured"] = Field(
        "estimated", description="base attitude by which the error is turned; nominal as in the paper"
    )
    gain: Finite = Field(1.0, gt=0, lt=2, description="share of the error that a step removes, 0 < x < 2")
    observer: Annotated[ObserverTable | None, BeforeValidator(_off)] = Field(
        None, description="the disturbance observer; 'off' to have none"
    )
    delay: Finite = Field(
        0.0, ge=0, description="how late measurements are, for sensing = 'late'", json_schema_extra=unit("s")
    )
    end_point: bool | None = Field(
        None, description="whether the tip is measured; when the base is not, if absent"
    )
    noise: NoiseTable = Field(NoiseTable(), description="noise of every measured pose")
    patience: Finite = Field(
        0.05,
        ge=0,
        description="how long the last base pose is used without a measurement, >= 0",
        json_schema_extra=unit("s"),
    )
    anti_windup: bool = Field(False, description="whether commands wait for servos that lag")

    @field_serializer("observer")
    def _observer_or_off(self, value: ObserverTable | None) -> Any:
        return "off" if value is None else value


class PlatformTable(_BaseTable):
    """A platform of three joints: track along x, rotation about z, tilt about the carried y axis."""

    kind: Literal["platform"]
    height: Finite = Field(0.30, ge=0, description="of the tilt axis, >= 0", json_schema_extra=unit("m"))
    mount: Vector = Field(
        [0.20, 0.0, 0.45], description="of the arm in the tilted frame", json_schema_extra=unit("m")
    )


class FreeBaseTable(_BaseTable):
    """A body with six degrees of freedom: x, y, z and the rotation vector rx, ry, rz."""

    kind: Literal["free"]


BaseTable = Annotated[PlatformTable | FreeBaseTable, Field(discriminator="kind")]
