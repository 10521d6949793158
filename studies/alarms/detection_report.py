"""The report of the study of detection: tables of what was found, how soon, and what was said instead."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from alarms.detection_cases import KINDS
from alarms.detection_figures import cell, confusion, interval, rate_bound
from alarms.detection_scores import SETTLING
from alarms.detection_world import DT, SETTINGS, Configuration
from bench import results

GOALS = {
    "encoders that fail": (0.99, 0.99),
    "locks": (0.99, 0.97),
    "runaway": (0.99, 0.97),
    "free": (0.97, 0.97),
    "degraded": (0.97, 0.97),
}
"""What is asked for in `nominal` and in `real`: the share of such cases that should be right in time."""
MOST_CAUSES = 6


def summary(
    configuration: Configuration, given: str, rows: Sequence[dict[str, Any]], tours: Sequence[dict[str, Any]]
) -> dict[str, Any]:
    """The figures of one configuration and of what the detector looked at."""
    kinds = [name for name in KINDS if any(row["kind"] == name for row in rows)]
    by_kind = {name: [row for row in rows if row["kind"] == name] for name in kinds}
    findings = [found for tour in tours for found in tour["findings"]]
    return {
        "robot": configuration.robot,
        "drive": configuration.drive,
        "setting": configuration.setting,
        "given": given,
        "cells": {name: cell(of, configuration.setting) for name, of in by_kind.items()},
        "causes": {name: confusion(of, configuration.setting) for name, of in by_kind.items()},
        "hours": sum(tour["ticks"] for tour in tours) * DT / 3600.0,
        "suspicions": sum(len(tour["suspicions"]) for tour in tours),
        "findings": len(findings),
        "found": Counter(" or ".join(kinds) for _, _, kinds in findings).most_common(),
        "most": max((tour["most"] for tour in tours), default=0.0),
    }


def _milliseconds(value: float | None) -> str:
    return "-" if value is None else f"{1e3 * value:.0f}"


def _cell(found: dict[str, Any] | None) -> str:
    """One cell: right in time/right/cases, 95 % interval of the first, sets, delays."""
    if found is None:
        return ""
    text = f"{found['soon']}/{found['right']}/{found['cases']}"
    text += f" [{100 * found['low']:.1f}, {100 * found['high']:.1f}]"
    if found["sets"]:
        text += f" {found['sets']} sets"
    return f"{text}; {_milliseconds(found['median'])}, {_milliseconds(found['p95'])}"


def cells(rows: Sequence[dict[str, Any]]) -> list[str]:
    """The table of all cells, a row a configuration."""
    kinds = [name for name in KINDS if any(name in row["cells"] for row in rows)]
    lines = [f"| arm, drive, setting | looks at | {' | '.join(kinds)} |", "|---" * (2 + len(kinds)) + "|"]
    for row in rows:
        if row["cells"]:
            what = f"{row['robot']}, {row['drive']}, {row['setting']}"
            entries = " | ".join(_cell(row["cells"].get(name)) for name in kinds)
            lines.append(f"| {what} | {row['given']} | {entries} |")
    return lines


def _goal(kind: str) -> str:
    """Under which goal a kind falls."""
    if KINDS[kind].sensor:
        return "encoders that fail"
    return "locks" if KINDS[kind].named == "locked" else kind


def goals(rows: Sequence[dict[str, Any]]) -> list[str]:
    """What was asked for beside what was reached, all arms together."""
    counts: dict[Any, dict[str, list[int]]] = {}
    for row in rows:
        place = counts.setdefault((row["drive"], row["setting"], row["given"]), {})
        for name, found in row["cells"].items():
            sums = place.setdefault(_goal(name), [0, 0, 0])
            for i, key in enumerate(("soon", "cases", "sets")):
                sums[i] += found[key]
    lines = [f"| drive, setting | looks at | {' | '.join(GOALS)} |", "|---" * (2 + len(GOALS)) + "|"]
    for i, setting in enumerate(SETTINGS[:2]):
        asked = " | ".join(f"{100.0 * goal[i]:.0f} %" for goal in GOALS.values())
        lines.append(f"| *asked for, {setting}* | | {asked} |")
    for (drive, setting, given), place in counts.items():
        if place:
            entries = " | ".join(_share(*place[what]) if what in place else "" for what in GOALS)
            lines.append(f"| {drive}, {setting} | {given} | {entries} |")
    return lines


def _share(soon: int, of: int, sets: int) -> str:
    """How many were right in time, with the 95 % interval, and how many of the right ones were sets."""
    low, high = interval(soon, of)
    text = f"{soon} of {of}, {100.0 * soon / of:.1f} % [{100.0 * low:.1f}, {100.0 * high:.1f}]"
    return f"{text}; {sets} sets" if sets else text


def causes(rows: Sequence[dict[str, Any]]) -> list[str]:
    """What was said in the cases that were not right in time, all arms together."""
    totals: dict[Any, Counter[str]] = defaultdict(Counter)
    number: Counter[Any] = Counter()
    for row in rows:
        for name, found in row["causes"].items():
            key = row["drive"], row["setting"], row["given"], name
            totals[key].update(dict(found))
            number[key] += row["cells"][name]["cases"]
    lines = ["| drive, setting | looks at | case | of | instead |", "|---|---|---|---:|---|"]
    for (drive, setting, given, name), found in totals.items():
        if found:
            said = "; ".join(f"{count} {cause}" for cause, count in found.most_common(MOST_CAUSES))
            lines.append(
                f"| {drive}, {setting} | {given} | {name} | {number[drive, setting, given, name]} | {said} |"
            )
    return lines


def _alarms(what: str, given: str, some: Sequence[dict[str, Any]]) -> str:
    """A row of the table of false alarms."""
    hours = sum(row["hours"] for row in some)
    suspicions, findings = (sum(row[key] for row in some) for key in ("suspicions", "findings"))
    said: Counter[str] = Counter()
    for row in some:
        said.update(dict(row["found"]))
    told = "; ".join(f"{count} {kinds}" for kinds, count in said.most_common(MOST_CAUSES))
    most = max((row["most"] for row in some), default=0.0)
    bounds = " | ".join(f"{rate_bound(count, hours):.2g}" for count in (suspicions, findings))
    return f"| {what} | {given} | {hours:.2f} | {suspicions} | {findings} | {bounds} | {most:.2f} | {told} |"


def false_alarms(rows: Sequence[dict[str, Any]], *, whole: bool = True) -> list[str]:
    """Hours of healthy motion, what was said in them, and what rates that shows."""
    lines = [
        "| motion | looks at | hours | suspicions | findings | suspicions an hour, at most (95 %) "
        "| findings an hour, at most (95 %) | largest z | said |",
        "|---|---|---:|---:|---:|---:|---:|---:|---|",
    ]
    watched = [row for row in rows if row["hours"] > 0.0]
    for row in watched if whole else ():
        lines.append(_alarms(f"{row['robot']}, {row['drive']}, {row['setting']}", row["given"], [row]))
    for setting in SETTINGS:
        for given in dict.fromkeys(row["given"] for row in watched):
            some = [row for row in watched if (row["setting"], row["given"]) == (setting, given)]
            if some:
                lines.append(_alarms(f"all, {setting}", given, some))
    return lines


def for_docs(result: dict[str, Any], report: str) -> list[str]:
    """The short tables, with where they come from."""
    machine = f"{result['machine']['cpu']}, {result['machine']['cores']} cores"
    return [
        *goals(result["rows"]),
        "",
        *false_alarms(result["rows"], whole=False),
        "",
        f"From [{Path(report).name}]({report}), {result['date'][:10]}, {machine}. Made by "
        f"`{result['command']}`.",
    ]


def markdown(result: dict[str, Any]) -> str:
    """The report, as one string."""
    rows = result["rows"]
    lines = results.preamble("Detection of failures that nobody announces", result)
    lines += [
        "Right in time (an encoder that fails 10 ms, 2 ms more where samples are late; lost torque 100 ms; "
        "else 50 ms, in `real` 100 ms)/right at any time/cases, with the 95 % interval of the first share in "
        "per cent, and how many of the right ones were sets of kinds; then median and 95 % of the delay of "
        "what was said first [ms].",
        "",
        *cells(rows),
        "",
        "## What was asked for",
        "",
        "Cases that were right in time, all arms together, with the 95 % interval of the share.",
        "",
        *goals(rows),
        "",
        "## What was said instead",
        "",
        *causes(rows),
        "",
        "## False alarms",
        "",
        "Healthy motion with standstill, in `real` with other loads and friction than calibrated. Suspicions "
        "less than a second apart are one. The first "
        f"{DT * SETTLING:g} s after a start are not counted as watched, alarms in them are.",
        "",
        *false_alarms(rows),
        "",
    ]
    return "\n".join([*lines, *results.appendix(result)])
