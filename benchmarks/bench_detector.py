"""What a detector adds to a planner's step while nothing is suspected: both planners in turn, in one process.

    python benchmarks/bench_detector.py          a Panda on a circle, three kinds of planner
    python benchmarks/bench_detector.py --json   one JSON object on stdout, nothing else

Only differences and ratios mean anything: machines differ and other work disturbs.
"""

import sys
from time import perf_counter_ns

import numpy as np
from bench import docs
from bench.tables import Table, quantity

import ftqp

PLANNERS = {
    "velocity level, position drive": {"level": "velocity"},
    "acceleration level, position drive": {},
    "acceleration level, torque drive": {"drive": "torque"},
}
SIGMA, DT, TICKS = 1e-4, 1e-3, 4000
LIMITATIONS = ("The arm follows its commands exactly; samples have a noise of 1e-4 rad.",)


def times(planner: ftqp.Planner, seed: int) -> np.ndarray:
    """What each step of a circle takes, (TICKS,) [us]."""
    robot = planner.robot
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.1, duration=TICKS * DT, axes=("y", "z"))
    sample, target = path.sample(np.arange(TICKS) * DT), ftqp.Target(pose=path.start)
    noise = SIGMA * np.random.default_rng(seed).standard_normal((TICKS, robot.nv))
    q, taken = robot.neutral.copy(), np.empty(TICKS)
    planner.reset(q)
    for k in range(TICKS):
        target.at(sample.pose[k], sample.twist[k], sample.acceleration[k])
        seen = q + noise[k]
        began = perf_counter_ns()
        step = planner.step(seen, None, target)
        taken[k] = perf_counter_ns() - began
        q = step.q.copy()
    if planner.findings:
        raise SystemExit(f"a healthy arm was found to have failed: {planner.findings}")
    return 1e-3 * taken


def measured(name: str, rounds: int) -> dict[str, object]:
    """Medians and 99th percentiles of a planner without and with a detector."""
    robot, noise = ftqp.robots.load("panda"), ftqp.Noise(q=SIGMA)
    alone = ftqp.Planner(robot, DT, noise=noise, detector=False, **PLANNERS[name])
    watched = ftqp.Planner(robot, DT, noise=noise, detector=ftqp.Detector(), **PLANNERS[name])
    taken = [[times(planner, seed) for planner in (alone, watched)] for seed in range(rounds)]
    without, with_one = (np.concatenate(list(column)) for column in zip(*taken, strict=True))
    return {
        "planner": name,
        "p50": [float(np.median(without)), float(np.median(with_one))],
        "p99": [float(np.percentile(without, 99.0)), float(np.percentile(with_one, 99.0))],
        "added": float(np.median(with_one) - np.median(without)),
    }


def main() -> int:
    """Measure, print, write; 0 when done, 2 for bad input."""
    options = docs.asked(__doc__, rounds=(5, "circles of each"))
    rows = [measured(name, options.rounds) for name in PLANNERS]
    result = docs.measured("bench_detector", {"rounds": options.rounds, "ticks": TICKS}, rows, LIMITATIONS)
    lines = [
        (row["planner"], *(quantity(x) for x in (*row["p50"], row["added"], *row["p99"]))) for row in rows
    ]
    headings = ("planner", "p50 without", "p50 with", "added", "p99 without", "p99 with")
    table = Table(title="A step with and without a detector [us]", headings=headings, rows=lines)
    docs.publish(result, "Detector", [table], options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
