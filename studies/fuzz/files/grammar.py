"""Grammar of nested tables: what a schema allows, almost allows, or never thought of.

Every function draws from a `random.Random`: the script seeds one a file, the tests hand in that of
Hypothesis, which shrinks what it finds.
"""

import types
from collections.abc import Iterator
from datetime import date, datetime, time
from random import Random
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel
from pydantic.fields import FieldInfo

NUMBERS: Final = (
    0, 1, -1, 2, 3, 7, 1000, 2**31, 2**63, -(2**63) - 1, 10**400, 0.0, -0.0, 0.5, 1.0, -1.0, 1e-3, 1e-9,
    1e-15, 1e-300, 5e-324, 1e9, 1e16, 1e200, 1e308, -1e308, float("inf"), float("-inf"), float("nan"),
)  # fmt: skip
WORDS: Final = (
    "", " ", "nan", "inf", "1", "1_000", "\uff11\uff12", "\u00b2", "x" * 5000, "a\nb", "a\tb", "\x1b[31mred",
    "\u202egnirts", "\0", "a.b", "../..", "/dev/zero", "/dev/stdin", "pipe", "folder", "missing", "empty",
    "never", "any", "none", "panda", "planar6", "active_set", "mvn", "line", "locked", "[red]x[/red]", "{}",
    "%s", "O'Brien\"; DROP", "true", "qpsolvers:none", "\U0001f600", "e\u0301", "\ufeff",
)  # fmt: skip
KEYS: Final = (
    "kind", "name", "at", "joint", "q", "", " ", "a.b", "a\nb", "\x1b[31m", "\u202e", "__class__",
    "model_config", "0", "\u00b2", "\uff10", "x" * 300, "dt", "robot",
)  # fmt: skip
MOST: Final = 6


def anything(rng: Random, depth: int = 0) -> Any:
    """Any value that TOML can hold, mostly one that hurts."""
    kind = rng.randrange(12 if depth < 3 else 8)
    if kind < 3:
        return rng.choice(NUMBERS)
    if kind < 6:
        return rng.choice(WORDS)
    if kind == 6:
        return rng.random() < 0.5
    if kind == 7:
        return rng.choice((date(2026, 1, 1), time(1, 2), datetime(2026, 1, 1, 1, 2)))
    if kind < 10:
        return [anything(rng, depth + 1) for _ in range(rng.randrange(4))]
    return {rng.choice(KEYS): anything(rng, depth + 1) for _ in range(rng.randrange(4))}


def deep(rng: Random) -> Any:
    """A value that is nested deeper than any file needs."""
    value: Any = 1
    for _ in range(rng.choice((5, 9, 12, 60))):
        value = [value] if rng.random() < 0.5 else {rng.choice(KEYS[:4]): value}
    return value


def fitting(annotation: Any, rng: Random, bounds: tuple[Any, ...] = ()) -> Any:
    """A value of a type, within the bounds of its field, at them, or just beyond.

    Args:
        annotation: The type, as a pydantic field has it.
        rng: Draws.
        bounds: Further constraints of the field.
    """
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *more = get_args(annotation)
        found = [c for m in more for c in (m.metadata if isinstance(m, FieldInfo) else [m])]
        return fitting(inner, rng, (*bounds, *found))
    if origin in (Union, types.UnionType):
        return fitting(rng.choice(get_args(annotation)), rng, bounds)
    if origin is Literal:
        word = rng.choice(get_args(annotation))
        return word if rng.random() < 0.9 else f"{word}s"
    if origin in (list, tuple):
        return [fitting(get_args(annotation)[0], rng) for _ in range(_length(bounds, rng))]
    if origin is dict:
        return {rng.choice((*KEYS, "name", "j1", "1")): anything(rng, 2) for _ in range(rng.randrange(3))}
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return table(annotation, rng)
    if annotation is bool:
        return rng.random() < 0.5
    if annotation in (float, int):
        return _number(annotation, bounds, rng)
    if annotation is str:
        return rng.choice(WORDS)
    return None if annotation is type(None) else anything(rng, 2)


def table(model: type[BaseModel], rng: Random) -> dict[str, Any]:
    """A table of a model: its required keys, and some of the others.

    Args:
        model: A class of the schema.
        rng: Draws.
    """
    share, found = rng.choice((0.1, 0.3, 0.9)), {}
    for name, field in model.model_fields.items():
        if rng.random() < (0.95 if field.is_required() else share):
            found[name] = fitting(field.annotation, rng, tuple(field.metadata))
    return {name: value for name, value in found.items() if value is not None}


def _length(bounds: tuple[Any, ...], rng: Random) -> int:
    """How many entries: what is asked for, or one more or less."""
    low = next((b.min_length for b in bounds if isinstance(b, MinLen)), 0)
    high = next((b.max_length for b in bounds if isinstance(b, MaxLen)), max(low, MOST) + 1)
    return max(0, rng.randint(low, high) + rng.choice((0, 0, 0, 0, 1, -1)))


