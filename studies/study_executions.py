"""Plans executed: how many of the same random locks does each way of using the joint to spare survive?

    python studies/study_executions.py              1,000 locks of each scenario and motion, some 20 min
    python studies/study_executions.py --cases 50   a look
    python studies/study_executions.py --keep DIR   keep rows and plans; the same command goes on from there

Each bundled scenario of this kind is run with four motions: its own, which takes the least joint speeds, and
its plans by the methods `constant`, `spline` and `dp`, all with free starts. Random joints lock at random
samples, at once, and the planner is told; all motions get the same locks. The planner is run in closed loop
from the begin to the end of the path, on an arm that does what it is told. A run survives when the tip stays
within 2 mm and 0.02 rad of the path from 0.3 s after the lock on; counts from 1 s on stand beside it, because
a lock of a joint that moves pushes the tip away, and the planner takes its time to bring it back.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from bench import command_line, docs
from bench.results import circumstances
from bench.tables import Table
from study_coverage import OWN, SCENARIOS, TOLERANCE, Subject

import ftqp
from ftqp.app.run.healthy_motion import task_of
from ftqp.app.scenario.setup import load
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.runner import run_study
from ftqp.kernel.layout.survival import SURVIVED, Survival

METHODS = ("constant", "spline", "dp")
MOTIONS = (OWN, *METHODS)
SETTLED = (0.3, 1.0)
"""The error counts from so long after the lock [s]."""
COLUMNS = {
    "scenario": "TEXT", "motion": "TEXT", "joint": "INTEGER", "at": "REAL", "predicted": "TEXT",
    "error": "REAL", "turned": "REAL", "error_later": "REAL", "turned_later": "REAL", "ended": "TEXT",
}  # fmt: skip
LIMITATIONS = (
    "The arm does exactly what it is told; MuJoCo's arm is in study_coverage.md.",
    "Plans are made with the defaults of `ftqp plan` and free starts; the own motion starts as its scenario.",
)


@dataclass(frozen=True)
class Executions:
    """Runs the cases of the study.

    Attributes:
        seed: Of the locks.
        cases: Of each subject.
        subjects: What is looked at, all motions of a scenario one after the other.
    """

    seed: int
    cases: int
    subjects: tuple[Subject, ...]

    def __call__(self, items: Sequence[int]) -> list[tuple[Any, ...]]:
        """The rows of some cases."""
        return [self._case(*divmod(item, self.cases)) for item in items]

    def _case(self, which: int, case: int) -> tuple[Any, ...]:
        """A row; the same case of each motion is the same lock."""
        subject = self.subjects[which]
        random = np.random.default_rng([self.seed, SCENARIOS.index(subject.scenario), case])
        setup, task, q, study = subject.made
        joint, k = int(random.integers(task.robot.nv)), int(random.integers(1, task.N))
        told = study.runs(q[k][None], [k], np.array([joint]), bounded=setup.robot.nv - 1 > task.m)
        (soon, late), ended = subject.ridden(joint, float(task.t[k]), SETTLED)
        return (
            subject.scenario, subject.motion, joint, float(task.t[k]), Survival(told.status[0]).name,
            *soon, *late, ended,
        )  # fmt: skip


def summed_up(rows: Sequence[Sequence[Any]]) -> list[dict[str, Any]]:
    """What each motion of each scenario survives, as predicted and as run."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in rows:
        one = dict(zip(["item", *COLUMNS], row, strict=True))
        groups.setdefault((one["scenario"], one["motion"]), []).append(one)
    near, turned = TOLERANCE["kinematic"]
    return [
        {
            "scenario": scenario, "motion": motion, "cases": len(some),
            "predicted": sum(row["predicted"] == Survival(SURVIVED).name for row in some),
            "ran": sum(row["error"] <= near and row["turned"] <= turned for row in some),
            "ran_later": sum(row["error_later"] <= near and row["turned_later"] <= turned for row in some),
            "stopped": sum(row["ended"] == "stopped" for row in some),
        }
        for (scenario, motion), some in groups.items()
    ]  # fmt: skip


def main() -> int:
    """Run, print, write; 0 when done, 2 for bad input."""
    options = _options()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) if options.keep is None else Path(options.keep)
        folder.mkdir(parents=True, exist_ok=True)
        subjects = tuple(
            Subject(scenario, motion, "kinematic", folder) for scenario in SCENARIOS for motion in MOTIONS
        )
        for subject in subjects:
            _plan(subject)
        key = f"{options.seed} {options.cases} {ftqp.__version__}"
        with ResultsFile(folder, kind="plans executed", key=key, columns=COLUMNS) as results:
            work = Executions(options.seed, options.cases, subjects)
            run_study(work, options.cases * len(subjects), results, what="locks", jobs=options.jobs)
            found = summed_up(results.table())
    result = {
        **circumstances("study_executions", [], {"cases": options.cases, "seed": options.seed}),
        "groups": found,
        "left_out": {},
        "limitations": list(LIMITATIONS),
    }
    docs.told(result, "Plans executed", [_table(found)], options)
    return 0


def _plan(subject: Subject) -> None:
    """The plan of a motion, made where it is not there."""
    if subject.motion in METHODS and not subject.file.exists():
        setup = load(subject.scenario, ["faults="])
        ftqp.analysis.plan(setup.robot, task_of(setup), method=subject.motion).save(subject.file)


def _table(found: Sequence[dict[str, Any]]) -> Table:
    return Table(
        title="Of the same random locks so many are survived",
        headings=(
            "scenario", "motion", "locks", "predicted", "run, from 0.3 s", "run, from 1 s", "planner stopped"
        ),
        rows=[
            (
                row["scenario"], row["motion"], *(str(row[name]) for name in
                ("cases", "predicted", "ran", "ran_later", "stopped")),
            )
            for row in found
        ],
    )  # fmt: skip


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    parser.add_argument(
        "--cases", type=command_line.at_least_one, default=1000, metavar="N", help="locks each (default 1000)"
    )
    parser.add_argument("--seed", type=int, default=2016, metavar="K", help="of the locks (default 2016)")
    parser.add_argument(
        "--jobs", type=command_line.at_least_one, default=1, metavar="N", help="processes (default 1)"
    )
    parser.add_argument(
        "--keep", metavar="DIR", help="folder in which rows and plans are kept, to go on with"
    )
    docs.options(parser)
    options: argparse.Namespace = parser.parse_args()
    return options


if __name__ == "__main__":
    sys.exit(main())
