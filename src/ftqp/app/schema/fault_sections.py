"""The tables ``[[faults]]``: what fails, and when the planner is told; one table a kind of fault."""

from dataclasses import Field as Setting
from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_type_hints

from pydantic import Field, create_model, model_validator

from ftqp.app.schema.strict import Finite, Table, unit
from ftqp.faults.kinds import KINDS, Fault


class AnyFaultTable(Table):
    """What every fault of a scenario says: which joint, when it fails, when the planner is told."""

    kind: str
    joint: str | Annotated[int, Field(ge=0)] = Field(description="a joint's name or its index from 0")
    at: Finite = Field(ge=0, description="when it happens, >= 0", json_schema_extra=unit("s"))
    announced: Annotated[Finite, Field(ge=0)] | Literal["never"] | None = Field(
        None, description="when the planner is told (a time >= at, or 'never'); at once if absent"
    )

    @model_validator(mode="after")
    def _announced_after(self) -> "AnyFaultTable":
        if isinstance(self.announced, float | int) and self.announced < self.at:
            raise ValueError(f"is announced at {self.announced:g} s, before it happens at {self.at:g} s")
        return self


def key(setting: "Setting[Any]", hint: Any) -> tuple[Any, Any]:
    """The type and the description of a scenario's key, from a setting of a fault."""
    about = setting.metadata
    literal: Any = Literal
    number: Any = Finite | None if hint == float | None else Finite
    symbol = unit(about["unit"]) if about["unit"] else None
    kind = literal[about["choices"]] if about["choices"] else number
    return kind, Field(
        setting.default, description=about["about"], json_schema_extra=symbol, **about["range"]
    )


def _table(kind: type[Fault]) -> type[AnyFaultTable]:
    """The table of a kind of fault, with a key for each of its settings."""
    literal: Any = Literal
    hints = get_type_hints(kind)
    keys = {field.name: key(field, hints[field.name]) for field in fields(kind) if field.metadata}
    made: type[AnyFaultTable] = create_model(
        f"{kind.__name__}Table",
        __base__=AnyFaultTable,
        __doc__=(kind.__doc__ or "").partition("\n")[0],
        kind=(literal[kind.kind], ...),
        **keys,  # type: ignore[call-overload]
    )
    return made


if TYPE_CHECKING:
    FaultTable = AnyFaultTable
else:
    FaultTable = Annotated[
        Union[tuple(_table(kind) for kind in KINDS.values())],  # noqa: UP007  made from a tuple
        Field(discriminator="kind"),
    ]
