"""Locks that nobody announces, in closed loop: how many end as well as if they had been announced.

    python studies/study_detected_locks.py             1,000 random locks, in physics
    python studies/study_detected_locks.py --cases 40  a look
    python studies/study_detected_locks.py --keep DIR  rows go to DIR; the same command goes on where it was

Each case is an arm of the catalog in MuJoCo, behind position servos, velocity drives or motors that take
torques, with encoders of 1e-4 rad noise, on a circle or a line; the brake of a random joint closes at a
random time. It is run three times: the planner is told at once; has a detector and is never told; is never
told and has none. It ends well when the path is finished, the planner's last word is OK, and the true tip was
within 25 mm of its path for all of the last tenth.
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
from scipy.stats import binomtest

import ftqp
from ftqp.app.study.results_file import ResultsFile
from ftqp.app.study.runner import run_study

DT, SIGMA, DURATION, NEAR = 1e-3, 1e-4, 2.4, 25.0
ROBOTS, DRIVES = ("panda", "iiwa14"), ("position", "velocity", "torque")
WAYS = ("told", "detector", "never")
COLUMNS = {
    "robot": "TEXT", "drive": "TEXT", "joint": "INTEGER", "at": "REAL",
    **{f"{way}_{name}": kind for way in WAYS for name, kind in (("well", "INTEGER"), ("worst", "REAL"))},
    "found_after": "REAL", "found_as": "TEXT", "false": "INTEGER",
}  # fmt: skip
BANDWIDTH = 2.0 * np.pi * 15.0
LIMITATIONS = (
    "The planner's model of the arm is exact; thresholds are not calibrated, they follow from the noise.",
    "A circle or a line may be out of reach after a lock; such cases end badly however they are told.",
)


@dataclass(frozen=True)
class Locks:
    """Runs the cases of a study.

    Attributes:
        seed: Of all cases.
    """

    seed: int

    def __call__(self, items: Sequence[int]) -> list[tuple[Any, ...]]:
        """The rows of some cases."""
        return [self._case(item) for item in items]

    def _case(self, item: int) -> tuple[Any, ...]:
        random = np.random.default_rng([self.seed, item])
        name, taken = str(random.choice(ROBOTS)), str(random.choice(DRIVES))
        robot = ftqp.robots.load(name)
        q = robot.neutral + 0.15 * random.standard_normal(robot.nv)
        q = np.clip(q, robot.limits.q_min + 0.2, robot.limits.q_max - 0.2)
        if random.random() < 0.5:
            axes = [("x", "y"), ("y", "z"), ("x", "z")][random.integers(3)]
            path: Any = ftqp.paths.Circle(
                robot.pose(q), random.uniform(0.03, 0.08), duration=DURATION, axes=axes
            )
        else:
            way = random.standard_normal(3)
            way *= random.uniform(0.08, 0.18) / np.linalg.norm(way)
            path = ftqp.paths.Line(robot.pose(q), way, duration=DURATION)
        joint, at = int(random.integers(robot.nv)), float(random.uniform(0.3, 0.7) * DURATION)
        row: list[Any] = []
        found: Any = (None, None, 0)
        for way in WAYS:
            well, worst, planner = _ridden(robot, taken, path, q, joint, at, way, seed=item)
            row += [int(well), worst]
            if way == "detector":
                found = _found(planner, robot.joints[joint], at)
        return (name, taken, joint, at, *row, *found)


def _ridden(
    robot: Any, taken: str, path: Any, q: Any, joint: int, at: float, way: str, *, seed: int
) -> tuple[bool, float, Any]:
    """Whether a run ends well, the largest true error of the tip after the lock [mm], and its planner."""
    servos = taken != "torque"
    planner = ftqp.Planner(
        robot,
        DT,
        drive=ftqp.Drive(kind=taken, bandwidth=BANDWIDTH) if servos else "torque",
        task=ftqp.Task(rows="position"),
        noise=ftqp.Noise(q=SIGMA),
        detector=ftqp.Detector() if way == "detector" else None,
    )
    servo = ftqp.JointServo(robot, taken, bandwidth=BANDWIDTH) if servos else ftqp.JointServo(robot, taken)
    told = None if way == "told" else "never"
    simulation = ftqp.Simulation(
        planner,
        path,
        q=q,
        plant=ftqp.MujocoPlant(robot, DT, servo),
        sensors=ftqp.JointSensors(robot, DT, position_noise=SIGMA, seed=seed),
        schedule=ftqp.Schedule([ftqp.FaultEvent(ftqp.Locked(robot.joints[joint]), at, told)]),
        log="memory",
    )
    result = simulation.run()
    log = result.log
    every = np.arange(0, len(log["t"]), 5)
    poses = path.sample(log["t"][every]).pose[:, :3, 3]
    error = np.array(
        [np.linalg.norm(robot.pose(log["q"][k])[:3, 3] - p) for k, p in zip(every, poses, strict=True)]
    )
    after = 1e3 * error[log["t"][every] >= at]
    last = after[-len(every) // 10 :]
    well = result.completed and result.final_status is ftqp.StepStatus.OK and bool((last < NEAR).all())
    return well, float(after.max()), planner


def _found(planner: Any, joint: str, at: float) -> tuple[float | None, str | None, int]:
    """How long after the lock it was found [ms], as what, and how many findings were wrong."""
    right = [one for one in planner.findings if one.joint == joint and one.detected_at >= at]
    wrong = len(planner.findings) - len(right[:1])
    if not right:
        return None, None, wrong
    return 1e3 * (right[0].detected_at - at), " or ".join(sorted(right[0].kinds)), wrong


def _summary(rows: Sequence[Sequence[Any]]) -> dict[str, Any]:
    """Shares with their intervals, delays and distances."""
    names = ["item", *COLUMNS]
    table = [dict(zip(names, row, strict=True)) for row in rows]
    found: dict[str, Any] = {"cases": len(table), "drives": []}
    for taken in (*DRIVES, "all"):
        some = [row for row in table if taken in (row["drive"], "all")]
        good = [row for row in some if row["told_well"]]
        kept = sum(row["detector_well"] for row in good)
        alone = sum(row["never_well"] for row in good)
        if not good:
            continue
        interval = binomtest(kept, len(good)).proportion_ci(0.95)
        delays = [row["found_after"] for row in some if row["found_after"] is not None]
        found["drives"].append(
            {
                "drive": taken,
                "cases": len(some),
                "told_well": len(good),
                "detector_well": kept,
                "never_well": alone,
                "share": kept / len(good),
                "interval": [float(interval.low), float(interval.high)],
                "found": len(delays),
                "delay_ms": _spread(delays),
                "wrong_findings": sum(row["false"] for row in some),
                "worst_told_mm": _spread([row["told_worst"] for row in good]),
                "worst_detector_mm": _spread([row["detector_worst"] for row in good]),
                "worst_never_mm": _spread([row["never_worst"] for row in good]),
            }
        )
    return found


def _spread(values: Sequence[float]) -> list[float] | None:
    """Median, 95th percentile and maximum."""
    return [float(np.percentile(values, p)) for p in (50.0, 95.0, 100.0)] if len(values) else None


def main() -> int:
    """Run, print, write; 0 when done, 2 for bad input."""
    options = _options()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) if options.keep is None else Path(options.keep)
        key = f"{options.seed} {ftqp.__version__} {DURATION}"
        with ResultsFile(folder, kind="detected locks", key=key, columns=COLUMNS) as results:
            run_study(Locks(options.seed), options.cases, results, what="detected locks", jobs=1)
            found = _summary(results.table())
    result = {
        **circumstances("study_detected_locks", [], {"cases": options.cases, "seed": options.seed}),
        **found,
        "left_out": {},
        "limitations": list(LIMITATIONS),
    }
    ends = [
        (
            row["drive"], str(row["cases"]), str(row["told_well"]), str(row["detector_well"]),
            f"{100 * row['share']:.1f} ({100 * row['interval'][0]:.1f} to {100 * row['interval'][1]:.1f})",
            str(row["never_well"]), str(row["wrong_findings"]),
        )
        for row in found["drives"]
    ]  # fmt: skip
    spreads = [
        (
            row["drive"],
            *(
                _told(row[name])
                for name in ("delay_ms", "worst_told_mm", "worst_detector_mm", "worst_never_mm")
            ),
        )
        for row in found["drives"]
    ]
    tables = [
        Table(
            title="Locks that end well",
            headings=(
                "drive",
                "cases",
                "told",
                "of these found out",
                "percent (95 %)",
                "never told",
                "wrong findings",
            ),
            rows=ends,
        ),
        Table(
            title="Median, 95 % and largest",
            headings=(
                "drive",
                "delay [ms]",
                "tip off its path, told [mm]",
                "found out [mm]",
                "never told [mm]",
            ),
            rows=spreads,
        ),
    ]
    docs.told(result, "Locks that nobody announces, in closed loop", tables, options)
    return 0


def _told(spread: Sequence[float] | None) -> str:
    return "-" if spread is None else ", ".join(f"{value:.3g}" for value in spread)


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    parser.add_argument(
        "--cases",
        type=command_line.at_least_one,
        default=1000,
        metavar="N",
        help="random locks (default 1000)",
    )
    parser.add_argument("--seed", type=int, default=11, metavar="K", help="of all cases (default 11)")
    parser.add_argument("--keep", metavar="DIR", help="folder in which rows are kept, to go on with")
    docs.options(parser)
    options: argparse.Namespace = parser.parse_args()
    return options


if __name__ == "__main__":
    sys.exit(main())
