"""What a campaign keeps of tasks after a failure: columns of an episode, and what all of them come to."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from ftqp.app.campaign.found_failures import share_interval
from ftqp.app.scenario.setup import Setup
from ftqp.checker.trace import Rest

COLUMNS: Final = {
    "rest_arm": "TEXT",
    "rest_joint": "INTEGER",
    "rest_since": "REAL",
    "rest_feasible": "INTEGER",
    "rest_finished": "INTEGER",
    "rest_stopped": "INTEGER",
}
"""Empty for episodes in which nothing failed, or nobody asked whether the rest can be done; joints are
counted from 1 at the base, ``rest_since`` is the share of the motion at which it failed."""
PARTS: Final = 3
"""Instants are told by thirds of the motion."""


def values(setup: Setup, rest: Rest | None) -> dict[str, Any]:
    """The columns of an episode."""
    if rest is None:
        return {}
    return {
        "rest_arm": setup.robot.name,
        "rest_joint": rest.joint + 1,
        "rest_since": rest.since,
        "rest_feasible": int(rest.feasible),
        "rest_finished": int(rest.missed <= 0.0),
        "rest_stopped": int(rest.stopped),
    }


def recovery_summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
    """Of the failures whose rest a search calls feasible, how many are finished; None where nothing failed.

    In all, and by arm, joint and instant; intervals hold at 95 %, by Clopper and Pearson. ``unproven`` are
    failures after which the search found no motion, which is no proof that there is none.
    """
    seen = [row for row in rows if row["rest_feasible"] is not None]
    if not seen:
        return None
    feasible = [row for row in seen if row["rest_feasible"]]
    unproven = [row for row in seen if not row["rest_feasible"]]
    groups: dict[tuple[int, Any], list[Mapping[str, Any]]] = {}
    for row in feasible:
        part = min(PARTS - 1, int(PARTS * row["rest_since"]))
        for key in enumerate((row["rest_arm"], part, row["rest_joint"])):
            groups.setdefault(key, []).append(row)
    return {
        "all": _finished(feasible),
        "stopped": sum(row["rest_stopped"] and not row["rest_finished"] for row in feasible),
        "by": {_name(*key): _finished(groups[key]) for key in sorted(groups)},
        "unproven": _finished(unproven),
    }


def _name(kind: int, value: Any) -> str:
    """Of a group: an arm, an instant or a joint."""
    if kind == 1:
        return f"{100 * value // PARTS} to {100 * (value + 1) // PARTS} % of the motion"
    return f"joint {value}" if kind == 2 else str(value)


def _finished(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    count = sum(row["rest_finished"] for row in rows)
    return {"failures": len(rows), "finished": count, "interval": share_interval(count, len(rows))}
