"""How many closed-loop Panda steps a second the batch entry makes: arms with records and faults of their own.

python solvers/bench_batch.py [--threads 1] [--arms 64] [--ticks 4000] [--json]
"""

import argparse
import json
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
    parser.add_argument("--ticks", type=int, default=TICKS)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if options.threads < 1 or options.arms < 1 or options.ticks < 4:
        parser.error("--threads and --arms take whole numbers from 1, --ticks from 4")
    rows = [
        measure(level, fault, options.arms, options.threads, options.ticks)
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


def measure(level: str, fault: bool, arms: int, threads: int, ticks: int) -> dict[str, object]:
    """Advance all arms round a circle; the first joint-lock is at a quarter of the way."""
    import numpy as np

    import ftqp
    from ftqp.kernel.entry.rollouts import rollout
    from ftqp.kernel.layout.enums import JointCode

    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, level=level)
    planner.reset(robot.neutral)
    session = planner.session()
    path = ftqp.paths.Circle(robot.pose(robot.neutral), 0.02, duration=TICKS * DT)
    samples = path.sample(np.arange(ticks) * DT)
    targets = ftqp.Targets(samples.pose, samples.twist, samples.acceleration).packed
    events = np.full((arms, 3), -1, dtype=np.int64)
    if fault:
        events[:, 0], events[:, 1], events[:, 2] = np.arange(arms) % 7, ticks // 4, JointCode.BRAKING
    q, v = np.repeat(robot.neutral[None], arms, axis=0), np.zeros((arms, 7))
    for count in (2, ticks):  # the first call compiles, or loads from disk
        before = perf_counter()
        done = rollout(session, q, v, targets[:count], events, np.full(arms, 2.0), threads)
        seconds = perf_counter() - before
    return {
        "level": level,
        "fault": fault,
        "steps_per_second_and_thread": arms * ticks / seconds / threads,
        "max_position_error": float(done.worst[:, 0].max()),
    }


if __name__ == "__main__":
    sys.exit(main())
