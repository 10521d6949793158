"""Turns what pydantic found wrong with a scenario into one sentence an error, each with its dotted path."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from ftqp.app.schema.scenario_file import Scenario
from ftqp.app.schema.strict import Table, kinds_of, tables_in
from ftqp.core.errors import nearest

LONGEST_KEY = 60
"""Letters of a key that are shown at most."""
MOST = 100
"""Errors that are told one by one; a file with more is not a scenario."""

_COMPARISONS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}

_KINDS = {
    "float": "a number",
    "int": "a whole number",
    "string": "text",
    "bool": "true or false",
    "list": "a list",
    "dict": "a table",
    "model": "a table",
    "path": "a file name",
}


def complaints(model: type[BaseModel], error: ValidationError, above: str = "") -> tuple[str, ...]:
    """Every error of ``error`` as a sentence, in the order of the file, none twice.

    Args:
        model: The class that was validated; its fields give the valid keys, units and descriptions.
        error: What pydantic raised.
        above: The dotted path of the table that was validated; nothing where it is the whole file.
    """
    sentences: dict[str, None] = {}
    for entry in error.errors(include_url=False):
        place = _place(model, entry["loc"], above)
        sentences[f"{place.path or 'the file'} {_sentence(entry, place)}"] = None
    if len(sentences) <= MOST:
        return tuple(sentences)
    return (*list(sentences)[:MOST], f"and {len(sentences) - MOST} more")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """Where an error is: the dotted path, the model that owns its last key, the field there.

    Pydantic puts the tag of a union (``path.circle.radius``) and the branch of a choice (``announced.float``)
    into its locations; the file has neither, so both are dropped, and ``choice`` tells of the latter.
    """

    path: str
    key: str
    owner: type[BaseModel] | None
    field: FieldInfo | None
    choice: bool

    @property
    def unit(self) -> str:
        """The unit in brackets, or nothing."""
        extra = self.field.json_schema_extra if self.field else None
        return f" [{extra['unit']}]" if isinstance(extra, dict) and "unit" in extra else ""

    @property
    def meaning(self) -> str:
        """What the field is, with its unit."""
        return f"{self.field.description}{self.unit}" if self.field else "needed"


def _place(model: type[BaseModel], loc: tuple[int | str, ...], above: str) -> _Place:
    candidates: tuple[type[BaseModel], ...] = (model,)
    owner: type[BaseModel] | None = None
    field: FieldInfo | None = None
    path, key, choice = above, "", False
    for part in loc:
        if isinstance(part, int):
            path += f"[{part}]"
        elif len(candidates) > 1:
            candidates = tuple(c for c in candidates if part in kinds_of(c)) or candidates[:1]
        elif candidates:
            owner, key = candidates[0], part
            path += f".{_name(part)}" if path else _name(part)
            field = owner.model_fields.get(part)
            candidates = tuple(tables_in(field.annotation)) if field else ()
        else:
            choice = True
    return _Place(path=path, key=key, owner=owner, field=field, choice=choice)


def _sentence(entry: Mapping[str, Any], place: _Place) -> str:
    kind, got, context = entry["type"], entry["input"], entry.get("ctx", {})
    annotation = place.field.annotation if place.field else None
    if kind == "missing":
        return f"is missing; it is {place.meaning}"
    if kind == "extra_forbidden":
        return _unknown_key(place)
    if kind.startswith("union_tag"):
        tags = [tag for model in tables_in(annotation) for tag in kinds_of(model)]
        tag = context.get("tag")
        got_kind = "is missing its kind" if tag is None else f"has kind {_shown(tag)}"
        return f"{got_kind}, expected one of {', '.join(tags)}{nearest(str(tag), tags)}"
    if kind == "value_error":
        return str(context["error"])
    if place.choice:
        return f"is {_shown(got)}; it is {place.meaning}"
    if kind == "literal_error":
        valid = [str(value) for value in _literals(annotation)]
        expected = f"one of {', '.join(valid)}" if len(valid) > 1 else valid[0]
        return f"is {_shown(got)}, expected {expected}{nearest(str(got), valid)}"
    if kind in _COMPARISONS:
        key, words = _COMPARISONS[kind]
        return f"is {_shown(got)}, expected a number {words} {context[key]:g}{place.unit}"
    if kind == "finite_number":
        return f"is {_shown(got)}, expected a finite number{place.unit}"
    if kind in ("too_short", "too_long"):
        key, words = ("min_length", "at least") if kind == "too_short" else ("max_length", "at most")
        return f"has {context['actual_length']} entries, expected {words} {context[key]}{place.unit}"
    return f"is {_shown(got)}, expected {_KINDS.get(kind.split('_')[0], entry['msg'])}{place.unit}"


def _literals(annotation: Any) -> Iterator[object]:
    """The words that an annotation lets stand, within choices."""
    for inner in get_args(annotation):
        if get_origin(annotation) is Literal:
            yield inner
        else:
            yield from _literals(inner)


def _unknown_key(place: _Place) -> str:
    table, key = place.path.removesuffix(_name(place.key)).removesuffix("."), place.key
    valid = list(place.owner.model_fields) if place.owner else []
    whole = place.owner.whole if place.owner and issubclass(place.owner, Table) else Table.whole
    whose = f"[{table}]" if table else whole
    below = not table and "scenario" in valid and key in Scenario.model_fields
    hint = f"; a scenario's tables stand below [scenario], here as [scenario.{key}]" if below else ""
    return f"is not a key of {whose}{nearest(key, valid)}; it has {', '.join(valid)}{hint}"


def _name(key: str) -> str:
    """A key as it stands in a file, quoted if it has to be, and not too long."""
    bare = key.isascii() and key.replace("_", "").replace("-", "").isalnum()
    text = key if bare else json.dumps(key, ensure_ascii=False)
    return text if len(text) <= LONGEST_KEY else f"{text[: LONGEST_KEY - 3]}..."


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
