"""The table ``[planner]``."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_serializer, model_validator

from ftqp.app.schema.base import Finite, Limit, Named, Table, Vector, unit
from ftqp.control.emergency import EmergencyStop


def _off(value: Any) -> Any:
    return None if value == "off" else value


DEFAULT_STOP = EmergencyStop()
Range = Annotated[list[Limit], Field(min_length=2, max_length=2)]


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


class PlannerTable(Table):
    """How the next command is chosen."""

    dt: Finite = Field(
        1e-3, gt=0, le=1, description="control period, 0 < dt <= 1", json_schema_extra=unit("s")
    )
    level: Literal["acceleration", "velocity"] = Field("acceleration", description="what is decided")
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
    profile: str | None = Field(None, description="a backend's TOML profile, in place of backend")
    posture: list[Finite] | None = Field(
        None,
        description="the posture that rmp returns to; the start if absent",
        json_schema_extra=unit("rad or m"),
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

    @field_serializer("emergency")
    def _emergency_or_off(self, value: EmergencyTable | None) -> Any:
        return "off" if value is None else value

    @model_validator(mode="after")
    def _one_backend(self) -> "PlannerTable":
        if self.backend is not None and self.profile is not None:
            raise ValueError("has backend and profile, expected one of them")
        return self
