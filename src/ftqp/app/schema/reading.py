"""Reads tables of a file by the settings of classes: strictly, all errors at once, each with its path."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, ClassVar, Final, Generic, Literal, TypeVar, Union, final, get_args, get_origin

from ftqp.core.errors import InputError, ScenarioError, nearest
from ftqp.core.setting import BOUNDS, REQUIRED, Key, Setting, classes_in, keys_of, tables_of, within

T = TypeVar("T")
LONGEST_KEY = 60
"""Letters of a key that are shown at most."""
MOST = 100
"""Errors that are listed one by one; a file with more is not a scenario."""
KINDS: Final[dict[Any, str]] = {
    float: "a number",
    int: "a whole number",
    str: "text",
    bool: "true or false",
    tuple: "a list",
    dict: "a table",
}
"""What is expected, by type."""
WRONG: Final = object()
"""What is read where something is wrong."""


class Table:
    """A table of a file that is a class of its own; what it refuses is a sentence about the table.

    Attributes:
        whole: What a person calls a file of such tables.
        inside: A table of the file whose keys are easily taken for the file's own, and these keys.
    """

    __slots__ = ()
    whole: ClassVar[str] = "a scenario"
    inside: ClassVar[tuple[str, tuple[str, ...]]] = ("", ())


@final
@dataclass(frozen=True, slots=True)
class Options(Generic[T]):
    """What a file says of an object that is made later; defaults are filled in."""

    of: type[T]  # The class of the object
    values: Mapping[str, Any]  # Its settings by name
    kind: str = ""  # The name of the class in the file, where the file chooses among some

    def __getitem__(self, name: str) -> Any:
        """A setting."""
        return self.values[name]

    def made(self, *given: Any, **more: Any) -> T:
        """The object."""
        return self.of(*given, **{name: made(value) for name, value in {**self.values, **more}.items()})


def made(value: Any) -> Any:
    """The object that options stand for; any other value as it is."""
    if isinstance(value, tuple):
        return tuple(made(inner) for inner in value)
    return value.made() if isinstance(value, Options) else value


def options(of: type[T]) -> Options[T]:
    """Those of a class by default."""
    return Options(of, {name: _default(key) for name, key in keys_of(of).items()})


def settings_for(of: type[Any], table: Table) -> dict[str, Any]:
    """The settings of a class that a table has as keys of its own, with objects made of options."""
    return {name: made(getattr(table, name)) for name in keys_of(of)}


def read(of: type[T], content: Any, what: str, above: str = "") -> T:
    """A table of a file."""
    reader = _Reader()
    found = reader.table(of, None, content, above)
    shown = list(reader.errors)
    if len(shown) > MOST:
        shown[MOST:] = [f"and {len(shown) - MOST} more"]
    if shown:
        raise ScenarioError(what, shown)
    result: T = found
    return result


def plain(table: Any, folder: Path | None = None) -> Any:
    """A table as a file has it, every default filled in."""
    if isinstance(table, Options):
        return ({"kind": table.kind} if table.kind else {}) | _plain(table.of, table.values, folder)
    if isinstance(table, Table):
        values = {name: getattr(table, name) for name in keys_of(type(table))}
        found = _plain(type(table), values, folder)
        chosen = values.get("kind")
        return found | (plain(chosen, folder) if isinstance(chosen, Options) else {})
    if isinstance(table, tuple | list):
        return [plain(inner, folder) for inner in table]
    return {name: plain(inner, folder) for name, inner in table.items()} if isinstance(table, dict) else table


def _plain(of: type[Any], values: Mapping[str, Any], folder: Path | None) -> dict[str, Any]:
    found = {}
    for name, key in keys_of(of).items():
        value = values[name]
        if value is None and key.says.off:
            value = "off"
        elif key.says.file and folder is not None and value is not None:
            value = str((folder / value).resolve())
        found[name] = plain(value, folder)
    return found


def _default(key: Key) -> Any:
    return {key.says.short: key.default} if key.says.short and isinstance(key.default, str) else key.default


class _Reader:
    """Reads values, and keeps a sentence for everything that is wrong, in order and none twice."""

    def __init__(self) -> None:
        self.errors: dict[str, None] = {}

    def _refuse(self, path: str, sentence: str) -> Any:
        self.errors[f"{path or 'the file'} {sentence}"] = None
        return WRONG

    def table(
        self, of: Any, kinds: Mapping[str, type[Any]] | None, got: Any, path: str, usual: str | None = None
    ) -> Any:
        """A table: one of a class, of a kind, or of a class with the keys of a kind beside its own."""
        if not isinstance(got, Mapping):
            return self._refuse(path, f"is {shown(got)}, expected a table")
        choice = tables_of(of, kinds)
        kind: Any = ""
        if "" not in choice:
            kind = got.get("kind", usual)
            if not isinstance(kind, str) or kind not in choice:
                said = f"has kind {shown(kind)}" if "kind" in got else "is missing its kind"
                near = nearest(str(kind), choice)
                return self._refuse(path, f"{said}, expected one of {', '.join(choice)}{near}")
        keys, before = choice[kind], len(self.errors)
        values = {
            name: self._entry(key, name, got, path)
            for name, key in keys.items()
            if not (kind and name == "kind")
        }
        for name in got:
            if name not in keys:
                self._unknown(of, name, list(keys), path)
        if len(self.errors) > before:
            return WRONG
        if kind:
            chosen = (kinds or keys["kind"].says.kinds or {})[kind]
            own = Options(chosen, {name: values[name] for name in keys_of(chosen)}, kind)
            if kinds is not None:
                return own
            values = {name: value for name, value in values.items() if name not in own.values} | {"kind": own}
        if not issubclass(of, Table):
            return Options(of, values)
        try:
            return of(**values)
        except InputError as error:
            return self._refuse(path, str(error))

    def _entry(self, key: Key, name: str, got: Mapping[str, Any], path: str) -> Any:
        path = f"{path}.{_name(name)}" if path else _name(name)
        if name in got:
            return self.value(key.hint, got[name], path, key.says)
        if key.default is REQUIRED:
            return self._refuse(path, f"is missing; it is {key.says.about}{_unit(key.says)}")
        return _default(key)

    def _unknown(self, of: Any, name: str, valid: list[str], path: str) -> None:
        whose = f"[{path}]" if path else of.whole
        near = f"{nearest(name, valid)}; it has {', '.join(valid)}"
        inside, keys = ("", ()) if path or of is None else of.inside
        if name in keys:
            near += f"; a scenario's tables stand below [{inside}], here as [{inside}.{name}]"
        self._refuse(f"{path}.{_name(name)}" if path else _name(name), f"is not a key of {whose}{near}")

    def value(self, hint: Any, got: Any, path: str, says: Setting) -> Any:
        """A value of a type."""
        if hint is Any:
            return got
        origin, inner = get_origin(hint), get_args(hint)
        if origin in (Union, UnionType):
            if (got is None and NoneType in inner) or (got == "off" and says.off):
                return None
            return self._one_of([one for one in inner if one is not NoneType], got, path, says)
        owner = None if origin is tuple else next(classes_in(hint), None)
        if says.short and not isinstance(got, Mapping):
            if not isinstance(got, str):
                named = ", ".join(keys_of(owner)[says.short].says.choices) if owner else "a name"
                return self._refuse(path, f"is {got!r:.60}, expected {named} or a table with a {says.short}")
            got = {says.short: got}
        if owner is not None or (says.kinds and origin is not tuple):
            return self.table(owner, says.kinds, got, path, says.usual)
        words: tuple[str, ...] = inner if origin is Literal else says.choices if hint is str else ()
        if words:
            if isinstance(got, str) and got in words:
                return got
            one = f"one of {', '.join(words)}" if len(words) > 1 else words[0]
            return self._refuse(path, f"is {shown(got)}, expected {one}{nearest(str(got), words)}")
        if origin is tuple:
            return self._list(inner, got, path, says)
        if origin in (dict, Mapping):
            return self._dict(inner[1], got, path, says)
        if hint in (float, int):
            return self._number(hint, got, path, says)
        if not isinstance(got, hint):
            return self._refuse(path, f"is {shown(got)}, expected {KINDS[hint]}{_unit(says)}")
        return got

    def _one_of(self, hints: list[Any], got: Any, path: str, says: Setting) -> Any:
        """A value of the first type that takes it."""
        tables = [hint for hint in hints if get_origin(hint) in (dict, Mapping, Options)]
        if tables and len(tables) < len(hints):
            hints = tables if isinstance(got, Mapping) else [hint for hint in hints if hint not in tables]
        if len(hints) == 1:
            return self.value(hints[0], got, path, says)
        for hint in hints:
            trial = _Reader()
            found = trial.value(hint, got, path, says)
            if not trial.errors:
                return found
        return self._refuse(path, f"is {shown(got)}; it is {says.about}{_unit(says)}")

    def _list(self, inner: tuple[Any, ...], got: Any, path: str, says: Setting) -> Any:
        if says.one_for_all and isinstance(got, int | float) and not isinstance(got, bool):
            got = [got]
        if not isinstance(got, list | tuple):
            table = f"; write [[{path}]]" if isinstance(got, Mapping) else ""
            return self._refuse(path, f"is {shown(got)}, expected a list{_unit(says)}{table}")
        least, most = says.count if Ellipsis in inner else (len(inner), len(inner))
        if most is not None and len(got) > most:
            return self._refuse(path, f"has {len(got)} entries, expected at most {most}{_unit(says)}")
        each = replace(says, count=(0, None), one_for_all=False)
        found = tuple(self.value(inner[0], one, f"{path}[{at}]", each) for at, one in enumerate(got))
        if len(got) < least:
            return self._refuse(path, f"has {len(got)} entries, expected at least {least}{_unit(says)}")
        return WRONG if WRONG in found else found

    def _dict(self, inner: Any, got: Any, path: str, says: Setting) -> Any:
        if not isinstance(got, Mapping):
            return self._refuse(path, f"is {shown(got)}, expected a table{_unit(says)}")
        if says.short and not isinstance(got.get(says.short), str):
            return self._refuse(path, f'needs a {says.short}, for example {{ {says.short} = "..." }}')
        found = {name: self.value(inner, one, f"{path}.{_name(name)}", says) for name, one in got.items()}
        return WRONG if WRONG in found.values() else found

    def _number(self, kind: type[Any], got: Any, path: str, says: Setting) -> Any:
        if isinstance(got, bool) or not isinstance(got, int if kind is int else int | float):
            return self._refuse(path, f"is {shown(got)}, expected {KINDS[kind]}{_unit(says)}")
        try:
            number = kind(got)
            finite = kind is int or isfinite(number)
        except OverflowError:
            return self._refuse(path, f"is {shown(got)}, expected {KINDS[kind]}{_unit(says)}")
        if says.infinite and number != number:
            return self._refuse(path, "is nan, expected a number (inf for no limit)")
        if not finite and not says.infinite:
            return self._refuse(path, f"is {shown(got)}, expected a finite number{_unit(says)}")
        for name, words in BOUNDS:
            bound = getattr(says, name)
            if bound is not None and not within(name, number, bound):
                expected = f"a number {words} {bound:g}{_unit(says)}"
                return self._refuse(path, f"is {shown(got)}, expected {expected}")
        return number


def _unit(says: Setting) -> str:
    """The unit in brackets, or nothing."""
    return f" [{says.unit}]" if says.unit else ""


def _name(key: str) -> str:
    """A key as it stands in a file, quoted if it has to be, and not too long."""
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    text = key if bare else json.dumps(key, ensure_ascii=False)
    return text if len(text) <= LONGEST_KEY else f"{text[: LONGEST_KEY - 3]}..."


def shown(value: Any) -> str:
    """What a sentence shows of a value."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
