"""What a detector finds of failures that nobody announces, how soon, and how often it is wrong.

    python solvers/detection.py --jobs 2           1,000 cases of every kind, drive and setting, 30 h healthy
    python solvers/detection.py --quick --robots panda --drives torque

Arms in MuJoCo (2 kHz, planner at 1 kHz, encoder noise 1e-4 rad, torque noise 0.3 N m) follow circles, lines
and via points; `nominal` has nothing else, `real` half a kilogram, friction and 2 ms of delay that nobody
knows of, `quantised` encoders with steps of 1e-4 rad in place of noise. One joint fails at a random instant;
the planner is never told. What the detector says first counts. Thresholds come from healthy motion of other
seeds. Cases and hours that ``--file`` has already are not run again; a detector whose source has changed, or
another seed, begins anew beside them.
"""

import hashlib
import json
import logging
import pickle
import sqlite3
import sys
import time
from collections.abc import Iterator
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bench import command_line, detection_report, detection_scores, results
from bench.detection_cases import KINDS, motion, tour
from bench.detection_files import kept
from bench.detection_world import CONFIGURATIONS, DRIVES, DT, ROBOTS, SETTINGS, Configuration, Record, arm
from joblib import Parallel, delayed

import ftqp

DOCS = Path(__file__).resolve().parents[1] / "docs" / "detection.md"
EACH = 2
"""Cases of a kind from one motion."""
RATE = 0.1
"""False alarms an hour that the detector is calibrated for."""
CALIBRATION, CASES, HEALTHY = range(3)
"""Seeds of the parts of the study begin differently."""
Block = tuple[int, Configuration, int]
"""A part of the study, which arm, and the block's number."""
SOURCES = ("faults/detection", "kernel/detection")
OWN_SOURCES = ("detection_world.py", "detection_cases.py", "detection_scores.py")
LIMITATIONS = (
    "Motions and faults are drawn evenly from ranges of our own, not from records of real arms.",
    "Motions that the healthy arm cannot follow with every step OK, no motor above 90 %, are drawn anew.",
    "Two cases of a kind come from one motion, and all kinds share motions and noise.",
    "Faults of the torque are drawn where they take 1 rad/s2 or more from their joint at that instant.",
    "The iiwa14 has stated rotor inertias of 0.1 kg m2, of which the catalog knows none.",
)


def fingerprint() -> str:
    """A hash of the source of detector and study: results of another one are no results of this one."""
    there, total = Path(ftqp.__file__).parent, hashlib.sha256()
    files = [file for folder in SOURCES for file in sorted((there / folder).glob("*.py"))]
    files += [Path(__file__).parent / "bench" / name for name in OWN_SOURCES]
    for file in files:
        total.update(file.read_bytes())
    return total.hexdigest()[:16]


def motion_log(record: Record, given: str, servo: bool) -> Any:
    """A record as a detector is calibrated on it."""
    effort = None
    if given != "encoders" or not servo:
        effort = record.demand if servo else record.tau_c
    tau = record.tau if given.endswith("torques") else None
    return ftqp.MotionLog(
        q=record.q, q_ref=record.q_r, v_ref=record.v_r, a_ref=record.a_r, tau=tau, effort=effort
    )


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
        make = partial(tour, configuration, begins, other=False)
        records.append(kept(folder, begins, make))
        ticks, number = ticks + len(records[-1].codes), number + 1
    found = {}
    for given in detection_scores.inputs(configuration):
        logs = [motion_log(record, given, configuration.has_servo) for record in records]
        found[given] = detector(configuration).calibrate(logs, RATE, extrapolate=True).calibration
    return found


@cache
def _detectors(configuration: Configuration, stored: bytes) -> dict[str, Any]:
    """The detectors of a configuration in this process."""
    known = pickle.loads(stored)  # our own file
    return {given: detector(configuration, calibration) for given, calibration in known.items()}


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
    record = kept(folder, begins, lambda: tour(configuration, begins, other=True))
    for given, one in known.items():
        rows.append([given, detection_scores.alarms(one, record, given, configuration)])
    return rows


