"""What a detector makes of the cases of the study, by the first thing that it says."""

from typing import Any, Protocol

import numpy as np
from alarms.detection_cases import Motion
from alarms.detection_world import Array, Configuration, Record

import ftqp
from ftqp.kernel.detection.detecting import FOUND

INPUTS = ("encoders", "demand", "demand, torques")
"""What a detector may look at beside the encoders: what the drive asks of its motors, and what they give."""
APART = 1000
"""Suspicions nearer to each other [ticks] are one alarm."""
SETTLING = 500
"""Ticks after a detector's reset that are not counted as watched."""


Row = dict[str, Any]
Finding = tuple[int, list[str], float | None]
"""Which joint, kinds, and the share of its torque."""


class Watching(Protocol):
    """What looks at the rows of a log, as `Watcher`."""

    def reset(self) -> None: ...
    def keep(self) -> Any: ...
    def restore(self, kept: Any) -> None: ...
    def look(self, log: ftqp.MotionLog, first: int, end: int) -> tuple[int, Array, list[Finding]]: ...


class Watcher:
    """A detector that looks at the rows of a log, one tick each, in compiled code."""

    def __init__(self, detector: ftqp.Detector) -> None:
        self._detector, self._session = detector, detector._working()
        self._names = list(detector.diagnosis.joints)

    def reset(self) -> None:
        """Begin anew."""
        self._detector.reset()

    def keep(self) -> Any:
        """All that it remembers."""
        return self._session.memory.copy()

    def restore(self, kept: Any) -> None:
        """Remember what was kept."""
        self._session.memory[:] = kept

    def look(self, log: ftqp.MotionLog, first: int, end: int) -> tuple[int, Array, list[Finding]]:
        """Rows ``first`` to ``end - 1``, up to the first that is a finding.

        Returns:
            The row after the last one that was seen, z of the rows that were, and the findings of the last.
        """
        done, _, trace = self._session.run(log.columns(), 1 << 30, FOUND, first, end)
        found = [
            (self._names.index(joint), sorted(finding.kinds), finding.share)
            for joint, finding in self._detector.diagnosis.isolated.items()
        ]
        return done, trace[first:done], found


def inputs(configuration: Configuration) -> tuple[str, ...]:
    """What a detector of that drive may be given: a torque arm's demand is what is sent to it."""
    return INPUTS if configuration.has_servo else ("encoders", "demand, torques")


def motion_log(record: Record, given: str, configuration: Configuration) -> ftqp.MotionLog:
    """A record as a detector is given it."""
    effort = None
    if given != "encoders" or not configuration.has_servo:
        effort = record.demand if configuration.has_servo else record.tau_c
    tau = record.tau if given.endswith("torques") else None
    return ftqp.MotionLog(
        q=record.q, q_ref=record.q_r, v_ref=record.v_r, a_ref=record.a_r, tau=tau, effort=effort
    )


def judged(detector: Watching, motion: Motion, given: str, configuration: Configuration) -> list[Row]:
    """What the detector says first of each case of a motion, which it sees from its beginning at rest.

    Returns:
        For each case ``kind``, ``joint``, ``speed`` and ``loss``; ``early`` if something was said before the
        fault; ``suspected`` and ``found`` [ticks after the fault], ``said`` (kinds), ``of`` (joint), and the
        ``share`` of the torque.
    """
    kept: dict[int, Any] = {}
    log = motion_log(motion.record, given, configuration)
    detector.reset()
    first: list[Finding] = []
    at = 0
    for place in sorted({case.at for case in motion.cases}):
        if place > at:
            _, _, first = detector.look(log, at, place)
        if first:
            break
        kept[place], at = detector.keep(), place
    rows = []
    for case in motion.cases:
        row = {
            "kind": case.kind, "joint": case.joint, "speed": case.speed, "loss": case.loss, "early": False,
            "suspected": None, "found": None, "said": [], "of": None, "share": None,
        }  # fmt: skip
        if case.at in kept:
            detector.restore(kept[case.at])
            _say(row, detector, motion_log(case.record, given, configuration))
        else:
            row["early"], (row["of"], row["said"], _) = True, first[0]
        rows.append(row)
    return rows


def _say(row: Row, detector: Watching, log: ftqp.MotionLog) -> None:
    """What is said first of a log."""
    done, trace, found = detector.look(log, 0, len(log))
    odd = np.flatnonzero(trace > 1.0)
    row["suspected"] = int(odd[0]) if len(odd) else None
    if found:
        row["found"], (row["of"], row["said"], row["share"]) = done - 1, found[0]


def alarms(detector: Watching, record: Record, given: str, configuration: Configuration) -> Row:
    """What the detector says of healthy motion.

    Returns:
        ``ticks`` that were watched, ``suspicions`` (tick and z) and ``findings`` (tick, joint and kinds), and
        the largest ``z``. After a finding the detector begins anew.
    """
    log = motion_log(record, given, configuration)
    detector.reset()
    ticks, last, at, most = 0, -APART, 0, 0.0
    suspicions: list[Any] = []
    findings: list[Any] = []
    while at < len(log):
        done, trace, found = detector.look(log, at, len(log))
        ticks += max(done - at - SETTLING, 0)
        most = max(most, float(trace.max()))
        for k in at + np.flatnonzero(trace > 1.0):
            if k - last > APART:
                suspicions.append([int(k), round(float(trace[k - at]), 3)])
            last = k
        findings += [[done - 1, joint, kinds] for joint, kinds, _ in found]
        detector.reset()
        at = done
    return {"ticks": ticks, "suspicions": suspicions, "findings": findings, "most": round(most, 3)}
