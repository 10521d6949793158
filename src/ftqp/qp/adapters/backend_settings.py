"""Settings of backends: dataclasses of numbers, switches and choices, filled strictly by name."""

from collections.abc import Mapping
from dataclasses import Field, field, fields
from typing import TYPE_CHECKING, Any, TypeVar

from ftqp.core.checks import non_negative, positive
from ftqp.core.errors import InputError, nearest, unknown

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    Settings = TypeVar("Settings", bound=DataclassInstance)
else:
    Settings = TypeVar("Settings")


TIME_LIMIT = "time_limit"
"""What the setting is called by which a solver that has one ends in time."""


LARGEST_COUNT = 2**31 - 1
"""What a whole number of a solver's settings is at most: solvers hold them in 32 bits."""


def choice(default: str, *others: str) -> Any:
    """A field that holds one of some words, the first by default."""
    return field(default=default, metadata={"choices": (default, *others)})


def optional(like: bool | int | float) -> Any:
    """A field that is None by default, "whatever suits the others", and else of the kind of ``like``."""
    return field(default=None, metadata={"like": like})


def settings(kind: type[Settings], backend: str, given: Mapping[str, Any]) -> Settings:
    """``given`` as a ``kind``, a dataclass whose defaults say what each field holds.

    A default that is a bool takes true or false, an int takes a whole number >= 1 and a float a number > 0,
    or >= 0 where the default is 0; a ``choice`` takes one of its words, an ``optional`` None or its kind.
    """
    known = {field.name: field for field in fields(kind)}
    for name in given:
        if name == TIME_LIMIT and name not in known:
            remedy = "bound its time by max_iterations" if "max_iterations" in known else "leave it out"
            raise InputError(
                f"backend {backend!r} has no {TIME_LIMIT}: its solver does not look at a clock; {remedy}"
            )
        if name not in known:
            raise unknown("setting", name, f"backend {backend!r}", known)
    return kind(**{name: _field(f"{backend}.{name}", value, known[name]) for name, value in given.items()})


def _field(name: str, value: Any, of: Field[Any]) -> bool | int | float | str | None:
    choices = of.metadata.get("choices")
    if choices is not None:
        if not isinstance(value, str) or value not in choices:
            words = ", ".join(choices)
            raise InputError(f"{name} is {value!r}{nearest(str(value), choices)}, expected one of {words}")
        return value
    if "like" in of.metadata:
        return None if value is None else _value(name, value, of.metadata["like"])
    return _value(name, value, of.default)


def _value(name: str, value: Any, default: Any) -> bool | int | float:
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise InputError(f"{name} is {value!r}, expected true or false")
        return value
    if isinstance(value, bool | str):
        raise InputError(f"{name} is {value!r}, expected a number")
    if isinstance(default, int):
        if not isinstance(value, int) or not 1 <= value <= LARGEST_COUNT:
            raise InputError(f"{name} is {value!r:.60}, expected a whole number from 1 to {LARGEST_COUNT}")
        return value
    return positive(name, value) if default > 0.0 else non_negative(name, value)
