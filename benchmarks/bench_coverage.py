"""What it costs to verify a motion: all failures of a Panda's line and of the example of Zhang et al. 2016.

    python benchmarks/bench_coverage.py          seconds of one core, compilation apart
    python benchmarks/bench_coverage.py --json   one JSON object on stdout, nothing else

Times are those of the process, not of the clock, so that other work disturbs them less.
"""

import argparse
import sys
from time import process_time

import numpy as np
from bench import command_line, docs
from bench.results import circumstances
from bench.tables import Table, quantity

import ftqp

SAMPLES = 400
USUAL = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
LIMITATIONS = (
    "A motion that survives more takes longer: every failure that is survived is followed to the end.",
)


def motions() -> dict[str, tuple[ftqp.Robot, ftqp.analysis.TaskPath, np.ndarray]]:
    """Motions of 400 samples by name, each with its arm and its path."""
    panda, zhang = ftqp.robots.load("panda"), ftqp.robots.load("zhang7")
    start = np.diag([1.0, -1.0, -1.0, 1.0])
    start[:3, 3] = 0.45, -0.2, 0.35
    line = ftqp.paths.Line(start, (0.0, 0.4, 0.0), duration=6.0)
    short = ftqp.paths.Line(zhang.pose(zhang.neutral), (1.3, 1.7, -1.0), duration=20.0)
    found = {}
    for name, robot, path, q0, theta in (
        ("panda, line along y", panda, line, USUAL, 0.6),
        ("zhang7, line", zhang, short, zhang.neutral, 0.0),
    ):
        task = ftqp.analysis.task_path(robot, path, dt=path.duration / SAMPLES)
        found[name] = robot, task, ftqp.analysis.track(task, q0, theta)
    return found


def main() -> int:
    """Measure, print, write; 0 when done, 2 for bad input."""
    options = _options()
    rows = []
    for name, (robot, task, q) in motions().items():
        for post in ("exact", "qp"):
            taken = []
            for _ in range(options.rounds + 1):
                began = process_time()
                report = ftqp.analysis.coverage(robot, task, q, stride=options.stride, post=post, threads=1)
                taken.append(process_time() - began)
            rows.append(
                {
                    "motion": name,
                    "post": post,
                    "pairs": int(report.status.size),
                    "coverage": report.coverage,
                    "seconds": float(np.median(taken[1:])),
                }
            )
    result = {
        **circumstances("bench_coverage", [], {"rounds": options.rounds, "stride": options.stride}),
        "rows": rows,
        "left_out": {},
        "limitations": list(LIMITATIONS),
    }
    headings = ("motion of 400 samples", "how the others go on", "failures", "coverage", "seconds")
    lines = [
        (row["motion"], row["post"], str(row["pairs"]), f"{row['coverage']:.4f}", quantity(row["seconds"]))
        for row in rows
    ]
    table = Table(title="All failures of a motion, one core", headings=headings, rows=lines)
    docs.told(result, "Coverage", [table], options)
    return 0


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    parser.add_argument(
        "--rounds", type=command_line.at_least_one, default=5, metavar="N", help="times each (default 5)"
    )
    parser.add_argument(
        "--stride", type=command_line.at_least_one, default=4, metavar="N", help="samples apart (default 4)"
    )
    docs.options(parser)
    options: argparse.Namespace = parser.parse_args()
    return options


if __name__ == "__main__":
    sys.exit(main())
