"""``ftqp campaign STUDY --shrink N``: an episode that breaks a law as a small scenario and a ready test."""

import copy
import math
import re
import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, final

from ftqp.app.campaign.draws import look_up, put
from ftqp.app.campaign.episode_study import Campaign, EpisodeWork
from ftqp.app.campaign.judged_scenario import broken_by
from ftqp.app.output.console import ExitCode, answer, progress
from ftqp.app.run.runs import SCENARIO, free_folder, make_folder, write
from ftqp.app.scenario import document
from ftqp.core.errors import InputError, ScenarioError

DIGITS: Final = (1, 2, 3)
"""Numbers are tried with so many digits, the fewest first."""
SPARED: Final = 0.2
"""A run ends so much after the law was broken [s], where it is still broken then."""
ROUNDS: Final = 6
"""So often at most everything is tried again."""

Tables = dict[str, Any]
Broken = tuple[str, float | None] | None
"""The law that a scenario breaks, or the kind of its exception, and when [s]; None: none."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Shrunk:
    """A scenario that is as simple as was found."""

    content: Tables
    tried: int
    keys: int
    keys_before: int


def shrunk(
    content: Mapping[str, Any],
    vary: Mapping[str, Any],
    broken: Callable[[Tables], Broken],
    *,
    most: int = 400,
    heard: Callable[[int], None] = lambda tried: None,
) -> Shrunk:
    """A simpler scenario that still breaks the same law.

    In turn, as long as anything helps: faults, tables and keys are left out, so that their defaults hold;
    keys that were drawn from a few values take the first one; the run ends soon after the law was broken;
    numbers lose their digits. What is no scenario any more, or breaks no law or another one, is dropped.
    """
    best = copy.deepcopy(dict(content))
    found = broken(best)
    if found is None:
        raise ValueError("the scenario breaks no law")
    law, when = found
    tried, before = 1, len(_leaves(best))
    for _ in range(ROUNDS):
        size = (len(_leaves(best)), repr(best))
        for change in _changes(best, vary, when):
            if tried >= most:
                break
            simpler = copy.deepcopy(best)
            if not change(simpler) or simpler == best:
                continue
            tried += 1
            heard(tried)
            result = broken(simpler)
            if result is not None and result[0] == law:
                best, when = simpler, result[1]
        if tried >= most or (len(_leaves(best)), repr(best)) == size:
            break
    return Shrunk(content=best, tried=tried, keys=len(_leaves(best)), keys_before=before)


def _changes(
    content: Tables, vary: Mapping[str, Any], when: float | None
) -> Iterator[Callable[[Tables], bool]]:
    """What may make a scenario simpler; each says whether it changed anything that is still there."""
    for key in ("faults", "sensors.faults"):
        entries = look_up(content, key)
        for at in reversed(range(len(entries) if isinstance(entries, list) else 0)):
            yield lambda tables, key=key, at=at: _cut(tables, f"{key}.{at}")  # type: ignore[misc]
    for key in _tables(content):
        if key == "simulation":  # its keys go one by one, and the run does not become longer again
            continue
        yield lambda tables, key=key: _cut(tables, key)  # type: ignore[misc]
    if when is not None:
        for end in (when + SPARED, 1.5 * when + SPARED):
            yield lambda tables, end=end: _ended(tables, end)  # type: ignore[misc]
    for key, what in vary.items():
        values = what if isinstance(what, list) else what.get("one_of", ())
        for value in values[:1]:
            yield lambda tables, key=key, value=value: _instead(tables, key, value)  # type: ignore[misc]
    for key in _leaves(content):
        if key != "simulation.duration":
            yield lambda tables, key=key: _cut(tables, key)  # type: ignore[misc]
        for digits in DIGITS:
            yield lambda tables, key=key, digits=digits: _rounded(tables, key, digits)  # type: ignore[misc]


def _tables(content: Mapping[str, Any], above: str = "") -> list[str]:
    """The keys of all tables, outer ones first."""
    found = []
    for name, value in content.items():
        if isinstance(value, Mapping):
            found += [f"{above}{name}", *_tables(value, f"{above}{name}.")]
    return found


def _leaves(content: Any, above: str = "") -> list[str]:
    """The keys of all values that are no tables; a list of plain values is one value."""
    if isinstance(content, Mapping):
        pairs = [(str(name), value) for name, value in content.items()]
    else:
        pairs = [(str(at), value) for at, value in enumerate(content)]
    found = []
    for name, value in pairs:
        nested = isinstance(value, Mapping) or (
            isinstance(value, list) and any(isinstance(one, Mapping) for one in value)
        )
        found += _leaves(value, f"{above}{name}.") if nested else [f"{above}{name}"]
    return found


def _cut(tables: Tables, key: str) -> bool:
    """Leave a key or an entry of a list out."""
    *way, last = key.split(".")
    at: Any = look_up(tables, ".".join(way)) if way else tables
    if isinstance(at, dict) and last in at:
        del at[last]
    elif isinstance(at, list) and last.isdigit() and int(last) < len(at):
        del at[int(last)]
    else:
        return False
    return True


def _instead(tables: Tables, key: str, value: Any) -> bool:
    """Put another value in the place of one that is there."""
    if look_up(tables, key) is None:
        return False
    put(tables, key, copy.deepcopy(value))
    return True


def _ended(tables: Tables, end: float) -> bool:
    """End the run sooner."""
    now = look_up(tables, "simulation.duration") or look_up(tables, "path.duration")
    if not isinstance(now, int | float) or not end < now:
        return False
    put(tables, "simulation.duration", float(f"{end:.2g}"))
    return True


def _rounded(tables: Tables, key: str, digits: int) -> bool:
    """A number, or each of a list, with fewer digits."""
    value = look_up(tables, key)
    if isinstance(value, float):
        put(tables, key, float(f"{value:.{digits}g}"))
    elif isinstance(value, list) and any(isinstance(one, float) for one in value):
        put(tables, key, [float(f"{x:.{digits}g}") if isinstance(x, float) else x for x in value])
    else:
        return False
    return True


MOST: Final = 400
"""Scenarios that are run at most."""
TICK: Final = re.compile(r"from tick (\d+) on")
SIZE: Final = re.compile(r": ([0-9.e+-]+|inf)$")
LEFT: Final = 0.1
"""The law stays broken by this share of what it was broken by, so that it is the same defect."""
WIDTH: Final = 100
"""Letters of a line of the test's first words."""
TEST: Final = '''"""Episode {number} of `ftqp campaign {study}`, made smaller.

{sentence}
"""

from ftqp.app.campaign.judged_scenario import broken_laws

SCENARIO = """
{scenario}"""


def test_{name}_holds():
    assert "{law}" not in broken_laws(SCENARIO{how})
'''


