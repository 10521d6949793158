"""The table ``[robot]``."""

from typing import Any, Literal

from pydantic import Field, model_validator

from ftqp.app.schema.strict import NAMES_A_FILE, Finite, PerJoint, Quaternion, Table, Vector, unit


class LimitsTable(Table):
    """Limits that replace those of the model: one number for all joints, or one each; inf means no limit."""

    q_min: PerJoint | None = Field(None, description="least positions", json_schema_extra=unit("rad or m"))
    q_max: PerJoint | None = Field(None, description="greatest positions", json_schema_extra=unit("rad or m"))
    v_max: PerJoint | None = Field(
        None, description="speed limits, > 0", json_schema_extra=unit("rad/s or m/s")
    )
    a_max: PerJoint | None = Field(
        None, description="acceleration limits, > 0", json_schema_extra=unit("rad/s2 or m/s2")
    )
    tau_max: PerJoint | None = Field(
        None, description="torque limits, > 0", json_schema_extra=unit("N m or N")
    )
    j_max: PerJoint | None = Field(
        None,
        description="jerk limits of motions to a posture, > 0",
        json_schema_extra=unit("rad/s3 or m/s3"),
    )


class PayloadTable(Table):
    """A load at the tip."""

    mass: Finite = Field(gt=0, description="mass, > 0", json_schema_extra=unit("kg"))
    com: Vector = Field(
        [0.0, 0.0, 0.0], description="centre of mass in the tip frame", json_schema_extra=unit("m")
    )


class ToolTable(Table):
    """Another controlled point, in the frame of the tip; it weighs nothing."""

    position: Vector = Field(
        [0.0, 0.0, 0.0], description="of the point in the tip frame", json_schema_extra=unit("m")
    )
    orientation: Quaternion = Field(
        [0.0, 0.0, 0.0, 1.0], description="quaternion x, y, z, w of its axes in the tip frame"
    )


class RobotTable(Table):
    """The arm: exactly one of ``name``, ``urdf``, ``mjcf`` and ``dh``."""

    name: str | None = Field(None, description="a robot of the catalog, see `ftqp robots`")
    options: dict[str, Any] | None = Field(
        None, description="of a robot of the catalog, for example { lengths = [1, 1, 1], continuous = true }"
    )
    urdf: str | None = Field(None, description="a URDF file", json_schema_extra=NAMES_A_FILE)
    mjcf: str | None = Field(None, description="an MJCF file", json_schema_extra=NAMES_A_FILE)
    dh: list[list[Finite]] | None = Field(
        None, description="a table of rows theta [rad], d [m], a [m], alpha [rad]", min_length=1
    )
    convention: Literal["standard", "modified"] | None = Field(
        None, description="convention of dh, 'standard' or 'modified'; standard if absent"
    )
    tip: str | None = Field(
        None, description="the frame that carries out the task; needed with urdf and mjcf"
    )
    locked: list[str] | None = Field(
        None, description="joints held at their neutral position, for example fingers"
    )
    acceleration: PerJoint | None = Field(
        None,
        description="acceleration limits in place of the model's, > 0; MJCF and most URDFs have none",
        json_schema_extra=unit("rad/s2 or m/s2"),
    )
    limits: LimitsTable | None = Field(None, description="limits that replace those of the model")
    payload: PayloadTable | None = Field(None, description="a load that the arm carries and knows of")
    tool: ToolTable | None = Field(None, description="a point on the tool to control in place of the tip")
    viscous: PerJoint | None = Field(
        None,
        description="viscous friction in place of the model's, >= 0",
        json_schema_extra=unit("N m s/rad or N s/m"),
    )
    coulomb: PerJoint | None = Field(
        None, description="Coulomb friction in place of the model's, >= 0", json_schema_extra=unit("N m or N")
    )

    @model_validator(mode="after")
    def _one_source(self) -> "RobotTable":
        given = [key for key in ("name", "urdf", "mjcf", "dh") if getattr(self, key) is not None]
        if len(given) != 1:
            got = f"has {' and '.join(given)}" if given else "names no robot"
            raise ValueError(f"{got}, expected exactly one of name, urdf, mjcf, dh")
        return self
