"""How many closed-loop Panda steps a second the batch entry makes: arms with records and faults of their own.

python solvers/bench_batch.py [--threads 1] [--arms 64] [--json]
"""

import argparse
import json
import os
import sys
from time import perf_counter

TICKS = 4000
DT = 1e-3


def main() -> int:
    """Measure both levels, healthy and with a joint locking on every arm."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--arms", type=int, default=64)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if options.threads < 1 or options.arms < 1:
        parser.error("--threads and --arms take whole numbers from 1")
    os.environ["NUMBA_NUM_THREADS"] = str(options.threads)
    rows = [
        measure(level, fault, options.arms, options.threads)
        for level in ("velocity", "acceleration")
        for fault in (False, True)
    ]
    if options.json:
        json.dump({"benchmark": "batch", "threads": options.threads, "rows": rows}, sys.stdout)
        return 0
    for row in rows:
        print(
            f"{row['level']:12s} {'a joint locks' if row['fault'] else 'healthy':13s} "
            f"{row['steps_per_second_and_thread'] / 1e6:5.2f} M steps per second and thread; "
            f"off the path by at most {1e3 * row['max_position_error']:.3f} mm"
        )
    return 0


def measure(level: str, fault: bool, arms: int, threads: int) -> dict[str, object]:
    """Advance all arms round a circle; the first joint-lock is at a quarter of the way."""
    import numpy as np

    import ftqp
    from ftqp.kernel.entry import entries as entry
    from ftqp.kernel.layout import enums as codes

    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, level=level)
    planner.reset(robot.neutral)
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.02, duration=TICKS * DT)
    samples = path.sample(np.arange(TICKS) * DT)
    targets = ftqp.Targets(samples.pose, samples.twist, samples.acceleration).packed
    events = np.full((arms, 3), -1, dtype=np.int64)
    if fault:
        events[:, 0], events[:, 1], events[:, 2] = np.arange(arms) % 7, TICKS // 4, codes.BRAKING
    seconds = 0.0
    worst = np.zeros((arms, 2))
    for ticks in (2, TICKS):  # the first call compiles, or loads from disk
        W = np.repeat(planner._record, arms)
        q, v = np.repeat(robot.neutral[None], arms, axis=0), np.zeros((arms, 7))
        worst[:] = 0.0
        counts = np.zeros((arms, 7), dtype=np.int64)
        before = perf_counter()
        entry.batch(W, q, v, targets[:ticks], events, np.full(arms, 2.0), worst, counts)
        seconds = perf_counter() - before
    return {
        "level": level,
        "fault": fault,
        "steps_per_second_and_thread": arms * TICKS / seconds / threads,
        "max_position_error": float(worst[:, 0].max()),
    }


if __name__ == "__main__":
    sys.exit(main())
