"""What a comparison runs: scenarios x schemes x backends, every name of it checked before the first run."""

import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from re import sub
from typing import Any

from ftqp.app.scenario import document
from ftqp.app.scenario.setup import Setup, load, validated
from ftqp.app.schema import Scenario
from ftqp.control.task import schemes as recipes
from ftqp.core.errors import InputError, MissingPackage, ScenarioError
from ftqp.qp import backend as qp_backend


@dataclass(frozen=True, slots=True, kw_only=True)
class Combination:
    """One run of a comparison, by names that a reader knows; its own one names the folder."""

    name: str
    scenario: str
    scheme: str
    backend: str
    setup: Setup | None
    reason: str


def combinations(
    sources: Sequence[str], overrides: Iterable[str] = (), *, backends: str | None, schemes: str | None
) -> list[Combination]:
    """Every run, by scenario, then scheme, then backend; what cannot take part says why."""
    errors = _repeated("SCENARIO", sources)
    asked_schemes = _asked("--schemes", schemes, lambda spec: recipes.by_name(_value(spec)), errors)
    missing: dict[str | None, str] = {}

    def usable(spec: str) -> None:
        missing[spec] = _missing(Path(spec) if spec.endswith(".toml") else _value(spec))

    asked_backends = _asked("--backends", backends, usable, errors)
    chosen = list(overrides)
    found: list[Combination] = []
    labels = _labels(sources, lambda source: Path(source).stem)
    backend_labels = _labels([spec for spec in asked_backends if spec is not None], _label)
    for source in dict.fromkeys(sources):
        try:
            at = document.read(source, chosen)
            tables = validated(at)
        except ScenarioError as error:
            errors += [f"{labels[source]}: {sentence}" for sentence in error.errors or (str(error),)]
            continue
        own = _own_missing(tables, at.folder) if None in asked_backends else ""
        own_scheme = str((tables.planner.scheme or {}).get("name"))
        rows: list[Combination] = []
        refusals: list[str] = []
        for scheme in asked_schemes:
            for backend in asked_backends:
                absent = own if backend is None else missing[backend]
                setup, refusal = (None, "") if absent else _setup(source, chosen, backend, scheme)
                rows.append(
                    Combination(
                        name="",
                        scenario=labels[source],
                        scheme=own_scheme if scheme is None else _label(scheme),
                        backend=_own_label(tables) if backend is None else backend_labels[backend],
                        setup=setup,
                        reason=absent or refusal,
                    )
                )
                refusals += [f"{labels[source]}: {refusal}"] if refusal else []
        if refusals and all(row.setup is None for row in rows):
            errors += refusals
        found += rows
    if not errors and all(row.setup is None for row in found):
        errors = [row.reason for row in found]
    if errors:
        raise ScenarioError("the comparison cannot be run:", tuple(dict.fromkeys(errors)))
    return _named(found)


def _asked(
    option: str, text: str | None, check: Callable[[str], object], errors: list[str]
) -> tuple[str | None, ...]:
    """The names of an option that are right; None alone stands for each scenario's own."""
    if text is None:
        return (None,)
    specs = _parts(text)
    if not all(specs):
        example = {"--schemes": "mvn,rmp", "--backends": "active_set,daqp"}[option]
        errors.append(f"{option} is {text!r}, expected names separated by commas, for example {example}")
    named = [spec for spec in specs if spec]
    errors += _repeated(option, named)
    right = []
    for spec in dict.fromkeys(named):
        try:
            check(spec)
            right.append(spec)
        except InputError as error:
            errors.append(f"{option}: {error}")
    return tuple(right) or (None,)


def _parts(text: str) -> list[str]:
    """``text`` at its commas, those inside of braces excepted."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "{[") - (letter in "]}")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def _repeated(option: str, names: Sequence[str]) -> list[str]:
    return [
        f"{option}: {name!r} is there {count} times, expected once"
        for name, count in Counter(names).items()
        if count > 1
    ]


def _value(spec: str) -> Any:
    """A name as it is, ``{ name = "dlsm", alpha = 0.9 }`` as a table."""
    if not spec.startswith("{"):
        return spec
    try:
        return tomllib.loads(f"value = {spec}")["value"]
    except tomllib.TOMLDecodeError as error:
        raise InputError(f'{spec!r} is not a table like {{name = "...", ...}}: {error}') from error


def _missing(spec: Any) -> str:
    """What a backend lacks; nothing when it is there."""
    try:
        qp_backend(spec)
    except MissingPackage as error:
        return str(error)
    return ""


def _own_missing(tables: Scenario, folder: Path) -> str:
    """What the scenario's own backend lacks; a wrong one is left to `load`, which says where it stands."""
    planner = tables.planner
    try:
        return _missing(folder / planner.profile if planner.profile else planner.backend or "active_set")
    except InputError:
        return ""


def _setup(
    source: str, overrides: Sequence[str], backend: str | None, scheme: str | None
) -> tuple[Setup | None, str]:
    """A run, or why there is none."""
    try:
        return load(source, overrides, backend=backend, scheme=scheme), ""
    except ScenarioError as error:
        return None, "; ".join(error.errors or (str(error),))


def _label(spec: str) -> str:
    """A name for a reader: ``dlsm alpha=0.9`` for a table, the file's stem for a profile."""
    value = _value(spec)
    if isinstance(value, dict):
        rest = " ".join(f"{key}={item}" for key, item in value.items() if key != "name")
        return f"{value['name']} {rest}".strip()
    return Path(spec).stem if spec.endswith(".toml") else spec


def _labels(specs: Sequence[str], short: Callable[[str], str]) -> dict[str, str]:
    """The short name of each, or itself where two would be called the same."""
    count = Counter(map(short, dict.fromkeys(specs)))
    return {spec: short(spec) if count[short(spec)] == 1 else spec for spec in specs}


def _own_label(tables: Scenario) -> str:
    planner = tables.planner
    if planner.profile:
        return Path(planner.profile).stem
    return str(planner.backend["name"]) if planner.backend else "active_set"


def _named(rows: Sequence[Combination]) -> list[Combination]:
    """The rows with names that fit a file system, no two the same."""
    used: Counter[str] = Counter()
    named = []
    for row in rows:
        name = file_name(f"{row.scenario}-{row.scheme}-{row.backend}")
        used[name] += 1
        named.append(replace(row, name=name if used[name] == 1 else f"{name}-{used[name]}"))
    return named


def file_name(text: str) -> str:
    """``text`` with a hyphen for whatever a file system may dislike."""
    return sub(r"[^\w.=+-]+", "-", text).strip("-.")
