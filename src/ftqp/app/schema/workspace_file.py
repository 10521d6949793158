"""A study of a workspace: what happens from every start when a joint locks and nobody notices."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from ftqp.app.schema.robot_section import RobotTable
from ftqp.app.schema.strict import Finite, Quaternion, Table, unit

PLANAR = ("screen", "horizon", "length", "box", "gain", "v_max")
"""Keys that go with planar arms, that is, without rows ..."""
SPATIAL = ("orientation", "plane", "instants")
"""... and those that need rows."""


class MapTable(Table):
    """The goal, the starts, and what is asked of them."""

    goal: Annotated[list[Finite], Field(min_length=2, max_length=3)] = Field(
        description="where the tip is to go, [x, y] or [x, y, z]", json_schema_extra=unit("m")
    )
    rows: Literal["position", "pose"] | list[str] | None = Field(
        None,
        description="task rows of an arm in space, 'position', 'pose' or their names; planar arms if absent",
    )
    orientation: Quaternion | None = Field(
        None, description="quaternion x, y, z, w of the goal, where rows count rotation"
    )
    plane: Literal["xy", "xz", "yz", "space"] | None = Field(
        None,
        description="with rows: the plane through the goal that is mapped, xz if absent, or all of space",
    )
    instants: int | None = Field(
        None, ge=1, description="with rows: nodes of a line at which failures are simulated, 4 if absent"
    )
    grid: int = Field(52, ge=2, description="nodes of the square grid of starts along each axis, >= 2")
    configurations: int = Field(90, ge=1, description="postures on each component of a self-motion, >= 1")
    steps: int = Field(100, ge=1, description="equal parts of the straight line to the goal, >= 1")
    screen: bool = Field(
        True,
        description="whether failures that no trial found dangerous are taken as harmless, not simulated",
    )
    horizon: Finite | None = Field(
        None,
        gt=0,
        description="the tip must be there within, > 0; without it, at last",
        json_schema_extra=unit("s"),
    )
    length: Literal["cartesian", "joint"] = Field(
        "cartesian", description="whether shares are of the tip's way or of the joints'"
    )
    box: Literal["product", "per_component"] = Field(
        "product", description="whether the ranges of all components of the goal's self-motion count together"
    )
    weights: list[list[Finite]] | None = Field(
        None, description="W, weights of the joint rates in the controller, (nv, nv); the identity if absent"
    )
    gain: Finite = Field(1.0, gt=0, description="of the controller, > 0", json_schema_extra=unit("1/s"))
    v_max: Finite | None = Field(
        None, gt=0, description="largest speed of the tip, > 0", json_schema_extra=unit("m/s")
    )
    seed: int = Field(0, ge=0, description="moves quasi-random postures, >= 0")

    @model_validator(mode="after")
    def _planar_or_spatial(self) -> "MapTable":
        if self.rows is None:
            if unfit := [key for key in SPATIAL if getattr(self, key) is not None]:
                raise ValueError(f"has {', '.join(unfit)} without rows, which an arm in space needs")
        elif unfit := [key for key in PLANAR if getattr(self, key) != MapTable.model_fields[key].default]:
            raise ValueError(f"has {', '.join(unfit)} beside rows; they go with planar arms, without rows")
        return self


class WorkspaceFile(Table):
    """A whole study of a workspace."""

    whole: ClassVar[str] = "a study"

    description: str = Field("", description="what a reader should know")
    robot: RobotTable = Field(description="the arm")
    map: MapTable = Field(description="the goal, the starts, and what is asked of them")
