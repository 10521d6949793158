"""What the rows of a campaign come to: counts, bounds, and how they spread over what was drawn."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Final

from ftqp.app.campaign.found_failures import CONFIDENCE, detector_summary, recovery_summary, share_interval
from ftqp.checker.checked_run import LAWS
from ftqp.control.planner.status import StepStatus

OUTCOMES: Final = ("sound", "broken", "raised", "refused")
MOST_VALUES: Final = 12
"""A key with more values than this is not told value by value, but by ranges if they are numbers."""
RANGES: Final = 5
SHOWN: Final = 10
"""Episodes that are named one by one."""

Row = Mapping[str, Any]


def summary(name: str, rows: Sequence[Row]) -> dict[str, Any]:
    """What ``summary.json`` says of a campaign's rows.

    ``bound`` is the largest share of broken episodes that is compatible with the rows at 95 %, where none
    was broken: 1 - 0.05^(1/n); ``broken_interval`` is the interval of that share in any case.
    ``followable`` is for how long in all targets were certain to be within reach, so that tracking was
    judged [s].
    """
    found = counts(rows)
    run = found["sound"] + found["broken"]
    clean = not found["broken"] and not found["raised"] and run > 0
    bad = [row for row in rows if row["outcome"] in ("broken", "raised")]
    laws = {law: sum((row[f"law_{law}"] or 0.0) > 0.0 for row in rows) for law in LAWS}
    return {
        "campaign": name,
        "episodes": len(rows),
        **found,
        "violations": found["broken"],
        "exceptions": found["raised"],
        "false_ok": laws["honesty"],
        "swings": laws["rest"],
        "steps": sum(row["ticks"] or 0 for row in rows),
        "bound": 1.0 - (1.0 - CONFIDENCE) ** (1.0 / run) if clean else None,
        "broken_interval": share_interval(found["broken"] + found["raised"], run + found["raised"]),
        "laws": laws,
        "said": dict(_said(rows)),
        "followable": sum(row["followable"] or 0.0 for row in rows),
        "largest_ok_error": max((row["largest_ok_error"] or 0.0 for row in rows), default=0.0),
        "by_key": by_key(rows),
        "detection": detector_summary(rows),
        "after_failures": recovery_summary(rows),
        "examples": [_shown(row) for row in bad[:SHOWN]],
        "refusals": [_shown(row) for row in rows if row["outcome"] == "refused"][:SHOWN],
    }


def _said(rows: Sequence[Row]) -> Counter[str]:
    """Ticks by what planners said of them."""
    said: Counter[str] = Counter()
    for row in rows:
        said.update(json.loads(row["said"] or "{}"))
    return said


def _shown(row: Row) -> dict[str, Any]:
    return {key: row[key] for key in ("episode", "outcome", "sentences")}


def counts(rows: Sequence[Row]) -> dict[str, int]:
    """How many episodes there were of each outcome."""
    found = [row["outcome"] for row in rows]
    return {outcome: found.count(outcome) for outcome in OUTCOMES}


def fallback_share(found: Mapping[str, int]) -> str:
    """The share of ticks in which the solver's answer was not used, for a reader."""
    return f"{100.0 * found['fallbacks'] / found['ticks']:.2f} %" if found["ticks"] else "-"


def by_key(rows: Sequence[Row]) -> dict[str, dict[str, dict[str, int]]]:
    """The same for each value of the keys that were drawn from a few, and by ranges of those of many numbers.

    ``ticks`` of them were judged, and in ``fallbacks`` of those the solver's answer was not used.
    """
    groups: dict[str, list[tuple[Any, Row]]] = {}
    for row in rows:
        for key, value in json.loads(row["drawn"]).items():
            groups.setdefault(key, []).append((value, row))
    result: dict[str, dict[str, dict[str, int]]] = {}
    for key, pairs in groups.items():
        values: dict[str, list[Row]] = {}
        for value, row in pairs:
            values.setdefault(value if isinstance(value, str) else json.dumps(value), []).append(row)
        if len(values) > MOST_VALUES:
            if not all(isinstance(value, int | float) for value, _ in pairs):
                continue
            values = _ranges(pairs)
        result[key] = {
            value: {"episodes": len(some), **counts(some), **_ticks(some)}
            for value, some in (values if len(values) > MOST_VALUES else dict(_sorted(values))).items()
        }
    return result


def _ticks(rows: Sequence[Row]) -> dict[str, int]:
    said = _said(rows)
    return {"ticks": said.total(), "fallbacks": said[StepStatus.FALLBACK.name]}


def _sorted(values: Mapping[str, list[Row]]) -> list[tuple[str, list[Row]]]:
    """Numbers by size, then words, and ranges as they are."""

    def place(pair: tuple[str, list[Row]]) -> tuple[int, float, str]:
        try:
            return 0, float(pair[0].partition(" to ")[0]), pair[0]
        except ValueError:
            return 1, 0.0, pair[0]

    return sorted(values.items(), key=place)


def _ranges(pairs: Sequence[tuple[Any, Row]]) -> dict[str, list[Row]]:
    """Rows by ranges of a number, each with about as many rows."""
    ordered = sorted(pairs, key=lambda pair: pair[0])
    result: dict[str, list[Row]] = {}
    for at in range(RANGES):
        some = ordered[at * len(ordered) // RANGES : (at + 1) * len(ordered) // RANGES]
        if some:
            name = f"{some[0][0]:.4g} to {some[-1][0]:.4g}"
            result.setdefault(name, []).extend(row for _, row in some)
    return result
