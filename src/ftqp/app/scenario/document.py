"""The text of a scenario or study: found by path or name, overridden, written as TOML."""

import csv
import json
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import date, time
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import Any

from ftqp.core.errors import ScenarioError
from ftqp.model import catalog

SHELVES = {"scenario": "scenarios", "study": "studies", "campaign": "campaigns"}
"""The folders of the bundled files, by what they are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Document:
    """A parsed scenario or study before validation."""

    name: str
    origin: str
    folder: Path
    content: dict[str, Any]


def bundled(kind: str = "scenario") -> dict[str, str]:
    """The bundled scenarios or studies: name to the first line of its comment."""
    found = {}
    for entry in sorted(files("ftqp.app").joinpath(SHELVES[kind]).iterdir(), key=lambda e: e.name):
        if entry.name.endswith(".toml"):
            first = entry.read_text(encoding="utf-8").partition("\n")[0]
            found[entry.name.removesuffix(".toml")] = first.lstrip("# ").rstrip()
    return found


def read(source: str, overrides: Iterable[str] = (), kind: str = "scenario") -> Document:
    """The scenario or study ``source``, a path or a bundled name, with ``a.b=value`` overrides put in."""
    path = Path(source)
    if source in bundled(kind) and not path.is_file():
        name, origin, folder = source, f"bundled {kind} {source!r}", Path.cwd()
        text = files("ftqp.app").joinpath(SHELVES[kind], f"{source}.toml").read_text("utf-8")
    else:
        name, origin, folder, text = path.stem, str(path), path.parent, _text(path, kind)
    found = Document(name=name, origin=origin, folder=folder, content=_parsed(text, origin))
    return overridden(found, overrides, kind)


def overridden(found: Document, overrides: Iterable[str], kind: str = "scenario") -> Document:
    """A scenario or study with ``a.b=value`` overrides put in."""
    errors = [error for override in overrides if (error := _override(found.content, override, kind))]
    if errors:
        raise ScenarioError(f"{found.origin} cannot be used:", errors)
    return found


def _text(path: Path, kind: str) -> str:
    try:
        if path.is_dir():
            raise ScenarioError(f"{path} is a folder, expected a {kind} file; name the .toml file inside it")
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise ScenarioError(_not_found(path, kind)) from error
    except UnicodeDecodeError as error:
        raise ScenarioError(
            f"{path} is not a text file (byte {error.start} is not UTF-8), expected a {kind} in TOML"
        ) from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ScenarioError(f"{str(path)[:200]!r} cannot be read: {reason}") from error


def _not_found(path: Path, kind: str) -> str:
    names = list(bundled(kind))
    named = path.parent == Path()  # else it is meant as a file
    beside = [str(p) for p in path.parent.glob("*.toml")] if path.parent.is_dir() else []
    near = get_close_matches(str(path.with_suffix("")), names, n=1, cutoff=0.4) if named else []
    near = near or get_close_matches(str(path), beside, n=1, cutoff=0.6)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    if named and kind == "scenario" and str(path) in catalog.names():
        with_it = [name for name in names if name.startswith(str(path))]
        return f"{path} is a robot, and expected is a scenario, like {', '.join(with_it) or names[0]}"
    listed = f"; bundled are {', '.join(names)}" if named else ""
    return f"{path} is neither a file nor a bundled {kind}{hint}{listed}"


def _parsed(text: str, origin: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        if text.lstrip().startswith("<"):
            raise ScenarioError(
                f"{origin} is XML, expected TOML; a scenario names the file of its robot: "
                '[robot] urdf = "arm.urdf", or mjcf'
            ) from error
        raise ScenarioError(f"{origin} is not valid TOML: {error}") from error


def entry(part: str, entries: Any) -> int | None:
    """The index that a part of a dotted key names in a list; None where it names none."""
    if not isinstance(entries, list) or not (part.isascii() and part.isdigit() and len(part) < 10):
        return None
    return int(part) if int(part) < len(entries) else None


def _override(content: dict[str, Any], text: str, kind: str) -> str | None:
    """Puts ``a.b=value`` into ``content``, or takes out ``a.b=``; returns what is wrong with it."""
    key, equals, raw = text.partition("=")
    parts = _parts(key)
    if not equals or not parts or not all(parts):
        return f"--set {text!r:.100} is not of the form a.b=value, for example --set planner.dt=0.002"
    table: Any = content
    for part in parts[:-1]:
        table = _child(table, part)
        if table is None:
            return f"--set {text!r:.100}: {part!r:.60} is not a table of this {kind}"
    last, value = parts[-1], _value(raw)
    if isinstance(table, list):
        index = entry(last, table)
        if index is None:
            return f"--set {text!r:.100}: {last!r:.60} is not an index below {len(table)}"
        table[index] = value
    elif not isinstance(table, dict):
        return f"--set {text!r:.100}: {parts[-2]!r:.60} is a value, not a table"
    elif value == "":
        table.pop(last, None)
    else:
        table[last] = value
    return None


def _parts(key: str) -> list[str]:
    """The parts of a dotted key; one in double quotes may have dots, as ``vary."robot.name"`` has."""
    try:
        return [part.strip() for part in next(csv.reader([key], delimiter="."), [])]
    except csv.Error:
        return []


def _child(table: Any, part: str) -> Any:
    if isinstance(table, dict):
        return table.setdefault(part, {})
    index = entry(part, table)
    return None if index is None else table[index]


def _value(raw: str) -> Any:
    """``raw`` as a TOML value; what is not one is text: ``--set planner.scheme=mvn`` needs no quotes."""
    try:
        return tomllib.loads(f"value = {raw.strip()}\n")["value"] if "\n" not in raw else raw
    except ValueError:
        return raw.strip()


def toml(content: Mapping[str, Any]) -> str:
    """``content`` as TOML: plain values first, which a table's header would take, then tables."""
    lines: list[str] = []
    for key, value in sorted(content.items(), key=lambda item: _is_table(item[1])):
        if _is_table(value):
            one = isinstance(value, Mapping)
            head = f"[{_key(key)}]" if one else f"[[{_key(key)}]]"
            for table in [value] if one else value:
                lines += ["", head, *_entries(table)]
        else:
            lines += _entries({key: value})
    return "\n".join(lines).lstrip("\n") + "\n"


def _entries(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(key)} = {_inline(value)}" for key, value in table.items() if value is not None]


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping) or (
        isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)
    )


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else _quoted(key)


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _inline(value: Any) -> str:
    if isinstance(value, Mapping):
        inner = ", ".join(_entries(value))
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(_inline(item) for item in value)}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, date | time):
        return value.isoformat()
    if isinstance(value, int | float):
        return repr(value)
    return _quoted(str(value))
