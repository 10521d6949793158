"""Closed-loop Panda steps a second of ``ftqp.batch.rollout`` on one core, and what a million runs take.

    python benchmarks/bench_batch.py             a table, half a minute
    python benchmarks/bench_batch.py --million   and a million runs of 100 steps, a joint locking at the first
    python benchmarks/bench_batch.py --json      one JSON object on stdout, nothing else

Every arm goes round a circle from a start of its own; nothing of Python runs between its steps. CPU seconds
are counted. The same steps are also made one by one with ``planner.step``, for comparison.
"""

import sys
from time import perf_counter, process_time
from typing import Any

import numpy as np
from bench import command_line, docs
from bench.results import circumstances
from bench.tables import Table

TICKS = 4000
DT = 1e-3
GOALS = {False: 1.5, True: 0.5}
"""Steps a second and core that it shall come to, healthy and where a joint locks [millions]."""
DURATION, RADIUS, SPREAD = 4.0, 0.05, 1e-4
"""The circle [s], [m], and how far the starts differ [rad]."""
BENT = (0.0, -0.4, 0.4, -2.0, 0.3, 1.8, 0.8)
"""A posture of the Panda from which six joints may lock; without the fourth it cannot keep its task."""
LIMITATIONS = (
    "Steps a second belong to this machine and its load.",
    "All arms go round the same circle; where joints lock, arm i loses joint i modulo 7, needed or not. An "
    "arm that cannot keep its task takes most of the time, near a singularity several microseconds a step.",
)


def main() -> int:
    """Measure both levels, healthy and with a joint locking on every arm."""
    parser = command_line.parser(__doc__)
    parser.add_argument("--arms", type=int, default=64)
    parser.add_argument("--ticks", type=int, default=TICKS)
    parser.add_argument("--million", action="store_true")
    docs.options(parser)
    options = parser.parse_args()
    if options.arms < 1 or options.ticks < 4:
        parser.error("--arms takes a whole number from 1, --ticks from 4")
    rows = [
        measure(level, fault, options.arms, options.ticks)
        for level in ("velocity", "acceleration")
        for fault in (False, True)
    ]
    runs = [million(level) for level in ("velocity", "acceleration")] if options.million else []
    settings = {"arms": options.arms, "ticks": options.ticks}
    result = {
        **circumstances("bench_batch", [], settings),
        "rows": rows,
        "million": runs,
        "limitations": list(LIMITATIONS),
    }
    docs.publish(result, "Batches", [table(rows), *([table_of_runs(runs)] if runs else [])], options)
    return 0


def table(rows: list[dict[str, Any]]) -> Table:
    """Steps a second, and how far arms were off their path."""
    return Table(
        title="Closed-loop Panda steps a second and core [millions]",
        headings=("", "steps", "goal", "ns a step", "over planner.step", "off the path at most [mm]"),
        rows=[
            (
                f"{row['level']} level, {'a joint locks' if row['fault'] else 'healthy'}",
                f"{row['steps_per_second'] / 1e6:.2f}",
                f"{GOALS[row['fault']]:.1f}",
                f"{1e9 / row['steps_per_second']:.0f}",
                f"{row['over_steps']:.1f}",
                f"{1e3 * row['max_position_error']:.3f}",
            )
            for row in rows
        ],
    )


def table_of_runs(runs: list[dict[str, Any]]) -> Table:
    """What a million runs take."""
    return Table(
        title="A million runs of 100 steps after a joint has locked",
        headings=("", "CPU seconds", "at most", "threads", "seconds"),
        rows=[
            (
                f"{run['level']} level",
                f"{run['cpu_seconds']:.0f}",
                "200",
                str(run["threads"]),
                f"{run['seconds']:.0f}",
            )
            for run in runs
        ],
    )


def study(level: str, ticks: int) -> tuple[Any, Any, Any]:
    """A planner, its targets, and about where its arms start."""
    import ftqp

    robot = ftqp.robots.load("panda")
    planner = ftqp.Planner(robot, DT, level=level)
    q = np.array(BENT)
    path = ftqp.paths.Circle(robot.pose(q), RADIUS, duration=DURATION)
    samples = path.sample(np.arange(ticks) * DT)
    return planner, ftqp.Targets(samples.pose, samples.twist, samples.acceleration), q


def measure(level: str, fault: bool, arms: int, ticks: int) -> dict[str, Any]:
    """Steps a second of a batch; where a joint locks, it is at a quarter of the way."""
    import ftqp

    planner, targets, q = study(level, ticks)
    starts = q + SPREAD * np.random.default_rng(7).normal(size=(arms, len(q)))
    faults: list[Any] = [(ftqp.Locked(arm % len(q)), ticks // 4) if fault else None for arm in range(arms)]
    ftqp.batch.rollout(planner, starts[:1], targets=targets, faults=faults[:1], threads=1)
    before = process_time()
    done = ftqp.batch.rollout(planner, starts, targets=targets, faults=faults, threads=1)
    seconds = process_time() - before
    few = min(arms, len(q))
    alone = sum(one_by_one(planner, starts[arm], targets, faults[arm]) for arm in range(few)) / few
    return {
        "level": level,
        "fault": fault,
        "steps_per_second": arms * ticks / seconds,
        "over_steps": alone / ticks / (seconds / (arms * ticks)),
        "max_position_error": float(done.position_error.max()),
    }


def one_by_one(planner: Any, q: Any, targets: Any, told: Any) -> float:
    """CPU seconds of the same ticks of one arm with ``planner.step``."""
    q, v = q.copy(), np.zeros(len(q))
    planner.reset(q)
    before = process_time()
    for k in range(len(targets)):
        if told is not None and k == told[1]:
            planner.report(told[0])
        step = planner.step(q, v, targets.at(k))
        q[:], v[:] = step.q, step.v
    seconds = process_time() - before
    if told is not None:
        planner.withdraw(told[0].joint)
    return seconds


def million(level: str, runs: int = 1_000_000, ticks: int = 100) -> dict[str, Any]:
    """What so many runs take on all cores, the joint locking at the first step."""
    import ftqp
    from ftqp.kernel.entry.session import thread_count

    planner, targets, q = study(level, ticks)
    starts = q + SPREAD * np.random.default_rng(8).normal(size=(runs, len(q)))
    kinds = [ftqp.Locked(joint) for joint in range(len(q))]
    faults = [kinds[run % len(kinds)] for run in range(runs)]
    cpu, wall = process_time(), perf_counter()
    ftqp.batch.rollout(planner, starts, targets=targets, faults=faults)
    seconds, cpu = perf_counter() - wall, process_time() - cpu
    return {"level": level, "runs": runs, "threads": thread_count(), "seconds": seconds, "cpu_seconds": cpu}


if __name__ == "__main__":
    sys.exit(main())
