"""Settings: what an option says of itself, once; checks, files and listings of keys are made of it.

Its words are those of its class's docstring, under ``Args`` or ``Attributes``, or of that of the class that
it names as ``explained_by``; its field has range and unit.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass, field, fields, is_dataclass, replace
from functools import cache
from inspect import Parameter, cleandoc, signature
from types import NoneType
from typing import Any, Final, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from ftqp.core.checks import as_number, non_negative, numbers, positive
from ftqp.core.errors import InputError, nearest

T = TypeVar("T")
BOUNDS: Final = (
    ("above", "greater than"),
    ("least", "at least"),
    ("below", "less than"),
    ("most", "at most"),
)
"""The bounds of a ``Setting``, in words."""
SETTING: Final = "setting"
"""Where a field of a dataclass keeps its ``Setting``."""
REQUIRED: Final = MISSING
"""The default of a setting that a file has to give."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What an option of a class says of itself; a file may give those that say something."""

    # The meaning in a few words; none are those of the docstring of its class
    about: str = field(default="", kw_only=False)
    of: Any = None  # The type of the value in a file, where it is not that of the field or argument
    unit: str = ""  # The unit, or nothing
    choices: tuple[str, ...] = ()  # The words that are allowed, for a setting that is a word
    # The classes among which the key ``kind`` of a table chooses
    kinds: Mapping[str, type[Any]] | None = None
    usual: str | None = None  # The kind of a table that does not say its own; None where each has to
    above: float | None = None  # The number that every number of it must exceed
    least: float | None = None  # The smallest number allowed
    below: float | None = None  # The number that it must not reach
    most: float | None = None  # The largest number allowed
    infinite: bool = False  # Whether infinity is allowed, for a limit that is none
    # How many entries a list has, at least and at most; None is any number
    count: tuple[int, int | None] = (0, None)
    one_for_all: bool = False  # Whether one number stands for a list, one for all joints
    short: str = ""  # The key of a table that a text alone stands for
    off: bool = False  # Whether ``off`` stands for None
    file: bool = False  # Whether it names a file
    needed: bool = False  # Whether a file has to give it though it has a default


Settings = Mapping[str, Setting]
"""What a class without fields declares: what a file may say of its arguments, by name."""


def setting(default: Any, about: str = "", *, kw_only: bool | None = None, **says: Any) -> Any:
    """A field of a dataclass that is a setting."""
    return _field(default, Setting(about, **says), **({} if kw_only is None else {"kw_only": kw_only}))


def _field(default: Any, says: Setting, **more: Any) -> Any:
    if isinstance(default, dict):
        return field(default_factory=default.copy, metadata={SETTING: says}, **more)
    return field(default=default, metadata={SETTING: says}, **more)


@dataclass(frozen=True, slots=True, kw_only=True)
class Key:
    """A setting where it is declared."""

    hint: Any  # The type of its value in a file
    default: Any  # Its default, ``REQUIRED`` where there is none
    says: Setting  # What it says of itself

    @property
    def tables(self) -> dict[str, Mapping[str, "Key"]]:
        """The keys of the tables that stand at it, by their kind; one without kinds goes by no name."""
        return tables_of(next(classes_in(self.hint), None), self.says.kinds, self.says.usual)


def tables_of(
    owner: type[Any] | None, kinds: Mapping[str, type[Any]] | None = None, usual: str | None = None
) -> dict[str, Mapping[str, Key]]:
    """The keys of a class whose objects are tables of a file, by their kind."""
    shared = {} if owner is None else keys_of(owner)
    if kinds is None and "kind" in shared:
        kinds = shared["kind"].says.kinds
    elif kinds is not None:
        default = REQUIRED if usual is None else usual
        shared = {"kind": Key(hint=str, default=default, says=Setting("kind"))}
    if kinds is None:
        return {"": shared} if shared else {}
    return {kind: {**shared, **keys_of(made)} for kind, made in kinds.items()}


def every_key(keys: Mapping[str, Key], above: str = "") -> Iterator[tuple[str, Key]]:
    """The keys of a table and of those within it, by their dotted path, ``path(circle).radius``."""
    for name, key in keys.items():
        if name == "kind" and not key.says.choices:  # which stands in the path of the others
            continue
        for kind, inner in key.tables.items():
            yield from every_key(inner, f"{above}{name}({kind})." if kind else f"{above}{name}.")
        if not key.tables:
            yield f"{above}{name}", key


def keys_of(owner: type[Any]) -> Mapping[str, Key]:
    """The settings of a class by name.

    Those of a dataclass are its fields made by ``setting``; those of another class are in its ``settings``,
    and their defaults are those of its arguments.
    """
    listed: Any = owner
    return _keys_of(listed)


