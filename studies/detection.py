"""What a detector finds of failures that nobody announces, how soon, and how often it is wrong.

    python studies/detection.py --jobs 2           1,000 cases of every kind, drive and setting, 30 h healthy
    python studies/detection.py --quick --robots panda --drives torque

Arms in MuJoCo (2 kHz, planner at 1 kHz, encoder noise 1e-4 rad, torque noise 0.3 N m) follow circles, lines
and via points; `nominal` has nothing else, `real` half a kilogram, friction and 2 ms of delay that nobody
knows of, `quantised` encoders with steps of 1e-4 rad in place of noise. One joint fails at a random instant;
the planner is never told. What the detector says first counts. Thresholds come from healthy motion of other
seeds. Cases and hours that ``--file`` has already are not run again; a detector whose source has changed, or
another seed, begins anew beside them.
"""

import json
import pickle
import sqlite3
import sys
import time
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

from alarms import detection_report, detection_scores
from alarms.detection_work import (
    CALIBRATION,
    CASES,
    EACH,
    HEALTHY,
    calibration,
    fingerprint,
    numbered_block,
)
from alarms.detection_world import CONFIGURATIONS, DRIVES, DT, ROBOTS, SETTINGS, Configuration
from bench import command_line, results
from joblib import Parallel, delayed

DOCS = Path(__file__).resolve().parents[1] / "docs" / "evidence" / "detection.md"
Block = tuple[int, Configuration, int]
"""A part of the study, which arm, and the block's number."""
LIMITATIONS = (
    "Motions and faults are drawn evenly from ranges of our own, not from records of real arms.",
    "Motions that the healthy arm cannot follow with every step OK, no motor above 90 %, are drawn anew.",
    "Two cases of a kind come from one motion, and all kinds share motions and noise.",
    "Faults of the torque are drawn where they take 1 rad/s2 or more from their joint at that instant.",
    "The iiwa14 has stated rotor inertias of 0.1 kg m2, of which the catalog knows none.",
)


class Kept:
    """The results so far, in a file."""

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
    """The blocks that are still to be run, all configurations in turn, healthy motion between the cases."""
    have = {(part, c): set(store.of(part, c)) for part in (CASES, HEALTHY) for c in chosen}
    blocks, wanted = -(-given.cases // EACH), given.hours * 3600.0 / DT
    number, more = 0, given.hours > 0.0
    while number < blocks or more:
        for c in chosen:
            if number < blocks and number not in have[CASES, c]:
                yield CASES, c, number
            if more and number not in have[HEALTHY, c]:
                yield HEALTHY, c, number
        number += 1
        more = sum(watched.values()) < wanted or any(number in have[HEALTHY, c] for c in chosen)


def run(given: Any, chosen: list[Configuration], store: Kept) -> None:
    """Run what is missing, until it is done or the time is over."""
    began = time.monotonic()
    with Parallel(n_jobs=given.jobs, return_as="generator_unordered") as parallel:
        without = [c for c in chosen if not store.of(CALIBRATION, c)]
        for c, known in parallel(
            delayed(calibration)(c, given.seed, given.calibration, given.keep) for c in without
        ):
            store.put(CALIBRATION, c, 0, pickle.dumps(known))
        stored = {c: store.of(CALIBRATION, c)[0] for c in chosen}

        watched = {
            c: sum(watched_ticks(json.loads(rows)) for rows in store.of(HEALTHY, c).values()) for c in chosen
        }

        def work() -> Iterator[Any]:
            for part, c, number in missing(store, chosen, given, watched):
                if given.minutes is not None and time.monotonic() - began > 60.0 * given.minutes:
                    return
                yield delayed(numbered_block)(part, c, given.seed, number, stored[c], given.keep)

        for done, (part, c, number, rows) in enumerate(parallel(work())):
            store.put(part, c, number, json.dumps(rows))
            watched[c] += watched_ticks(rows) if part == HEALTHY else 0
            if sys.stderr.isatty() and done % 10 == 0:
                sys.stderr.write(f"\r{done} blocks, {time.monotonic() - began:.0f} s ")


def watched_ticks(rows: list[Any]) -> int:
    """Ticks of a tour in which the detector was watched."""
    return int(rows[0][1]["ticks"])


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
    results.add_out(parser, "detection")
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
        "limitations": list(LIMITATIONS),
    }
    result["versions"]["mujoco"] = version("mujoco")
    name = results.stem("detection", name=given.name, quick=given.quick)
    if given.update_docs:
        report = f"../../studies/results/{name}.md"
        text = DOCS.read_text(encoding="utf-8")
        lines = detection_report.for_docs(result, report)
        DOCS.write_text(results.inserted(text, "detection", lines), encoding="utf-8")
    return results.told(result, detection_report.markdown(result), given.out, name, as_json=given.json)


if __name__ == "__main__":
    sys.exit(main())