def _number(kind: type, bounds: tuple[Any, ...], rng: Random) -> Any:
    """A number: an ordinary one, one at a bound, or one that hurts."""
    ends = [getattr(b, key) for b, key in _ends(bounds)]
    drawn = rng.random()
    if ends and drawn < 0.2:
        return rng.choice(ends)
    if drawn < 0.4:
        return rng.choice(NUMBERS)
    if kind is int:
        return rng.choice((0, 1, 2, 3, 10, 100))
    return rng.choice((0.001, 0.01, 0.1, 0.5, 1.0, 2.0, 10.0, 100.0, -0.1)) * (1.0 + rng.random())


def _ends(bounds: tuple[Any, ...]) -> Iterator[tuple[Any, str]]:
    for bound in bounds:
        for kind, key in ((Ge, "ge"), (Gt, "gt"), (Le, "le"), (Lt, "lt")):
            if isinstance(bound, kind):
                yield bound, key


def spoiled(content: Any, rng: Random, model: type[BaseModel] | None = None) -> Any:
    """The tables with one to three changes, each at a place drawn at random.

    Args:
        content: Tables, which are changed in place.
        rng: Draws.
        model: The schema, whose own tables and values are put in, too.
    """
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = list(_places(content))
        if not places:
            return content
        owner, key = rng.choice(places)
        change = rng.choice(_CHANGES)
        if model is not None and rng.random() < 0.5:
            _grafted(content, model, rng)
        else:
            change(owner, key, rng)
    return content


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every value in nested tables as its owner and its key."""
    if isinstance(value, dict):
        for key in value:
            yield value, key
            yield from _places(value[key])
    elif isinstance(value, list):
        for k in range(len(value)):
            yield value, k
            yield from _places(value[k])


def _grafted(content: dict[str, Any], model: type[BaseModel], rng: Random) -> None:
    """A key of the schema with a value that almost fits, at its own place."""
    at, owner = model, content
    while True:
        name, field = rng.choice(list(at.model_fields.items()))
        inner, below = list(_tables(field.annotation)), owner.get(name)
        if isinstance(below, list) and below and isinstance(below[-1], dict):
            below = below[-1]
        if inner and isinstance(below, dict) and rng.random() < 0.8:
            at = rng.choice([t for t in inner if below.get("kind") in _kinds(t)] or inner)
            owner = below
            continue
        value = fitting(field.annotation, rng, tuple(field.metadata))
        if value is not None:
            owner[name] = value
        return


def _tables(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _tables(inner)


def _kinds(model: type[BaseModel]) -> tuple[Any, ...]:
    return get_args(model.model_fields["kind"].annotation) if "kind" in model.model_fields else ()


def _replaced(owner: Any, key: Any, rng: Random) -> None:
    owner[key] = anything(rng)


def _other_number(owner: Any, key: Any, rng: Random) -> None:
    value = owner[key]
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= 1e300:
        near = (value * 0.9, value * 1.1, value * 2, value * 0.5, value + 1, value * 10, value * 0.1)
        far = (-value, value * 1e-9, value * 1e6, rng.choice(NUMBERS), int(value), str(value))
        owner[key] = rng.choice(near if rng.random() < 0.6 else far)
    else:
        owner[key] = rng.choice(NUMBERS)


def _word(owner: Any, key: Any, rng: Random) -> None:
    value = owner[key]
    owner[key] = (
        f"{value}{rng.choice('sx_ ')}" if isinstance(value, str) and rng.random() < 0.5 else rng.choice(WORDS)
    )


def _dropped(owner: Any, key: Any, rng: Random) -> None:
    del owner[key]


def _renamed(owner: Any, key: Any, rng: Random) -> None:
    if isinstance(owner, dict):
        owner[rng.choice((*KEYS, f"{key}s", str(key).upper(), f"{key}.x"))] = owner.pop(key)
    else:
        owner.insert(rng.randrange(len(owner) + 1), owner[key])


def _nested(owner: Any, key: Any, rng: Random) -> None:
    value = owner[key]
    owner[key] = rng.choice(([value], [value, value], {rng.choice(KEYS): value}, [[value]]))


def _unnested(owner: Any, key: Any, rng: Random) -> None:
    value = owner[key]
    if isinstance(value, dict) and value:
        owner[key] = rng.choice(list(value.values()))
    elif isinstance(value, list) and value:
        owner[key] = value[0]
    else:
        owner[key] = deep(rng)


def _longer(owner: Any, key: Any, rng: Random) -> None:
    value = owner[key]
    owner[key] = (
        value * rng.choice((2, 3, 200)) if isinstance(value, list | str) else [value] * rng.randrange(40)
    )


def _deeper(owner: Any, key: Any, rng: Random) -> None:
    owner[key] = deep(rng)


def _shorter(owner: Any, key: Any, rng: Random) -> None:
    value = owner[key]
    owner[key] = value[: rng.randrange(len(value) + 1)] if isinstance(value, list | str) else {}


_CHANGES: Final = (
    *6 * (_other_number,), _replaced, _word, _dropped, _renamed, _nested, _unnested, _longer, _shorter,
    _deeper,
)  # fmt: skip
