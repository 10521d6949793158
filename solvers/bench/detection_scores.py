"""What a detector makes of the cases of the study, by the first thing that it says."""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np
from scipy import stats

from bench.detection_cases import KINDS, Motion
from bench.detection_world import DT, LATENCY, Configuration, Record, Sent

INPUTS = ("encoders", "demand", "demand, torques")
"""What a detector may look at beside the encoders: what the drive asks of its motors, and what they give."""
LIMITS = {"sensor": 10, "nominal": 50, "real": 100, "quantised": 50}
"""How soon joint and kind should be known [ticks]."""
APART = 1000
"""Suspicions nearer to each other [ticks] are one alarm."""
SETTLING = 500
"""Ticks after a detector's reset that are not counted as watched."""
CONFIDENCE = 0.95


Row = dict[str, Any]


class Detecting(Protocol):
    """A detector, as `ftqp.Detector`."""

    _session: Any

    def reset(self) -> None: ...
    def update(self, q: Any, v: Any, tau: Any, command: Any) -> Any: ...


def inputs(configuration: Configuration) -> tuple[str, ...]:
    """What a detector of that drive may be given: a torque arm's demand is what is sent to it."""
    return INPUTS if configuration.has_servo else ("encoders", "demand, torques")


class Shown(Sent):
    """The ticks of a record as a detector is given them.

    Args:
        record: what happened.
        given: one of `INPUTS`.
        servo: whether the demand is that of servos, else it is what was sent.
    """

    def __init__(self, record: Record, given: str, servo: bool) -> None:
        super().__init__(record)
        self._tau = record.tau if given.endswith("torques") else None
        self._demand = record.demand if servo and given != "encoders" else None
        self.demand: Any = None

    def __len__(self) -> int:
        """How many ticks there are."""
        return len(self._record.codes)

    def put(self, detector: Detecting, k: int) -> Any:
        """Give the detector that tick: its diagnosis."""
        if self._demand is not None:
            self.demand = self._demand[k]
        tau = None if self._tau is None else self._tau[k]
        return detector.update(self._record.seen[k, 0], None, tau, self.at(k))


def judged(detector: Detecting, motion: Motion, given: str, configuration: Configuration) -> list[Row]:
    """What the detector says first of each case of a motion, which it sees from its beginning at rest.

    Returns:
        For each case ``kind``, ``joint``, ``speed`` and ``loss``; ``early`` if something was said before the
        fault; ``suspected`` and ``found`` [ticks after the fault], ``said`` (kinds), ``of`` (joint), and the
        ``share`` of the torque.
    """
    names = _joints(configuration)
    places = {case.at for case in motion.cases}
    memory = detector._session._memory.view(np.uint8)  # all that it remembers
    kept: dict[int, Any] = {}
    shown = Shown(motion.record, given, configuration.has_servo)
    detector.reset()
    said: Any = {}
    for k in range(max(places, default=-1) + 1):
        if k in places:
            kept[k] = memory.copy()
        said = shown.put(detector, k).isolated
        if said:
            break
    first = [names.index(next(iter(said))), sorted(next(iter(said.values())).kinds)] if said else None
    rows = []
    for case in motion.cases:
        row = {
            "kind": case.kind, "joint": case.joint, "speed": case.speed, "loss": case.loss, "early": False,
            "suspected": None, "found": None, "said": [], "of": None, "share": None,
        }  # fmt: skip
        if case.at in kept:
            memory[:] = kept[case.at]
            _say(row, detector, Shown(case.record, given, configuration.has_servo), names)
        elif first is not None:
            row["early"], (row["of"], row["said"]) = True, first
        rows.append(row)
    return rows


def _say(row: Row, detector: Detecting, shown: Shown, names: list[str]) -> None:
    """What is said first of what is shown."""
    for k in range(len(shown)):
        diagnosis = shown.put(detector, k)
        if row["suspected"] is None and diagnosis.suspicion > 1.0:
            row["suspected"] = k
        isolated = diagnosis.isolated
        if isolated:
            joint, finding = next(iter(isolated.items()))
            row["found"], row["said"] = k, sorted(finding.kinds)
            row["of"], row["share"] = names.index(joint), getattr(finding, "share", None)
            return


def _joints(configuration: Configuration) -> list[str]:
    from bench.detection_world import world

    return list(world(configuration).robot.joints)


def alarms(detector: Detecting, record: Record, given: str, configuration: Configuration) -> Row:
    """What the detector says of healthy motion.

    Returns:
        ``ticks`` that were watched, ``suspicions`` and ``findings`` with their ticks, joints and kinds, and
        the largest ``z``. After a finding the detector begins anew.
    """
    detector.reset()
    shown = Shown(record, given, configuration.has_servo)
    ticks, last, fresh, most = 0, -APART, 0, 0.0
    suspicions: list[Any] = []
    findings: list[Any] = []
    for k in range(len(record.codes)):
        diagnosis = shown.put(detector, k)
        if k - fresh >= SETTLING:
            ticks += 1
        z = diagnosis.suspicion
        most = max(most, z)
        if z > 1.0:
            if k - last > APART:
                suspicions.append([k, diagnosis.suspect, round(z, 3)])
            last = k
        if diagnosis.isolated:
            findings += [[k, joint, sorted(finding.kinds)] for joint, finding in diagnosis.isolated.items()]
            detector.reset()
            fresh = k
    return {"ticks": ticks, "suspicions": suspicions, "findings": findings, "most": round(most, 3)}


def limit(kind: str, setting: str) -> int:
    """How soon a kind should be known [ticks]; samples that are late come late."""
    if KINDS[kind].sensor:
        return LIMITS["sensor"] + (LATENCY if setting == "real" else 0)
    return LIMITS[setting]


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
