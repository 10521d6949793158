"""The sections of a report: one about several runs side by side, and one about each run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ftqp.sim.log.log_arrays import Log
from ftqp.viz.pages.page import folded, heading, paragraph, table
from ftqp.viz.report.inline_figures import compared, figures_of
from ftqp.viz.report.numbers import numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportedRun:
    """A run as a report tells it.

    Attributes:
        label: Names it.
        log: Its log, with rows.
        facts: Its summary.
        sentences: What happened, in plain words.
        scenario: The scenario with every default filled in, as TOML; empty where it is not known.
        replay: The part of the page that plays it, or a sentence that says why there is none.
        plays: Whether ``replay`` is that part.
    """

    label: str
    log: Log
    facts: Mapping[str, Any]
    sentences: Sequence[str]
    scenario: str
    replay: str
    plays: bool


def side_by_side(runs: Sequence[ReportedRun]) -> list[str]:
    """What several runs have in common: all their numbers, and figures where it is the same arm."""
    logs = {run.label: run.log for run in runs}
    parts = [numbers({run.label: run.facts for run in runs}, logs)]
    arms = {(run.log.metadata["robot"], tuple(run.log.metadata["joints"])) for run in runs}
    if len(runs) > 1 and len(arms) == 1:
        parts = [*compared(logs, runs[0].log.metadata["robot"]), *parts]
    return parts


def run_parts(run: ReportedRun, *, alone: bool) -> list[str]:
    """The section about a run.

    A page about it ``alone`` has its name above already.
    """
    parts = [heading("What happened" if alone else run.label)]
    parts += [paragraph(sentence) for sentence in run.sentences]
    if alone:
        parts += side_by_side([run])
    parts += [heading("Replay" if alone else f"{run.label}: replay")]
    parts += [run.replay if run.plays else paragraph(run.replay)]
    parts += [heading("Figures" if alone else f"{run.label}: figures"), *figures_of(run.log)]
    if run.scenario:
        parts.append(folded(f"Scenario of {run.label}, every default filled in", run.scenario))
    return parts


def versions_part(runs: Sequence[ReportedRun], here: Mapping[str, str]) -> str:
    """A table of what took part in the runs, and in the report."""
    columns = [(run.label, run.log.metadata.get("versions") or {}) for run in runs] + [("this report", here)]
    names = dict.fromkeys(name for _, found in columns for name in found)
    rows = [(str(name), *(str(found.get(name, "-")) for _, found in columns)) for name in names]
    return table("Versions", ("", *(label for label, _ in columns)), rows)
