"""What the rows of a campaign come to: counts, bounds, and how they spread over what was drawn."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any, Final, get_type_hints

import numpy as np

from ftqp.app.campaign import beside_rival
from ftqp.app.campaign.shown_trace import failures
from ftqp.app.scenario.setup import Setup
from ftqp.checker.alarms import Alarm, Detection, detection
from ftqp.checker.checked_run import LAWS
from ftqp.checker.trace import Failure, Rest
from ftqp.control.planner.status import StepStatus
from ftqp.sim.log.log_arrays import Log

KINDS: Final[dict[Any, str]] = {float: "REAL", float | None: "REAL", int: "INTEGER", str: "TEXT"}
COLUMNS: Final = {name: KINDS[hint] for name, hint in get_type_hints(Detection).items()}
"""Empty for episodes without a detector; times in seconds."""
REST_COLUMNS: Final = {
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
"""Instants are counted by thirds of the motion."""
HOUR: Final = 3600.0
CONFIDENCE: Final = 0.95
STRAYS: Final = 0.01
"""A joint that was farther than this from its reference [rad or m] after it failed did not do as a healthy
one does. A convention: half of what a healthy joint may be away (``ERROR_BAND``)."""
AT_ITS_END: Final = 0.99
"""A weakened motor that gave this share of what it has left was asked for that or for more: rounding."""


def detector_values(setup: Setup, log: Log) -> dict[str, Any]:
    """The columns of an episode; none without a detector."""
    said = log.metadata.get("detections")
    if setup.tables.planner.detector is None or said is None:
        return {}
    alarms = [
        Alarm(joint=setup.robot.joint(one["joint"]), at=one["detected_at"], kinds=frozenset(one["kinds"]))
        for one in said
    ]
    real = failures(setup)
    seen = [failure for failure in real if _is_visible(setup, log, failure)]
    return asdict(detection(alarms, real, setup.planner.dt * (len(log) - 1), seen))


def _is_visible(setup: Setup, log: Log, failure: Failure) -> bool:
    """Whether a failure made a difference: its joint strays, or its motor gives all that it has left."""
    joint = setup.robot.joints[failure.joint]
    after = log["t"] >= failure.since
    if failure.kind == "degraded":
        left = failure.shares.get("tau_max", 1.0) * setup.robot.limits.tau_max[failure.joint]
        return bool((np.abs(log[f"tau.{joint}"][after]) > AT_ITS_END * left).any())
    away = np.abs(log[f"q.{joint}"] - log[f"q_reference.{joint}"])[after]
    return bool((away > STRAYS).any())


def detector_summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
    """What all episodes with a detector come to; None where there is none."""
    watched = [row for row in rows if row["healthy_time"] is not None]
    if not watched:
        return None
    from scipy.stats import chi2  # slow to load

    hours = sum(row["healthy_time"] for row in watched) / HOUR
    delays = [row["delay"] for row in watched if row["delay"] is not None]
    said = Counter(row["found_as"] for row in watched if row["found_as"])
    counted = ("false_alarms", "unannounced", "showed", "found", "right_kind", "wrong_joint")
    sums = {name: sum(row[name] for row in watched) for name in counted}
    most = 0.5 * float(chi2.ppf(CONFIDENCE, 2 * sums["false_alarms"] + 2))
    return {
        "healthy_hours": hours,
        **sums,
        "false_alarms_per_hour": sums["false_alarms"] / hours if hours > 0.0 else None,
        "false_alarms_per_hour_at_most": most / hours if hours > 0.0 else None,
        "found_interval": share_interval(sums["found"], sums["unannounced"]),
        "delay": None
        if not delays
        else {
            name: float(np.percentile(delays, percent))
            for name, percent in (("median", 50.0), ("p95", 95.0), ("max", 100.0))
        },
        "found_as": dict(said.most_common()),
    }


def share_interval(count: int, total: int) -> tuple[float, float] | None:
    """The shares that ``count`` of ``total`` are compatible with at 95 %; None of nothing.

    Where all or none were counted the interval has one end alone, that of 5 %: 1 - 0.05^(1/n) of n.
    Source: Clopper and Pearson 1934.
    """
    if total == 0:
        return None
    from scipy.stats import beta  # slow to load

    tail = (1.0 - CONFIDENCE) / (1 if count in (0, total) else 2)
    low = 0.0 if count == 0 else float(beta.ppf(tail, count, total - count + 1))
    high = 1.0 if count == total else float(beta.ppf(1.0 - tail, count + 1, total - count))
    return low, high


def rest_values(setup: Setup, rest: Rest | None) -> dict[str, Any]:
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
    """Of the failures whose rest a search calls feasible, how many are finished; None without any."""
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


OUTCOMES: Final = ("sound", "broken", "raised", "refused")
MOST_VALUES: Final = 12
"""A key with more values than this is not listed value by value, but by ranges if they are numbers."""
RANGES: Final = 5
"""So many ranges; of fewer episodes numbers that hardly repeat are in ranges, too."""
BY: Final = ("event", "drive", "leader", "arm")
"""Groups of bundles by which episodes beside a rival are counted."""
SHOWN: Final = 10
"""Episodes that are named one by one."""

Row = Mapping[str, Any]


def summary(name: str, rows: Sequence[Row]) -> dict[str, Any]:
    """What ``summary.json`` says of a campaign's rows.

    ``bound`` is the largest share of broken episodes that is compatible with the rows at 95 %, where none
    was broken: 1 - 0.05^(1/n); ``broken_interval`` is the interval of that share in any case.
    ``followable`` is how long targets were certain to be within reach, so that tracking was judged [s].
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
        "beside": beside_summary(rows),
        "examples": [_shown(row) for row in bad[:SHOWN]],
        "refusals": [_shown(row) for row in rows if row["outcome"] == "refused"][:SHOWN],
    }


def beside_summary(rows: Sequence[Row]) -> list[dict[str, Any]] | None:
    """The counts of episodes beside a rival, by event, drive, leader and arm; None of other campaigns."""
    seen = [(json.loads(row["drawn"]), json.loads(row["beside"])) for row in rows if row["beside"]]
    return beside_rival.counted(seen, BY) if seen else None


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
    """The same for each value of the keys drawn from a few, and by ranges of those of many numbers."""
    groups: dict[str, list[tuple[Any, Row]]] = {}
    for row in rows:
        for key, value in json.loads(row["drawn"]).items():
            groups.setdefault(key, []).append((value, row))
    result: dict[str, dict[str, dict[str, int]]] = {}
    for key, pairs in groups.items():
        values: dict[str, list[Row]] = {}
        for value, row in pairs:
            values.setdefault(value if isinstance(value, str) else json.dumps(value), []).append(row)
        numbers = all(isinstance(value, int | float) for value, _ in pairs)
        if len(values) > MOST_VALUES and not numbers:
            continue
        if len(values) > MOST_VALUES or (numbers and len(pairs) / 2 < len(values) > RANGES):
            values = _ranges(pairs)
        result[key] = {
            value: {"episodes": len(some), **counts(some), **_ticks(some)} for value, some in _sorted(values)
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