def shrink(made: Campaign, number: int, out: Path | None, *, as_json: bool) -> ExitCode:
    """Writes the scenario and the test."""
    folder = free_folder(out, f"{made.name}-{number}-shrunk")
    content, _ = made.drawn(number)
    work = EpisodeWork(campaign=made)
    try:
        laws = broken_by(work, content)
    except ScenarioError as error:
        raise InputError(f"episode {number} of {made.name} is no scenario: {error!s:.300}") from error
    if not laws:
        raise InputError(
            f"episode {number} of {made.name} breaks no law, so that there is nothing to shrink; the summary "
            "names those that do"
        )
    law = next(iter(laws))

    def broken(tables: dict[str, Any]) -> Broken:
        try:
            found = broken_by(work, tables)
        except ScenarioError:
            return None
        if law not in found or size(found[law]) < LEFT * size(laws[law]):
            return None
        tick, dt = TICK.search(found[law]), tables.get("planner", {}).get("dt", 1e-3)
        return law, None if tick is None else (int(tick[1]) + 1) * float(dt)

    with progress(f"{made.name} {number}", float(MOST)) as told:
        small = shrunk(content, made.tables.vary, broken, most=MOST, heard=told)
    sentence = broken_by(work, small.content)[law]
    scenario = document.toml(small.content)
    name = re.sub(r"\W+", "_", f"{law}_{made.name}_{number}").lower()
    file = f"test_{name}.py"
    make_folder(folder)
    write(folder / SCENARIO, scenario)
    write(folder / file, text_of_test(made, number, law=law, sentence=sentence, scenario=scenario, name=name))
    facts = {
        "campaign": made.name, "episode": number, "law": law, "sentence": sentence,
        "before": laws[law], "keys": small.keys, "keys_before": small.keys_before, "tried": small.tried,
        "scenario": str(folder / SCENARIO), "test": str(folder / file), "folder": str(folder),
    }  # fmt: skip
    said = (
        f"episode {number}: {laws[law]}\n"
        f"{small.keys} keys in place of {small.keys_before} break the same law, after {small.tried} "
        f"scenarios: {sentence}\n"
        f"run it: ftqp run {folder / SCENARIO}; a test of it: {folder / file}"
    )
    answer(facts, as_json, [said])
    return ExitCode.STOPPED


def size(sentence: str) -> float:
    """By how much a law was broken, as its sentence ends; infinite where it does not say."""
    said = SIZE.search(sentence)
    return float(said[1]) if said else math.inf


def text_of_test(made: Campaign, number: int, *, law: str, sentence: str, scenario: str, name: str) -> str:
    """The text of a test that fails as long as the law is broken."""
    table = made.tables.campaign
    how = "" if table.judged == "exactly" else f', judged="{table.judged}"'
    how += "" if table.calm is None else f", calm={table.calm!r}"
    return TEST.format(
        study=made.name, number=number, law=law, name=name, how=how,
        sentence=textwrap.fill(f"{sentence[0].upper()}{sentence[1:]}.", WIDTH),
        scenario=scenario.replace("\\", "\\\\").replace('"""', r"\"\"\""),
    )  # fmt: skip
