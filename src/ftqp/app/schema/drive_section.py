"""The tables ``[planner.drive]`` and ``[planner.noise]``: what the arm takes, and how well it is measured."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from ftqp.app.schema.strict import Finite, Table, unit


class DriveTable(Table):
    """What the arm takes, and what the planner believes of the loop inside it."""

    kind: Literal["position", "velocity", "torque"] = Field("position", description="what the arm takes")
    bandwidth: Finite | None = Field(
        None,
        gt=0,
        description="of the arm's own servo, > 0; unknown if absent",
        json_schema_extra=unit("rad/s"),
    )
    takes_velocity: bool = Field(True, description="whether a position servo is given velocities, too")
    lead: Finite | None = Field(
        None,
        ge=0,
        description="how far ahead positions are sent, >= 0; by the servo if absent",
        json_schema_extra=unit("s"),
    )
    latency: Finite = Field(
        0.0, ge=0, description="how late measurements come, >= 0", json_schema_extra=unit("s")
    )
    stiffness: Finite | None = Field(
        None,
        gt=0,
        description="of the loop around a torque arm, > 0; by latency if absent",
        json_schema_extra=unit("1/s"),
    )


class MeasurementNoiseTable(Table):
    """How noisy the planner believes its measurements to be."""

    q: Finite = Field(0.0, ge=0, description="of positions, >= 0", json_schema_extra=unit("rad or m"))
    tau: Finite = Field(0.0, ge=0, description="of torques, >= 0", json_schema_extra=unit("N m or N"))


def _kind(value: Any) -> Any:
    """``"torque"`` is short for ``{ kind = "torque" }``."""
    if isinstance(value, str):
        return {"kind": value}
    if not isinstance(value, Mapping | DriveTable):
        raise ValueError(f"is {value!r:.60}, expected position, velocity, torque or a table with a kind")
    return value


AnyDrive = Annotated[DriveTable, BeforeValidator(_kind)]
"""A kind of drive, or a table that says more."""
