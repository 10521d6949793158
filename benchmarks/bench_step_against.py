"""The whole user step of this checkout against that of an earlier commit, in the same run.

    python benchmarks/bench_step_against.py                   against the first release
    python benchmarks/bench_step_against.py --against HEAD~1  against another commit
    python benchmarks/bench_step_against.py --json            one JSON object on stdout, nothing else

A Panda and a 30-joint chain follow the targets of ``bench_step.py`` in closed loop at both levels, called in
three ways: ``best`` hands the planner's own arrays back and takes ``targets.at(k)``; ``readme`` makes fresh
arrays every tick and rewrites one target; ``paced`` is ``readme`` once a millisecond, asleep between ticks.
Two processes, one a checkout, take turns on one core, a chunk of steps at a time. The figures are medians
over chunks: of their p50 in microseconds, and of the ratio of neighbours.
"""

import argparse
import json
import statistics
import sys
import tempfile
from pathlib import Path

from bench import cases, command_line, results
from steps.measure import Settings, Worker, WorkerFailed, last_core
from steps.own import ALONG, tasks

from ftqp.core.errors import InputError

ROOT = Path(__file__).resolve().parents[1]
FIRST_RELEASE = "9250cf8"
LEVELS = {"velocity": "velocity", "torque": "acceleration"}
"""What the levels of a case are called."""
HOT = Settings(steps=12_000, chunk=500, warm=cases.PERIOD)
PACED = Settings(steps=3_000, chunk=100, warm=cases.PERIOD, discard=5)
"""Its steps take a millisecond each."""

Times = dict[str, tuple[list[float], list[float]]]
"""Medians of the chunks of both checkouts [us], by robot, level and way."""


def measured(trees: tuple[Path, Path], options: argparse.Namespace) -> Times:
    """What new processes with the sources of two checkouts measure.

    Raises:
        SystemExit: One of them cannot make its steps; the message says why.
    """
    found: Times = {}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        own = Path(sys.executable), "steps.own"
        workers = [
            Worker(str(tree), *own, log=place / f"{k}.log", core=last_core(), source=tree / "src")
            for k, tree in enumerate(trees)
        ]
        try:
            for path in tasks():
                for level, name in LEVELS.items():
                    path.case(level, locked=False).save(place / "case.npz")
                    for way in options.ways:
                        settings = PACED if way == "paced" else HOT
                        found[f"{path.name} {name} {way}"] = _alternated(
                            workers, place / "case.npz", way, settings, options.steps
                        )
        finally:
            for worker in workers:
                worker.close()
    return found


def _alternated(
    workers: list[Worker], case: Path, way: str, settings: Settings, steps: int
) -> tuple[list[float], list[float]]:
    """Medians of the chunks of both workers in one case [us]."""
    for worker in workers:
        opened = worker.ask(open=str(case), way=way, only=[ALONG])
        if opened["declined"]:
            raise SystemExit(f"{worker.name} cannot make the steps: {opened['declined'][ALONG]}")
        worker.ask(warm=ALONG, steps=min(settings.warm, steps))
    medians: tuple[list[float], list[float]] = ([], [])
    steps = min(steps, settings.steps)
    chunk = min(steps, settings.chunk)
    for turn in range(-(-steps // chunk)):
        for k in (0, 1) if turn % 2 == 0 else (1, 0):
            answer = workers[k].ask(chunk=ALONG, steps=chunk, discard=settings.discard)
            if "error" in answer:
                raise SystemExit(f"{workers[k].name} cannot make the steps: {answer['error']}")
            medians[k].append(statistics.median(answer["ns"]) * 1e-3)
    return medians


def main() -> int:
    """Measures both checkouts in turns and shows the ratios: 0 when both could be measured, else 1 or 2."""
    options = _options()
    try:
        with results.checkout(options.against) as other:
            rounds = [measured((other, ROOT), options) for _ in range(options.runs)]
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except WorkerFailed as error:
        print(f"no step could be measured: {error}", file=sys.stderr)
        return 1
    figures = {name: _figures([one[name] for one in rounds]) for name in rounds[0]}
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
        "--steps", type=int, default=HOT.steps, metavar="N", help="at most so many a case and run"
    )
    command_line.add_ways(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    return parser.parse_args()


def _figures(rounds: list[tuple[list[float], list[float]]]) -> dict[str, float]:
    """Medians over everything that was measured in a case, and of the ratios of neighbouring chunks."""
    pairs = [(then, now) for thens, nows in rounds for then, now in zip(thens, nows, strict=True)]
    return {
        "then": statistics.median(then for then, _ in pairs),
        "now": statistics.median(now for _, now in pairs),
        "ratio": statistics.median(now / then for then, now in pairs),
    }


if __name__ == "__main__":
    sys.exit(main())
