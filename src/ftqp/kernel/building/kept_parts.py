"""What is kept beside an object file: its hash and the parts that it needs, as JSON, which runs nothing.

A part is named with numba's types of its arguments. Each type is written once, after those that it is made
of, and the others name it by its place.
"""

import json
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Final

from numba.core import types

from ftqp.kernel.compiled.library import fingerprint
from ftqp.kernel.compiled.making.helper import Part


def written(code: bytes, parts: Sequence[Part]) -> bytes:
    """The JSON of an object file and of the parts that it needs."""
    told: list[Any] = []
    places: dict[Any, int] = {}
    named = [[part.module, part.name, [_put(one, told, places) for one in part.arguments]] for part in parts]
    said = {"sha256": fingerprint(code), "types": told, "parts": named}
    return json.dumps(said, separators=(",", ":")).encode()


def read(code: bytes, said: bytes) -> list[Part]:
    """The parts that an object file needs."""
    try:
        found = json.loads(said)
        if found["sha256"] != fingerprint(code):
            raise ValueError("the object file is another one")
        kinds: list[Any] = []
        for kind, *rest in found["types"]:
            kinds.append(_TAKEN[kind](kinds, *rest))
        return [Part(module, name, tuple(kinds[k] for k in at)) for module, name, at in found["parts"]]
    except (LookupError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError("it says nothing of an object file") from error


def _put(one: Any, told: list[Any], places: dict[Any, int]) -> int:
    """Write a type behind those that it is made of: its place."""
    if one in places:
        return places[one]
    if isinstance(one, types.Record):
        fields = [[name, _put(field.type, told, places), field.offset] for name, field in one.fields.items()]
        said = ["record", fields, one.size, one.aligned]
    elif isinstance(one, types.NestedArray):
        said = ["nested", _put(one.dtype, told, places), one.shape]
    elif isinstance(one, types.Array):
        said = ["array", _put(one.dtype, told, places), one.ndim, one.layout, one.mutable, one.aligned]
    elif isinstance(one, types.IntegerLiteral):
        said = ["literal", one.literal_value]
    elif one.name in _NUMBERS:
        said = ["number", one.name]
    else:
        raise TypeError(f"{one} is no type of an argument that a part is kept for")
    places[one] = len(told)
    told.append(said)
    return places[one]


@cache
def _record(fields: tuple[tuple[str, Any, int], ...], size: int, aligned: bool) -> Any:
    """A record, made once for all files that name it."""
    return types.Record([(name, {"type": kind, "offset": at}) for name, kind, at in fields], size, aligned)


@cache
def _nested(kind: Any, shape: tuple[int, ...]) -> Any:
    return types.NestedArray(kind, shape)


_NUMBERS: Final = {one.name: one for one in (*types.number_domain, types.boolean)}
_TAKEN: Final[dict[str, Callable[..., Any]]] = {
    "record": lambda kinds, fields, size, aligned: _record(
        tuple((name, kinds[k], at) for name, k, at in fields), size, aligned
    ),
    "nested": lambda kinds, k, shape: _nested(kinds[k], tuple(shape)),
    "array": lambda kinds, k, ndim, layout, mutable, aligned: types.Array(
        kinds[k], ndim, layout, readonly=not mutable, aligned=aligned
    ),
    "literal": lambda kinds, value: types.IntegerLiteral(value),
    "number": lambda kinds, name: _NUMBERS[name],
}
"""What makes a type of what is written of it and of those before it."""
