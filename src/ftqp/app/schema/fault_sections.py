"""The tables ``[[faults]]``: what fails, and when the planner is told."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from ftqp.app.schema.strict import Finite, Table, unit


class _Fault(Table):
    joint: str | Annotated[int, Field(ge=0)] = Field(description="a joint's name or its index from 0")
    at: Finite = Field(ge=0, description="when it happens, >= 0", json_schema_extra=unit("s"))
    announced: Annotated[Finite, Field(ge=0)] | Literal["never"] | None = Field(
        None, description="when the planner is told (a time >= at, or 'never'); at once if absent"
    )

    @model_validator(mode="after")
    def _announced_after(self) -> "_Fault":
        if isinstance(self.announced, float | int) and self.announced < self.at:
            raise ValueError(f"is announced at {self.announced:g} s, before it happens at {self.at:g} s")
        return self


class LockedTable(_Fault):
    """A joint that brakes and stays where it is."""

    kind: Literal["locked"]
    mode: Literal["ramp", "instant"] = Field("ramp", description="brakes, or is at rest at once")
    deceleration: Finite | None = Field(
        None,
        gt=0,
        description="braking of a ramp, > 0; a quarter of the acceleration limit if absent",
        json_schema_extra=unit("rad/s2 or m/s2"),
    )
    reset: Literal["kinematic", "momentum", "task"] = Field(
        "kinematic", description="what the healthy joints' velocities do at an instant lock"
    )


class FreeSwingingTable(_Fault):
    """A joint without torque."""

    kind: Literal["free_swinging"]
    damping: Finite = Field(
        0.0, ge=0, description="viscous friction, >= 0", json_schema_extra=unit("N m s/rad")
    )


class DegradedTable(_Fault):
    """A joint that keeps a part of its limits."""

    kind: Literal["degraded"]
    velocity: Finite = Field(1.0, gt=0, le=1, description="part of the speed limit left, 0 < x <= 1")
    acceleration: Finite = Field(
        1.0, gt=0, le=1, description="part of the acceleration limit left, 0 < x <= 1"
    )
    torque: Finite = Field(1.0, gt=0, le=1, description="part of the torque limit left, 0 < x <= 1")
    q_min: Finite | None = Field(None, description="least position left", json_schema_extra=unit("rad or m"))
    q_max: Finite | None = Field(
        None, description="greatest position left", json_schema_extra=unit("rad or m")
    )


FaultTable = Annotated[LockedTable | FreeSwingingTable | DegradedTable, Field(discriminator="kind")]
