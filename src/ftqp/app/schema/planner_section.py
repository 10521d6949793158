"""The table ``[planner]``."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_serializer, model_validator

from ftqp.app.schema.drive_section import AnyDrive, DriveTable, MeasurementNoiseTable
from ftqp.app.schema.strict import NAMES_A_FILE, Finite, Limit, Named, Table, Vector, unit
from ftqp.control.following.stall import PATTERNS, StallEscape
from ftqp.control.task.directional_damping import DirectionalDamping
from ftqp.control.task.emergency import EmergencyStop


def _off(value: Any) -> Any:
    return None if value == "off" else value


DEFAULT_STOP = EmergencyStop()
Range = Annotated[list[Limit], Field(min_length=2, max_length=2)]
DEFAULT_DAMPING = DirectionalDamping()
DEFAULT_STALL = StallEscape()


class DampingTable(Table):
    """Directional damping: the task gives way along singular directions."""

    threshold: Finite = Field(
        DEFAULT_DAMPING.threshold, gt=0, description="singular value, in lengths, where damping begins, > 0"
    )
    factor: Finite = Field(DEFAULT_DAMPING.factor, gt=0, description="damping at a singularity, > 0")


class TaskTable(Table):
    """What the tip has to follow."""

    rows: str | list[str] | None = Field(
        None,
        description="'pose', 'position', 'position_axis' or some of x, y, z, rx, ry, rz; by robot if absent",
    )
    mode: Literal["slack", "hard", "scaled", "lexicographic"] = Field(
        "slack", description="what gives way when the task cannot be kept"
    )
    kp: Finite | None = Field(
        None, ge=0, description="position gain, >= 0", json_schema_extra=unit("1/s2 or 1/s")
    )
    kv: Finite | None = Field(None, ge=0, description="velocity gain, >= 0", json_schema_extra=unit("1/s"))
    length: Finite | None = Field(
        None,
        gt=0,
        description="length that makes radians comparable to metres, > 0",
        json_schema_extra=unit("m"),
    )
    axis: Vector = Field(
        [0.0, 0.0, 1.0], description="tool axis in the tip frame, for rows = 'position_axis'"
    )
    priority: Literal["weighted", "position_first"] = Field(
        "weighted", description="whether rotation counts as much as position or gets what position leaves"
    )
    slack: Finite = Field(1e-6, gt=0, le=1, description="compliance of the rows in mode slack, 1e-12 to 1")
    damping: DampingTable | None = Field(
        None, description="directional damping near singularities; none if absent"
    )
    calm: bool = Field(True, description="whether the arm comes to rest where its target stands")


class EmergencyTable(Table):
    """The emergency stop: the task error exceeds a threshold and rises on so many samples in a row."""

    position: Finite = Field(
        DEFAULT_STOP.position,
        gt=0,
        description="threshold of the position error, > 0",
        json_schema_extra=unit("m"),
    )
    rotation: Finite = Field(
        DEFAULT_STOP.rotation,
        gt=0,
        description="threshold of the rotation error, > 0",
        json_schema_extra=unit("rad"),
    )
    samples: int = Field(3, ge=1, description="rising samples in a row, >= 1")


class StallTable(Table):
    """The escape of a path that has stalled, for [path] reference = 'progress'."""

    below: Finite = Field(
        DEFAULT_STALL.below, gt=0, lt=1, description="mean path rate that counts as stalled"
    )
    after: Finite = Field(
        DEFAULT_STALL.after, gt=0, description="time constant of that mean, > 0", json_schema_extra=unit("s")
    )
    until: Finite = Field(DEFAULT_STALL.until, gt=0, lt=1, description="mean path rate that ends the escape")
    patience: Finite = Field(
        DEFAULT_STALL.patience,
        gt=0,
        description="stalled time after which the path is blocked, > 0",
        json_schema_extra=unit("s"),
    )
    standing: Finite = Field(
        DEFAULT_STALL.standing,
        gt=0,
        description="the same for a path that does not go on at all, > 0",
        json_schema_extra=unit("s"),
    )
    speed: Finite = Field(
        DEFAULT_STALL.speed, gt=0, description="speed of the joints, > 0", json_schema_extra=unit("rad/s")
    )
    patterns: list[str] = Field(
        list(PATTERNS), min_length=1, description=f"among {', '.join(PATTERNS)}, in turn"
    )
    seed: int = Field(0, ge=0, description="seed of the random pattern, >= 0")


class DetectorTable(Table):
    """What looks for failures that nobody announces."""

    bandwidths: Annotated[list[Finite], Field(min_length=2, max_length=2)] = Field(
        [60.0, 200.0], description="of the slow and of the fast observer, > 0", json_schema_extra=unit("1/s")
    )
    patience: Finite = Field(
        0.022,
        ge=0,
        description="a loss of torque is looked at for so long before it is named, >= 0",
        json_schema_extra=unit("s"),
    )
    quantum: Finite = Field(
        0.0, ge=0, description="smallest step of the encoders, >= 0", json_schema_extra=unit("rad or m")
    )
    probe_after: Finite | None = Field(
        None,
        gt=0,
        description="a joint that stood so long is moved by 1 to 2 mrad along self-motions; never if absent",
        json_schema_extra=unit("s"),
    )
    calibration: str | None = Field(
        None,
        description="a file made by a calibration; thresholds are guessed from the noise if absent",
        json_schema_extra=NAMES_A_FILE,
    )


class PlannerTable(Table):
    """How the next command is chosen."""

    dt: Finite = Field(
        1e-3, gt=0, le=1, description="control period, 0 < dt <= 1", json_schema_extra=unit("s")
    )
    level: Literal["acceleration", "velocity"] = Field("acceleration", description="what is decided")
    drive: AnyDrive = Field(DriveTable(), description="what the arm takes, or a table that says more")
    noise: MeasurementNoiseTable = Field(
        MeasurementNoiseTable(), description="how noisy measurements are believed to be"
    )
    scheme: Named = Field(
        {"name": "mvn"}, description="a scheme or a table with its gains, see `ftqp schemes`"
    )
    task: TaskTable = Field(TaskTable(), description="what the tip has to follow")
    bounds: Named = Field(
        {"name": "viability"}, description="'viability', 'jin', 'one_step' or a table with the gains of jin"
    )
    backend: Named | None = Field(
        None,
        description="a QP backend or a table with its settings, see `ftqp backends`; active_set if absent",
    )
    profile: str | None = Field(
        None, description="a backend's TOML profile, in place of backend", json_schema_extra=NAMES_A_FILE
    )
    posture: list[Finite] | None = Field(
        None,
        description="the posture that rmp returns to; the start if absent",
        json_schema_extra=unit("rad or m"),
    )
    plan: str | None = Field(
        None,
        description="a file of `ftqp plan`: the arm starts as it does, and its postures lead the null space; "
        "scheme is rmp if absent",
        json_schema_extra=NAMES_A_FILE,
    )
    branch_limits: dict[str, Range] | None = Field(
        None,
        description="ranges inside those of some joints, { joint = [low, high] }, to keep its branch",
        json_schema_extra=unit("rad or m"),
    )
    torque_limits: bool = Field(True, description="whether torque limits are constraints")
    emergency: Annotated[EmergencyTable | None, BeforeValidator(_off)] = Field(
        EmergencyTable(), description="the emergency stop; 'off' to have none"
    )

    detector: DetectorTable | None = Field(
        None, description="what looks for failures that nobody announces; nothing does if absent"
    )

    stall: Annotated[StallTable | None, BeforeValidator(_off)] = Field(
        StallTable(),
        description="the escape of a stalled path, for reference = 'progress'; 'off' to have none",
    )

    @field_serializer("emergency", "stall")
    def _or_off(self, value: Table | None) -> Any:
        return "off" if value is None else value

    @model_validator(mode="after")
    def _one_backend(self) -> "PlannerTable":
        if self.backend is not None and self.profile is not None:
            raise ValueError("has backend and profile, expected one of them")
        return self

    @model_validator(mode="before")
    @classmethod
    def _led_by_plan(cls, given: Any) -> Any:
        if isinstance(given, dict) and given.get("plan") is not None and "scheme" not in given:
            return {**given, "scheme": {"name": "rmp"}}
        return given