@cache
def _keys_of(owner: Any) -> Mapping[str, Key]:
    if is_dataclass(owner):
        declared = {one.name: one.metadata[SETTING] for one in fields(owner) if SETTING in one.metadata}
        defaults = {
            one.name: one.default if one.default_factory is MISSING else one.default_factory()
            for one in fields(owner)
        }
        typed: Any = owner
    else:
        declared, typed = getattr(owner, "settings", {}), owner.__init__
        defaults = (
            {name: _given(one) for name, one in signature(typed).parameters.items()} if declared else {}
        )
    hints = get_type_hints(typed) if any(says.of is None for says in declared.values()) else {}
    return {
        name: Key(
            hint=hints[name] if says.of is None else says.of,
            default=REQUIRED if says.needed else defaults[name],
            says=says if says.about else replace(says, about=words_of(owner, name)),
        )
        for name, says in declared.items()
    }


def words_of(owner: type[Any], name: str) -> str:
    """What docstrings say of an argument: their first clause, and what it is if it is not given."""
    docs = (cleandoc(kind.__doc__ or "") for kind in (*owner.__mro__, getattr(owner, "explained_by", object)))
    found = (re.search(rf"^    {name}: (.*(?:\n        .*)*)", doc, re.MULTILINE) for doc in docs)
    entry = next((match[1] for match in found if match), "")
    text = re.sub(r" \[[^]]*\]", "", " ".join(entry.split()).replace("``", "'"))  # units stand beside it
    absent = re.search(r"(?:^|[.;] )None(?: is|:) (.+?)(?:[.;:] |[.;]?$)", text)
    first = re.split(r"[.;:](?: |$)", text)[0]
    return first[:1].lower() + first[1:] + (f"; if absent {absent[1]}" if absent else "")


def like(owner: type[Any], name: str) -> Any:
    """A field that is the setting of another class."""
    key = keys_of(owner)[name]
    return _field(key.default, key.says)


def _given(argument: Parameter) -> Any:
    return REQUIRED if argument.default is Parameter.empty else argument.default


def classes_in(hint: Any) -> Iterator[type[Any]]:
    """The classes with settings that a type names, within lists and choices."""
    if isinstance(hint, type) and get_origin(hint) is None and keys_of(hint):
        yield hint
    for inner in get_args(hint):
        yield from classes_in(inner)


def made_from(make: Callable[..., T], given: Mapping[str, Any], whose: str) -> T:
    """``make(**given)``; a parameter that it has not is refused with those that it has."""
    known = list(signature(make).parameters)
    for key in given:
        if key not in known:
            raise InputError(
                f"{key!r} is not a parameter of {whose}{nearest(str(key), known)}; it has "
                f"{', '.join(known) or 'none'}"
            )
    return make(**given)


def refuse_out_of_range(made: Any, whose: str = "", *, every: bool = False) -> None:
    """Refuse numbers of a dataclass, or lists of them, out of its settings' ranges, and unknown words."""
    for name, key in keys_of(type(made)).items():
        value, says = getattr(made, name), key.says
        if value is None and (key.default is None or type(None) in get_args(key.hint)):
            continue
        if key.hint is bool and not isinstance(value, bool | np.bool_):
            raise InputError(f"{name}{whose} is {value!r:.60}, expected True or False")
        if says.choices and value not in says.choices:
            raise InputError(
                f"{name}{whose} is {value!r:.80}{nearest(str(value), says.choices)}, expected one of "
                f"{', '.join(says.choices)}"
            )
        bounds = BOUNDS if every else BOUNDS[:2]
        if all(getattr(says, bound) is None for bound, _ in bounds):
            continue
        whole = int in (key.hint, *get_args(key.hint))
        if whole and (isinstance(value, bool) or not isinstance(value, int) or value < (says.least or 0)):
            raise InputError(f"{name} is {value!r:.40}, expected a whole number >= {says.least or 0:g}")
        if isinstance(value, str) and str in get_args(key.hint):
            continue
        value = list(value.values()) if isinstance(value, Mapping) else value
        plain = says.of is None and {*(get_args(key.hint) or (key.hint,))} <= {int, float, NoneType}
        several = np.ndim(value) and not plain
        for one in numbers(f"{name}{whose}", value).flat if several else (value,):
            if says.infinite and one == float("inf"):
                continue
            if says.above is not None and says.above >= 0.0:
                positive(f"{name}{whose}", one, says.unit)
            elif says.least is not None and says.least >= 0.0:
                non_negative(f"{name}{whose}", one, says.unit)
            if every:
                _refuse_beyond(f"{name}{whose}", one, says)


def _refuse_beyond(name: str, value: Any, says: Setting) -> None:
    """Refuse a number beyond any of its bounds."""
    number = as_number(name, value, says.unit)
    for bound, words in BOUNDS:
        at = getattr(says, bound)
        if at is not None and not within(bound, number, at):
            expected = f"a number {words} {at:g} {says.unit}".rstrip()
            raise InputError(f"{name} is {number:g}, expected {expected}")


def within(bound: str, number: float, at: float) -> bool:
    """Whether a number keeps a bound."""
    if bound in ("above", "below"):
        return number > at if bound == "above" else number < at
    return number >= at if bound == "least" else number <= at
