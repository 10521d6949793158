"""Settings of backends: dataclasses of numbers and switches, filled strictly from names and values."""

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

from ftqp.core.checks import non_negative, positive
from ftqp.core.errors import InputError, unknown

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    Settings = TypeVar("Settings", bound=DataclassInstance)
else:
    Settings = TypeVar("Settings")


def settings(kind: type[Settings], backend: str, given: Mapping[str, Any]) -> Settings:
    """``given`` as a ``kind``, a dataclass whose defaults say what each field holds.

    A default that is a bool takes true or false, an int takes a whole number >= 1 and a float a number > 0,
    or >= 0 where the default is 0.

    Args:
        kind: the settings of one backend.
        backend: its name, for messages.
        given: values by name.

    Raises:
        InputError: an unknown name (with the nearest valid one) or a value outside its range.
    """
    defaults = {field.name: field.default for field in fields(kind)}
    for name in given:
        if name not in defaults:
            raise unknown("setting", name, f"backend {backend!r}", defaults)
    return kind(**{name: _value(f"{backend}.{name}", value, defaults[name]) for name, value in given.items()})


def _value(name: str, value: Any, default: Any) -> bool | int | float:
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise InputError(f"{name} is {value!r}, expected true or false")
        return value
    if isinstance(value, bool | str):
        raise InputError(f"{name} is {value!r}, expected a number")
    if isinstance(default, int):
        if not isinstance(value, int) or value < 1:
            raise InputError(f"{name} is {value!r}, expected a whole number >= 1")
        return value
    return positive(name, value) if default > 0.0 else non_negative(name, value)