class Kept:
    """The results so far, in a file.

    Args:
        file: where.
        study: what the results belong to.
    """

    def __init__(self, file: Path, study: str) -> None:
        file.parent.mkdir(parents=True, exist_ok=True)
        self._connection = sqlite3.connect(file)
        self._study = study
        self._connection.execute(
            "CREATE TABLE IF NOT EXISTS blocks (study TEXT, part INTEGER, configuration TEXT, "
            "number INTEGER, outcome BLOB, PRIMARY KEY (study, part, configuration, number))"
        )

    def of(self, part: int, configuration: Configuration) -> dict[int, Any]:
        """The outcomes of a part, by number."""
        return dict(
            self._connection.execute(
                "SELECT number, outcome FROM blocks WHERE study = ? AND part = ? AND configuration = ?",
                (self._study, part, str(configuration)),
            )
        )

    def put(self, part: int, configuration: Configuration, number: int, outcome: Any) -> None:
        """Keep an outcome."""
        row = (self._study, part, str(configuration), number, outcome)
        self._connection.execute("INSERT OR IGNORE INTO blocks VALUES (?, ?, ?, ?, ?)", row)
        self._connection.commit()


def missing(
    store: Kept, chosen: list[Configuration], given: Any, watched: dict[Configuration, int]
) -> Iterator[Block]:
    """The blocks that are still to be run, all configurations in turn, healthy motion between the cases.

    Args:
        store: the results so far.
        chosen: the configurations.
        given: how many cases and hours are wanted.
        watched: ticks of healthy motion of each configuration; it grows while blocks are run.
    """
    have = {(part, c): set(store.of(part, c)) for part in (CASES, HEALTHY) for c in chosen}
    blocks, share = -(-given.cases // EACH), given.hours * 3600.0 / DT / len(chosen)
    number, left = 0, True
    while left:
        left = number + 1 < blocks
        for c in chosen:
            if number < blocks and number not in have[CASES, c]:
                yield CASES, c, number
            if watched[c] < share:
                left = True
                if number not in have[HEALTHY, c]:
                    yield HEALTHY, c, number
        number += 1


def run(given: Any, chosen: list[Configuration], store: Kept) -> None:
    """Run what is missing, until it is done or the time is over."""
    began = time.monotonic()
    with Parallel(n_jobs=given.jobs, return_as="generator_unordered") as parallel:
        without = [c for c in chosen if not store.of(CALIBRATION, c)]
        for c, known in parallel(
            delayed(_calibration)(c, given.seed, given.calibration, given.keep) for c in without
        ):
            store.put(CALIBRATION, c, 0, pickle.dumps(known))
        stored = {c: store.of(CALIBRATION, c)[0] for c in chosen}

        watched = {
            c: sum(_watched(json.loads(rows)) for rows in store.of(HEALTHY, c).values()) for c in chosen
        }

        def work() -> Iterator[Any]:
            for part, c, number in missing(store, chosen, given, watched):
                if given.minutes is not None and time.monotonic() - began > 60.0 * given.minutes:
                    return
                yield delayed(_block)(part, c, given.seed, number, stored[c], given.keep)

        for done, (part, c, number, rows) in enumerate(parallel(work())):
            store.put(part, c, number, json.dumps(rows))
            watched[c] += _watched(rows) if part == HEALTHY else 0
            if sys.stderr.isatty() and done % 10 == 0:
                sys.stderr.write(f"\r{done} blocks, {time.monotonic() - began:.0f} s ")


def _watched(rows: list[Any]) -> int:
    """Ticks of a tour in which the detector was watched."""
    return int(rows[0][1]["ticks"])


def _calibration(
    configuration: Configuration, seed: int, hours: float, folder: Path | None
) -> tuple[Configuration, Any]:
    return configuration, calibrated(configuration, seed, hours, folder)


def _block(
    part: int, configuration: Configuration, seed: int, number: int, stored: bytes, folder: Path | None
) -> tuple[int, Configuration, int, list[Any]]:
    return part, configuration, number, block(part, configuration, seed, number, stored, folder)


def gathered(store: Kept, chosen: list[Configuration]) -> list[dict[str, Any]]:
    """Everything that the report tells, by configuration and by what the detector looked at."""
    found = []
    for c in chosen:
        scored = [json.loads(outcome) for _, outcome in sorted(store.of(CASES, c).items())]
        watched = [json.loads(outcome) for _, outcome in sorted(store.of(HEALTHY, c).items())]
        for given in detection_scores.inputs(c):
            rows = [row for rows in scored for looked, row in rows if looked == given]
            tours = [row for rows in watched for looked, row in rows if looked == given]
            found.append(detection_report.summary(c, given, rows, tours))
    return found


def main() -> int:
    """Runs what is missing, prints and writes the report; 0 when done, 2 for bad input."""
    parser = command_line.parser(__doc__)
    parser.add_argument("--robots", nargs="+", choices=ROBOTS, default=list(ROBOTS))
    parser.add_argument("--drives", nargs="+", choices=list(DRIVES), default=list(DRIVES))
    parser.add_argument("--settings", nargs="+", choices=SETTINGS, default=list(SETTINGS))
    parser.add_argument("--cases", type=int, default=1000, help="of every kind, drive and setting")
    parser.add_argument("--hours", type=float, default=30.0, help="of healthy motion, all in all")
    parser.add_argument("--calibration", type=float, default=0.1, help="hours a configuration")
    parser.add_argument("--minutes", type=float, help="begin nothing new after so long")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="how many processes run them")
    parser.add_argument("--quick", action="store_true", help="8 cases, some minutes of healthy motion")
    parser.add_argument("--name", help="the report is called detection-NAME")
    parser.add_argument("--file", type=Path, default=Path("runs/detection.sqlite"), help="of results so far")
    parser.add_argument("--keep", type=Path, help="folder of simulated motions, 5 MB each, to be seen again")
    parser.add_argument("--out", type=Path, default=results.RESULTS, help="folder of the report")
    parser.add_argument("--update-docs", action="store_true", help="put the short tables into the docs")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    given = parser.parse_args()
    if given.quick:
        given.cases, given.hours, given.calibration = 8, 0.05, 0.02
    if given.cases < 0 or given.hours < 0.0 or given.calibration <= 0.0:
        sys.stderr.write("cases and hours must be 0 or more, and calibration more than 0\n")
        return 2
    chosen = [
        c
        for c in CONFIGURATIONS
        if c.robot in given.robots and c.drive in given.drives and c.setting in given.settings
    ]
    study = json.dumps([given.seed, given.calibration, fingerprint()])
    try:
        store = Kept(given.file, study)
    except (OSError, sqlite3.Error) as error:
        sys.stderr.write(f"{given.file} cannot keep results: {error}; give another --file\n")
        return 2
    try:
        run(given, chosen, store)
    except KeyboardInterrupt:
        sys.stderr.write(f"interrupted; {given.file} has what was done, the same command goes on\n")
        return 130
    settings = {"seed": given.seed, "calibration": given.calibration, "detector": fingerprint()}
    result = results.circumstances("detection", (), settings) | {
        "rows": gathered(store, chosen),
        "left_out": {},
        "limitations": list(LIMITATIONS),
    }
    result["versions"]["mujoco"] = version("mujoco")
    name = results.stem("detection", name=given.name, quick=given.quick)
    if given.update_docs:
        report = f"../solvers/results/{name}.md"
        text = DOCS.read_text(encoding="utf-8")
        lines = detection_report.for_docs(result, report)
        DOCS.write_text(results.inserted(text, "detection", lines), encoding="utf-8")
    return results.told(result, detection_report.markdown(result), given.out, name, as_json=given.json)


if __name__ == "__main__":
    sys.exit(main())
