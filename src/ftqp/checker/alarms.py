"""What a detector said of a run, held against what really failed and when."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.checker.trace import Failure

SHORT = {"free_swinging": "free"}
"""A detector's names of kinds that a `Failure` calls otherwise."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Alarm:
    """A joint that a detector says has failed."""

    joint: int  # Its 0-based index
    at: float  # When it was said [s]
    kinds: frozenset[str]  # What it may be; more than one where they cannot be told apart


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """How a detector did in a run."""

    healthy_time: float  # How long nothing had failed and the detector was watching [s]
    false_alarms: int  # Alarms of that time
    unannounced: int  # Failures that nobody reported before the detector could find them
    showed: int  # Those of them that made a difference, or were found
    found: int  # Those whose joint it named
    right_kind: int  # Those whose kind was among those named as well
    wrong_joint: int  # Alarms after a failure that name a joint which works
    delay: float | None  # From the first failure to its alarm [s]; None where it was not found
    found_as: str  # What was said of that one, in alphabetical order; empty where it was not found


def detection(
    alarms: Sequence[Alarm], failures: Sequence[Failure], end: float, visible: Collection[Failure] = ()
) -> Detection:
    """Hold what was said against what failed.

    An alarm of a joint that has failed belongs to that failure, the first one counts, and later ones of the
    same joint are neither right nor wrong.
    """
    real = [failure for failure in failures if failure.since < end]
    first = min((failure.since for failure in real), default=end)
    found, right, delay, said, unannounced, showed = 0, 0, None, "", 0, 0
    for failure in sorted(real, key=lambda one: one.since):
        its = sorted(
            (alarm for alarm in alarms if alarm.joint == failure.joint and alarm.at >= failure.since),
            key=lambda one: one.at,
        )
        if not its and np.isfinite(failure.reported_at):
            continue
        if its and its[0].at >= failure.reported_at:
            continue
        unannounced += 1
        showed += bool(its) or failure in visible
        if not its:
            continue
        found += 1
        right += failure.kind in {SHORT.get(kind, kind) for kind in its[0].kinds}
        if failure.since == first:
            delay, said = its[0].at - failure.since, " or ".join(sorted(its[0].kinds))
    strange = [
        alarm
        for alarm in alarms
        if not any(one.joint == alarm.joint and one.since <= alarm.at for one in real)
    ]
    return Detection(
        healthy_time=first,
        false_alarms=sum(alarm.at < first for alarm in strange),
        unannounced=unannounced,
        showed=showed,
        found=found,
        right_kind=right,
        wrong_joint=sum(alarm.at >= first for alarm in strange),
        delay=delay,
        found_as=said,
    )
