"""Grammar of nested tables: what a schema allows, almost allows, or never thought of.

Every function draws from a `random.Random`: the script seeds one a file, the tests hand in that of
Hypothesis, which shrinks what it finds.
"""

import types
from collections.abc import Iterator, Mapping
from datetime import date, datetime, time
from random import Random
from typing import Any, Final, Literal, Union, get_args, get_origin

from ftqp.core.setting import REQUIRED, Key, Setting, classes_in, keys_of, tables_of

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
    "__slots__", "0", "\u00b2", "\uff10", "x" * 300, "dt", "robot",
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


def fitting(hint: Any, rng: Random, says: Setting | None = None) -> Any:
    """A value of a type, within the range of its setting, at its ends, or just beyond."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return fitting(rng.choice(inner), rng, says)
    words = inner if origin is Literal else says.choices if says and hint is str else ()
    if words:
        word = rng.choice(words)
        return word if rng.random() < 0.9 else f"{word}s"
    if origin is tuple:
        return [fitting(inner[0], rng, says) for _ in range(_length(inner, says, rng))]
    if origin in (dict, Mapping):
        return {rng.choice((*KEYS, "name", "j1", "1")): anything(rng, 2) for _ in range(rng.randrange(3))}
    if choice := tables_of(next(classes_in(hint), None), says.kinds if says else None):
        kind = rng.choice(list(choice))
        return _drawn(choice[kind], rng) | ({"kind": kind} if kind else {})
    if hint is bool:
        return rng.random() < 0.5
    if hint in (float, int):
        return _number(hint, says, rng)
    if hint is str:
        return rng.choice(WORDS)
    return None if hint is types.NoneType else anything(rng, 2)


def table(model: type[Any], rng: Random) -> dict[str, Any]:
    """A table of a class: its required keys, and some of the others."""
    return _drawn(keys_of(model), rng)


def _drawn(keys: Mapping[str, Key], rng: Random) -> dict[str, Any]:
    share, found = rng.choice((0.1, 0.3, 0.9)), {}
    for name, key in keys.items():
        if (name != "kind" or key.says.choices) and rng.random() < (
            0.95 if key.default is REQUIRED else share
        ):
            found[name] = fitting(key.hint, rng, key.says)
    return {name: value for name, value in found.items() if value is not None}


def _length(inner: tuple[Any, ...], says: Setting | None, rng: Random) -> int:
    """How many entries: what is asked for, or one more or less."""
    low, high = (says.count if says else (0, None)) if Ellipsis in inner else (len(inner), len(inner))
    high = max(low, MOST) + 1 if high is None else high
    return max(0, rng.randint(low, high) + rng.choice((0, 0, 0, 0, 1, -1)))


def _number(kind: type, says: Setting | None, rng: Random) -> Any:
    """A number: an ordinary one, one at an end of the range, or one that hurts."""
    ends = [end for end in (says.above, says.least, says.below, says.most) if end is not None] if says else []
    drawn = rng.random()
    if ends and drawn < 0.2:
        return kind(rng.choice(ends))
    if drawn < 0.4:
        return rng.choice(NUMBERS)
    if kind is int:
        return rng.choice((0, 1, 2, 3, 10, 100))
    return rng.choice((0.001, 0.01, 0.1, 0.5, 1.0, 2.0, 10.0, 100.0, -0.1)) * (1.0 + rng.random())


def spoiled(content: Any, rng: Random, model: type[Any] | None = None) -> Any:
    """The tables with one to three changes, each at a place drawn at random."""
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


def _grafted(content: dict[str, Any], model: type[Any], rng: Random) -> None:
    """A key of the schema with a value that almost fits, at its own place."""
    keys, owner = keys_of(model), content
    while True:
        name, key = rng.choice(list(keys.items()))
        below = owner.get(name)
        if isinstance(below, list) and below and isinstance(below[-1], dict):
            below = below[-1]
        if key.tables and isinstance(below, dict) and rng.random() < 0.8:
            keys = key.tables.get(str(below.get("kind"))) or rng.choice(list(key.tables.values()))
            owner = below
            continue
        value = fitting(key.hint, rng, key.says)
        if value is not None:
            owner[name] = value
        return


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
