"""The rows of a campaign as they are read from its file: whatever is not as it was written is refused."""

import json
from collections.abc import Callable, Mapping
from typing import Any, Final

from ftqp.app.campaign import found_failures
from ftqp.app.campaign.campaign_summary import OUTCOMES
from ftqp.app.campaign.episode_study import COLUMNS
from ftqp.app.study.results_file import ResultsFile

MOST: Final = 2**63
"""Whole numbers that are drawn or counted are smaller."""
BAD: Final = ("broken", "raised")
"""Outcomes that say why."""
_COUNTS: Final = tuple(name for name, kind in found_failures.COLUMNS.items() if kind == "INTEGER")


def episode_rows(results: ResultsFile, count: int) -> list[dict[str, Any]]:
    """The rows of the episodes with numbers below ``count``, by column.

    Raises:
        InputError: A value of a row is none that a campaign writes; the sentence names row and column.
    """
    names = ("episode", *COLUMNS)
    rows = [dict(zip(names, row, strict=True)) for row in results.table() if row[0] < count]
    for row in rows:
        for column, expected, holds in EXPECTED:
            if not holds(row):
                raise results.wrong(row["episode"], column, row[column], expected)
    return rows


def _table(text: str | None) -> Mapping[str, Any] | None:
    """The object of a JSON text; None of anything else."""
    try:
        found = json.loads(text or "")
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def _drawn(row: Mapping[str, Any]) -> bool:
    found = _table(row["drawn"])
    return found is not None and all(
        not isinstance(value, int | float) or abs(value) < MOST for value in found.values()
    )


def _said(row: Mapping[str, Any]) -> bool:
    if row["said"] is None:
        return True
    found = _table(row["said"])
    return found is not None and all(type(ticks) is int and 0 <= ticks < MOST for ticks in found.values())


def _sentences(row: Mapping[str, Any]) -> bool:
    return row["outcome"] not in BAD or bool((row["sentences"] or "").strip())


def _size(name: str) -> Callable[[Mapping[str, Any]], bool]:
    """Whether what has that name is empty or not negative."""
    return lambda row: row[name] is None or row[name] >= 0


def _count(name: str) -> Callable[[Mapping[str, Any]], bool]:
    """Whether a detector was counted, where there was one."""
    return lambda row: row["healthy_time"] is None or (row[name] is not None and row[name] >= 0)


def _share(name: str, whole: str) -> Callable[[Mapping[str, Any]], bool]:
    """Whether there are no more of the one than of the other."""
    return lambda row: row["healthy_time"] is None or row[name] <= row[whole]


Expected = tuple[str, str, Callable[[Mapping[str, Any]], bool]]
"""A column, what a campaign writes there, and whether a row has that."""
EXPECTED: Final[tuple[Expected, ...]] = (
    ("outcome", f"one of {', '.join(OUTCOMES)}", lambda row: row["outcome"] in OUTCOMES),
    ("drawn", "a JSON object of what was drawn", _drawn),
    ("said", "a JSON object of statuses with their ticks", _said),
    ("sentences", "what was broken or raised", _sentences),
    *(
        (name, "a number that is not negative", _size(name))
        for name, kind in COLUMNS.items()
        if kind != "TEXT" and name not in _COUNTS
    ),
    *((name, "how many there were", _count(name)) for name in _COUNTS),
    ("showed", "at most the unannounced", _share("showed", "unannounced")),
    ("found", "at most those that showed", _share("found", "showed")),
    ("right_kind", "at most the found", _share("right_kind", "found")),
)
