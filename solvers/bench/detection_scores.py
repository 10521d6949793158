"""What a detector makes of the cases of the study, by the first thing that it says."""

from typing import Any, Protocol

import numpy as np

from bench.detection_cases import Motion
from bench.detection_world import Configuration, Record, Sent, arm

INPUTS = ("encoders", "demand", "demand, torques")
"""What a detector may look at beside the encoders: what the drive asks of its motors, and what they give."""
APART = 1000
"""Suspicions nearer to each other [ticks] are one alarm."""
SETTLING = 500
"""Ticks after a detector's reset that are not counted as watched."""


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
    """The names of the arm's joints."""
    return list(arm(configuration.robot).joints)


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
