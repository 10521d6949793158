"""What a campaign keeps of detectors and of tasks after a failure: columns, and what all of them come to."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from ftqp.app.campaign.shown_trace import failures
from ftqp.app.scenario.setup import Setup
from ftqp.checker.alarms import Alarm, detection
from ftqp.checker.trace import Failure, Rest
from ftqp.sim.log.log_arrays import Log

COLUMNS: Final = {
    "healthy_time": "REAL",
    "false_alarms": "INTEGER",
    "unannounced": "INTEGER",
    "showed": "INTEGER",
    "found": "INTEGER",
    "right_kind": "INTEGER",
    "wrong_joint": "INTEGER",
    "delay": "REAL",
    "found_as": "TEXT",
}
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
"""Instants are told by thirds of the motion."""
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
    found = detection(alarms, real, setup.planner.dt * (len(log) - 1), seen)
    return {
        "healthy_time": found.healthy,
        "false_alarms": found.false_alarms,
        "unannounced": found.unannounced,
        "showed": found.showed,
        "found": found.found,
        "right_kind": found.right_kind,
        "wrong_joint": found.wrong_joint,
        "delay": found.delay,
        "found_as": found.said,
    }


def _is_visible(setup: Setup, log: Log, failure: Failure) -> bool:
    """Whether a failure made a difference: its joint strays, or its motor gives all that it has left.

    A joint that stands where it should stand may as well be locked, and a motor with half of its torque is a
    healthy one as long as it is asked for less.
    """
    joint = setup.robot.joints[failure.joint]
    after = log["t"] >= failure.since
    if failure.kind == "degraded":
        left = failure.shares.get("tau_max", 1.0) * setup.robot.limits.tau_max[failure.joint]
        return bool((np.abs(log[f"tau.{joint}"][after]) > AT_ITS_END * left).any())
    away = np.abs(log[f"q.{joint}"] - log[f"q_reference.{joint}"])[after]
    return bool((away > STRAYS).any())


def detector_summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
    """What all episodes with a detector come to; None where there is none.

    Intervals hold at 95 %: of shares by Clopper and Pearson, of the rate of false alarms as of a Poisson
    process, of which ``at_most`` is the upper end.
    """
    watched = [row for row in rows if row["healthy_time"] is not None]
    if not watched:
        return None
    from scipy.stats import chi2  # slow to load

    hours = sum(row["healthy_time"] for row in watched) / HOUR
    false = sum(row["false_alarms"] for row in watched)
    delays = [row["delay"] for row in watched if row["delay"] is not None]
    said: dict[str, int] = {}
    for row in watched:
        if row["found_as"]:
            said[row["found_as"]] = said.get(row["found_as"], 0) + 1
    total = sum(row["unannounced"] for row in watched)
    found = sum(row["found"] for row in watched)
    return {
        "healthy_hours": hours,
        "false_alarms": false,
        "false_alarms_per_hour": false / hours if hours > 0.0 else None,
        "false_alarms_per_hour_at_most": float(0.5 * chi2.ppf(CONFIDENCE, 2 * false + 2)) / hours
        if hours > 0.0
        else None,
        "unannounced": total,
        "showed": sum(row["showed"] for row in watched),
        "found": found,
        "found_interval": share_interval(found, total),
        "right_kind": sum(row["right_kind"] for row in watched),
        "wrong_joint": sum(row["wrong_joint"] for row in watched),
        "delay": None
        if not delays
        else {
            name: float(np.percentile(delays, percent))
            for name, percent in (("median", 50.0), ("p95", 95.0), ("max", 100.0))
        },
        "found_as": dict(sorted(said.items(), key=lambda pair: -pair[1])),
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
