"""The files that a campaign names: arms, ways, plans, profiles; what they hold is part of the campaign."""

import hashlib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from ftqp.app.schema.scenario_file import Scenario
from ftqp.core.setting import every_key, keys_of

ABSENT = "no such file"
"""What stands for the hash of a file that cannot be read."""


def named_files(scenario: Mapping[str, Any], vary: Mapping[str, Any], folder: Path) -> dict[str, str]:
    """The files that a scenario or what is drawn for it names, each with the hash of its bytes."""
    names = {name for tables in (scenario, vary) for name in _named(tables, "")}
    return {name: _hash(folder / name) for name in sorted(names)}


def _named(value: Any, key: str) -> Iterator[str]:
    """The texts that stand at keys of files; those of a list or of ``one_of`` are at the key itself."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _named(inner, key if name == "one_of" else str(name).rpartition(".")[2])
    elif isinstance(value, list):
        for inner in value:
            yield from _named(inner, key)
    elif isinstance(value, str) and key in _keys():
        yield value


@cache
def _keys() -> frozenset[str]:
    """The keys of a scenario, in whichever table, that name a file."""
    found = every_key(keys_of(Scenario))
    return frozenset(path.rpartition(".")[2] for path, key in found if key.says.file)


def _hash(file: Path) -> str:
    try:
        if not file.is_file():  # a pipe would keep its reader waiting
            return ABSENT
        with file.open("rb") as content:
            return hashlib.file_digest(content, "sha256").hexdigest()
    except (OSError, ValueError):
        return ABSENT
