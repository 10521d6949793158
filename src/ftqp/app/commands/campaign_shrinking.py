"""``ftqp campaign STUDY --shrink N``: an episode that breaks a law as a small scenario and a ready test."""

import math
import re
import textwrap
from pathlib import Path
from typing import Any, Final

from ftqp.app.campaign.episode_study import Campaign, EpisodeWork
from ftqp.app.campaign.judged_scenario import broken_by
from ftqp.app.campaign.shrinking import Broken, shrunk
from ftqp.app.output.console import ExitCode, answer, progress
from ftqp.app.run.runs import SCENARIO, free_folder, make_folder, write
from ftqp.app.scenario import document
from ftqp.core.errors import InputError, ScenarioError

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
