"""What every table of a scenario shares: strict types, unknown keys refused, units, short forms."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Final, get_args

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field


def _one_per_joint(value: Any) -> Any:
    """A single number stands for all joints."""
    return [value] if isinstance(value, int | float) and not isinstance(value, bool) else value


def _not_nan(value: float) -> float:
    if value != value:
        raise ValueError("is nan, expected a number (inf for no limit)")
    return value


def _named(value: Any) -> Any:
    """``"mvn"`` is short for ``{ name = "mvn" }``."""
    if isinstance(value, str):
        return {"name": value}
    if not isinstance(value, Mapping):
        raise ValueError(f"is {value!r:.60}, expected a name or a table with a name")
    if not isinstance(value.get("name"), str):
        raise ValueError('needs a name, for example { name = "..." }')
    return dict(value)


Finite = Annotated[float, Field(allow_inf_nan=False)]
"""A finite number."""

Vector = Annotated[list[Finite], Field(min_length=3, max_length=3)]
"""Three numbers along x, y, z."""

Quaternion = Annotated[list[Finite], Field(min_length=4, max_length=4)]
"""x, y, z, w."""

Limit = Annotated[float, AfterValidator(_not_nan)]
"""A limit; infinity means none."""

PerJoint = Annotated[list[Limit], BeforeValidator(_one_per_joint)]
"""One number for all joints, or one each."""

Named = Annotated[dict[str, Any], BeforeValidator(_named)]
"""A name, or a table with a name and settings that their owner checks."""


NAMES_A_FILE: Final[dict[str, Any]] = {"file": True}
"""What marks a field that names a file."""


def unit(symbol: str) -> dict[str, Any]:
    """What marks a field's unit."""
    return {"unit": symbol}


class Table(BaseModel):
    """A table of a scenario: strict types, unknown keys refused, read-only.

    Attributes:
        whole: What a person calls a file of such tables.
    """

    whole: ClassVar[str] = "a scenario"

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


def tables_in(annotation: Any) -> Iterator[type[BaseModel]]:
    """The tables that an annotation names, within lists and choices."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from tables_in(inner)


def kinds_of(table: type[BaseModel]) -> tuple[str, ...]:
    """The values of ``kind`` that choose this table among others; none where there is no choice."""
    return get_args(table.model_fields["kind"].annotation) if "kind" in table.model_fields else ()
