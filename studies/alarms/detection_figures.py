"""The figures of the study of detection: what counts as right, in time, and with which certainty."""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from alarms.detection_cases import KINDS
from alarms.detection_world import DT, LATENCY
from scipy import stats

SENSOR, NOMINAL, REAL, TORQUE = 10, 50, 100, 100
"""How soon should be known [ticks]: an encoder that fails, a joint that locks or runs away, lost torque."""
CONFIDENCE = 0.95


def limit(kind: str, setting: str) -> int:
    """How soon a kind should be known [ticks]; samples that are late come late."""
    late = LATENCY if setting == "real" else 0
    if KINDS[kind].sensor:
        return SENSOR + late
    if KINDS[kind].share is not None:
        return TORQUE
    return REAL if setting == "real" else NOMINAL


def is_right(row: dict[str, Any]) -> bool:
    """Whether joint and kind were right, a set that holds the kind counting as right."""
    right: bool = not row["early"] and row["of"] == row["joint"] and KINDS[row["kind"]].named in row["said"]
    return right


def interval(count: int, of: int) -> tuple[float, float]:
    """The 95 % interval of Clopper and Pearson of a share."""
    if of == 0:
        return 0.0, 1.0
    between = stats.binomtest(count, of).proportion_ci(CONFIDENCE, method="exact")
    return float(between.low), float(between.high)


def cell(rows: Sequence[dict[str, Any]], setting: str) -> dict[str, Any]:
    """The figures of the cases of one kind."""
    right = [row for row in rows if is_right(row)]
    soon = [row for row in right if row["found"] <= limit(row["kind"], setting)]
    low, high = interval(len(soon), len(rows))
    found = np.array([DT * row["found"] for row in rows if row["found"] is not None and not row["early"]])
    return {
        "cases": len(rows),
        "soon": len(soon),
        "right": len(right),
        "sets": sum(len(row["said"]) > 1 for row in right),
        "low": low,
        "high": high,
        "suspected": sum(row["suspected"] is not None for row in rows),
        "early": sum(row["early"] for row in rows),
        "median": float(np.median(found)) if len(found) else None,
        "p95": float(np.quantile(found, 0.95)) if len(found) else None,
    }


def confusion(rows: Iterable[dict[str, Any]], setting: str) -> list[tuple[str, int]]:
    """What was said in the cases that are not right in time, the most frequent first."""
    causes: Counter[str] = Counter()
    for row in rows:
        if row["early"]:
            causes["said before the fault"] += 1
        elif row["found"] is None:
            causes["nothing said" if row["suspected"] is None else "suspected, nothing said"] += 1
        elif not is_right(row):
            whose = (
                "its joint" if row["of"] == row["joint"] else f"joint {row['of'] + 1} for {row['joint'] + 1}"
            )
            causes[f"{' or '.join(row['said'])} of {whose}"] += 1
        elif row["found"] > limit(row["kind"], setting):
            causes["right, but late"] += 1
    return causes.most_common()


def rate_bound(alarms: int, hours: float) -> float:
    """The upper 95 % bound of a rate of which so many events were seen [1/h]; 3/T for none."""
    if hours <= 0.0:
        return float("inf")
    return float(0.5 * stats.chi2.ppf(CONFIDENCE, 2 * alarms + 2) / hours)
