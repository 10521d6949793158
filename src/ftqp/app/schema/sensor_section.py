"""The tables ``[sensors]`` and ``[[sensors.faults]]``: what is measured of the joints."""

from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union

from pydantic import Field, create_model

from ftqp.app.schema.fault_sections import key
from ftqp.app.schema.strict import Finite, Table, unit
from ftqp.sim.sensors.sensor_faults import SENSOR_KINDS, SensorFault


class AnySensorFaultTable(Table):
    """What every fault of a sensor says: which joint, since when, for how many samples."""

    kind: str
    joint: str | Annotated[int, Field(ge=0)] | None = Field(
        None, description="a joint's name or its index from 0; all joints if absent"
    )
    at: Finite = Field(ge=0, description="when it begins, >= 0", json_schema_extra=unit("s"))
    samples: Annotated[int, Field(ge=1)] | None = Field(
        None, description="how many samples in a row are wrong, >= 1; all from then on if absent"
    )


def _table(kind: type[SensorFault]) -> type[AnySensorFaultTable]:
    """The table of a kind of fault, with a key for each of its settings."""
    literal: Any = Literal
    keys = {field.name: key(field, float) for field in fields(kind) if field.metadata}
    made: type[AnySensorFaultTable] = create_model(
        f"{kind.__name__}Table",
        __base__=AnySensorFaultTable,
        __doc__=(kind.__doc__ or "").partition("\n")[0],
        kind=(literal[kind.kind], ...),
        **keys,  # type: ignore[call-overload]
    )
    return made


if TYPE_CHECKING:
    SensorFaultTable = AnySensorFaultTable
else:
    SensorFaultTable = Annotated[
        Union[tuple(_table(kind) for kind in SENSOR_KINDS.values())],  # noqa: UP007  made from a tuple
        Field(discriminator="kind"),
    ]


class SensorsTable(Table):
    """Encoders between the arm and the planner; each key is one thing they do to the truth, in this order."""

    latency: int = Field(0, ge=0, description="delay in control periods, >= 0")
    quantum: Finite = Field(
        0.0, ge=0, description="smallest step of a position, >= 0", json_schema_extra=unit("rad or m")
    )
    bias: Finite | list[Finite] = Field(
        0.0, description="constant error, one number or one a joint", json_schema_extra=unit("rad or m")
    )
    position_noise: Finite = Field(
        0.0, ge=0, description="standard deviation of positions, >= 0", json_schema_extra=unit("rad or m")
    )
    velocity_noise: Finite = Field(
        0.0,
        ge=0,
        description="standard deviation of velocities, >= 0",
        json_schema_extra=unit("rad/s or m/s"),
    )
    torque_noise: Finite | None = Field(
        None,
        ge=0,
        description="standard deviation of the motors' torques, >= 0; they are not measured if absent",
        json_schema_extra=unit("N m or N"),
    )
    faults: list[SensorFaultTable] = Field([], description="what goes wrong with an encoder, and when")
