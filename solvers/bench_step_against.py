"""The whole user step of this checkout against that of an earlier commit, in the same run.

    python solvers/bench_step_against.py                   against the first release
    python solvers/bench_step_against.py --against HEAD~1  against another commit
    python solvers/bench_step_against.py --json            one JSON object on stdout, nothing else

A Panda and a 30-joint chain go round a circle in closed loop at both levels, called in three ways: ``best``
hands the planner's own arrays back and takes ``targets.at(k)``; ``readme`` makes fresh arrays every tick and
rewrites one target; ``paced`` is ``readme`` once a millisecond, asleep between ticks. The processes of both
checkouts take turns; the figures are medians of the p50 of a step, in microseconds.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from bench import command_line
from bench.ways import WAYS, took

ROOT = Path(__file__).resolve().parents[1]
FIRST_RELEASE = "9250cf8"
LEVELS = ("velocity", "acceleration")
RADIUS = 0.05
"""Of the circle [m]."""
PACED_STEPS = 2_000
"""Most paced steps of a loop; they take a millisecond each."""


def measured(steps: int, ways: Sequence[str] = WAYS) -> dict[str, float]:
    """p50 of a step of whatever ``ftqp`` this process imports [us], by robot, level and way."""
    from bench.cases import chain30
    from bench.urdf import TIP, text

    import ftqp

    arm = chain30()
    panda = ftqp.robots.load("panda")
    chain = ftqp.Robot.from_urdf(text("chain30", arm), tip=TIP, acceleration=arm.a_max)
    result = {}
    for name, robot, q in (("panda", panda, panda.neutral), ("chain30", chain, arm.neutral)):
        for level in LEVELS:
            for way in ways:
                result[f"{name} {level} {way}"] = _timed(
                    robot, q, level, way, min(steps, PACED_STEPS) if way == "paced" else steps
                )
    return result


def _timed(robot: Any, q: Any, level: str, way: str, steps: int) -> float:
    """p50 of a step [us]."""
    from bench.own import driven

    import ftqp

    planner = ftqp.Planner(robot, dt=0.001, level=level, emergency=None)
    planner.reset(q)
    path = ftqp.paths.Circle(robot.pose(q), radius=RADIUS, duration=0.001 * steps)
    sample = path.sample(0.001 * np.arange(steps))
    arm = driven(planner, way, q, sample.pose, sample.twist, sample.acceleration)
    return float(np.median(took(way, arm.step, arm.between, range(steps)))) * 1e-3


def main() -> int:
    """Measures both checkouts in turns and shows the ratios; 0 when both could be measured."""
    options = _options()
    if options.child:
        print(json.dumps(measured(options.steps, options.ways)))
        return 0
    with tempfile.TemporaryDirectory() as folder:
        other = Path(folder) / "other"
        made = subprocess.run(
            ["git", "worktree", "add", "--detach", "--quiet", str(other), options.against],
            cwd=ROOT,
            capture_output=True,
            text=True,
        )
        if made.returncode != 0:
            print(
                f"{options.against!r} is no commit of this repository: {made.stderr.strip()}", file=sys.stderr
            )
            return 2
        try:
            rounds = [(_child(other, options), _child(ROOT, options)) for _ in range(options.runs)]
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", str(other)], cwd=ROOT, check=False)
    figures = {
        name: {
            "then": statistics.median(then[name] for then, _ in rounds),
            "now": statistics.median(now[name] for _, now in rounds),
            "ratio": statistics.median(now[name] / then[name] for then, now in rounds),
        }
        for name in rounds[0][0]
    }
    if options.json:
        print(json.dumps({"against": options.against, "runs": options.runs, "p50_us": figures}))
        return 0
    print(f"{'p50 of a step [us]':32}{options.against:>10}{'now':>8}{'ratio':>8}")
    for name, figure in figures.items():
        print(f"{name:32}{figure['then']:10.2f}{figure['now']:8.2f}{figure['ratio']:8.2f}")
    return 0


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    parser.add_argument("--against", default=FIRST_RELEASE, metavar="COMMIT", help="default %(default)s")
    parser.add_argument("--runs", type=int, default=3, metavar="N", help="rounds (default %(default)s)")
    parser.add_argument(
        "--steps", type=int, default=12_000, metavar="N", help="of a loop (default %(default)s)"
    )
    command_line.add_ways(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args()


def _child(tree: Path, options: argparse.Namespace) -> dict[str, float]:
    """What a process with the source of ``tree`` measures."""
    done = subprocess.run(
        [
            sys.executable,
            __file__,
            "--child",
            "--steps",
            str(options.steps),
            "--ways",
            ",".join(options.ways),
        ],
        env=os.environ | {"PYTHONPATH": str(tree / "src")},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    found: dict[str, float] = json.loads(done.stdout)
    return found


if __name__ == "__main__":
    sys.exit(main())
