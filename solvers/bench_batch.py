"""How many closed-loop Panda steps a second the batch entry makes: arms with records and faults of their own.

    python solvers/bench_batch.py [--threads 1] [--arms 64] [--ticks 4000]
    python solvers/bench_batch.py --json    one JSON object on stdout, nothing else

Every arm goes round a circle; nothing of Python runs between its steps.
"""

import sys
from time import perf_counter
from typing import Any

from bench import command_line, docs
from bench.results import circumstances
from bench.tables import Table

TICKS = 4000
DT = 1e-3
GOALS = {"velocity": 5.0, "acceleration": 3.0}
"""Healthy steps a second and core that it shall come to [millions]."""
LIMITATIONS = (
    "Steps a second belong to this machine and its load: nothing runs beside them to compare with.",
    "All arms go round the same circle; where joints lock, arm i loses joint i modulo 7, needed or not.",
)


def main() -> int:
    """Measure both levels, healthy and with a joint locking on every arm."""
    parser = command_line.parser(__doc__)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--arms", type=int, default=64)
    parser.add_argument("--ticks", type=int, default=TICKS)
    docs.options(parser)
    options = parser.parse_args()
    if options.threads < 1 or options.arms < 1 or options.ticks < 4:
        parser.error("--threads and --arms take whole numbers from 1, --ticks from 4")
    rows = [
        measure(level, fault, options.arms, options.threads, options.ticks)
        for level in ("velocity", "acceleration")
        for fault in (False, True)
    ]
    settings = {name: getattr(options, name) for name in ("threads", "arms", "ticks")}
    result = {
        **circumstances("bench_batch", [], settings),
        "threads": options.threads,
        "rows": rows,
        "left_out": {},
        "limitations": list(LIMITATIONS),
    }
    docs.told(result, "Batches", [table(rows)], options)
    return 0


def table(rows: list[dict[str, Any]]) -> Table:
    """Steps a second, and how far arms were off their path."""
    return Table(
        title="Closed-loop Panda steps a second and thread [millions]",
        headings=("", "steps", "goal", "off the path at most [mm]"),
        rows=[
            (
                f"{row['level']} level, {'a joint locks' if row['fault'] else 'healthy'}",
                f"{row['steps_per_second_and_thread'] / 1e6:.2f}",
                "" if row["fault"] else f"{GOALS[row['level']]:.1f}",
                f"{1e3 * row['max_position_error']:.3f}",
            )
            for row in rows
        ],
    )


def measure(level: str, fault: bool, arms: int, threads: int, ticks: int) -> dict[str, Any]:
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
