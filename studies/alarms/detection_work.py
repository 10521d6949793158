"""The parts of the study of detection that processes share: calibrations, cases, healthy tours."""

import hashlib
import logging
import pickle
from functools import cache, partial
from pathlib import Path
from typing import Any

from alarms import detection_scores
from alarms.detection_cases import CARRIED, KINDS, OTHER, motion, tour
from alarms.detection_files import kept
from alarms.detection_world import CONFIGURATIONS, DT, Configuration, arm

import ftqp

EACH = 2
"""Cases of a kind from one motion."""
RATE = 0.1
"""False alarms an hour that the detector is calibrated for."""
CALIBRATION, CASES, HEALTHY = range(3)
"""Seeds of the parts of the study begin differently."""
SOURCES = ("faults/detection", "kernel/detection")
OWN_SOURCES = ("detection_world.py", "detection_cases.py", "detection_scores.py")


def fingerprint() -> str:
    """A hash of the source of detector and study: results of another one are no results of this one."""
    there, total = Path(ftqp.__file__).parent, hashlib.sha256()
    files = [file for folder in SOURCES for file in sorted((there / folder).glob("*.py"))]
    files += [Path(__file__).parent / name for name in OWN_SOURCES]
    for file in files:
        total.update(file.read_bytes())
    return total.hexdigest()[:16]


def detector(configuration: Configuration, calibration: Any = None) -> Any:
    """A detector of that arm, as its user makes it."""
    drive = configuration.made_drive()
    return ftqp.Detector(
        robot=arm(configuration.robot),
        dt=DT,
        drive=drive.kind,
        noise=configuration.noise(),
        quantum=configuration.quantum,
        delay=drive.latency,
        false_alarms_per_hour=RATE,
        calibration=calibration,
    )


def calibrated(configuration: Configuration, seed: int, hours: float, folder: Path | None) -> dict[str, Any]:
    """What is known of healthy motion, by what the detector may look at."""
    logging.getLogger("ftqp").setLevel(logging.ERROR)
    ticks, number, records = 0, 0, []
    while ticks < hours * 3600.0 / DT:
        index = CONFIGURATIONS.index(configuration)
        begins = [seed, CALIBRATION, index, number]
        make = partial(tour, configuration, begins, [CARRIED[number % len(CARRIED)]])
        records.append(kept(folder, begins, make))
        ticks, number = ticks + len(records[-1].codes), number + 1
    found = {}
    for given in detection_scores.inputs(configuration):
        logs = [detection_scores.motion_log(record, given, configuration) for record in records]
        found[given] = detector(configuration).calibrate(logs, RATE, extrapolate=True).calibration
    return found


@cache
def _detectors(configuration: Configuration, stored: bytes) -> dict[str, Any]:
    """The detectors of a configuration in this process."""
    known = pickle.loads(stored)  # our own file
    return {
        given: detection_scores.Watcher(detector(configuration, calibration))
        for given, calibration in known.items()
    }


def block(
    part: int, configuration: Configuration, seed: int, number: int, stored: bytes, folder: Path | None
) -> list[Any]:
    """A block of cases or a tour of healthy motion: its rows, each with what the detector looked at."""
    logging.getLogger("ftqp").setLevel(logging.ERROR)
    begins = [seed, part, CONFIGURATIONS.index(configuration), number]
    known, rows = _detectors(configuration, stored), []
    if part == CASES:
        made = kept(folder, begins, lambda: motion(configuration, begins, KINDS, EACH))
        for given, one in known.items():
            rows += [[given, row] for row in detection_scores.judged(one, made, given, configuration)]
        return rows
    record = kept(folder, begins, lambda: tour(configuration, begins, OTHER))
    for given, one in known.items():
        rows.append([given, detection_scores.alarms(one, record, given, configuration)])
    return rows


def calibration(
    configuration: Configuration, seed: int, hours: float, folder: Path | None
) -> tuple[Configuration, Any]:
    """The same, with whose it is."""
    return configuration, calibrated(configuration, seed, hours, folder)


def numbered_block(
    part: int, configuration: Configuration, seed: int, number: int, stored: bytes, folder: Path | None
) -> tuple[int, Configuration, int, list[Any]]:
    """The same, with which it is."""
    return part, configuration, number, block(part, configuration, seed, number, stored, folder)
