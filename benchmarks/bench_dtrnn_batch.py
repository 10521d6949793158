"""How many QPs a second the recurrent network solves at once, against their number.

    python benchmarks/bench_dtrnn_batch.py            up to 100,000 QPs on one thread of the CPU
    python benchmarks/bench_dtrnn_batch.py --quick    shows that it works; figures mean little

Two kinds of QPs with n = 7 and m = 6, each from a cold start: those of a Panda's pose task at random postures
(minimum velocity norm, velocity limits), and random ones whose box holds several variables. Every answer is
checked against rows and box. Prints a table; writes JSON, a table and a figure to ``--out``. Nothing is a
pass or a fail.
"""

import argparse
import json
import os
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

KINDS = ("panda", "random")
LIMITATIONS = (
    "One thread; `--threads` shares the QPs out among more.",
    "Cold starts only. The first call of each size is left out: it compiles, or loads from disk.",
    "Of three calls the fastest counts; a busy machine makes all of them slow.",
)


def main() -> int:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--out", type=Path, default=Path(__file__).resolve().parent / "results")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if options.threads < 1:
        parser.error("--threads takes a whole number from 1")
    os.environ["NUMBA_NUM_THREADS"] = str(options.threads)
    from bench.results import circumstances

    from ftqp import FtqpError

    counts = (1, 100) if options.quick else (1, 10, 100, 1_000, 10_000, 100_000)
    settings = {"threads": options.threads, "quick": options.quick}
    result = circumstances("bench_dtrnn_batch", (), settings)
    try:
        result["rows"] = [measured(kind, count, options) for kind in KINDS for count in counts]
    except FtqpError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    result["limitations"] = list(LIMITATIONS)
    files = written(result, options)
    if options.json:
        sys.stdout.write(json.dumps(result) + "\n")
    else:
        print("\n".join(lines(result)))
        print("written:", ", ".join(str(path) for path in files))
    return 0


def problems(kind: str, count: int) -> dict[str, Any]:
    """QPs of one kind as stacked arrays, the same ones every time."""
    import numpy as np

    rng = np.random.default_rng(0)
    if kind == "random":
        A = rng.normal(size=(count, 6, 7))
        x = rng.uniform(-1.0, 1.0, (count, 7))
        return dict(
            H=np.eye(7),
            g=3.0 * rng.normal(size=(count, 7)),
            A=A,
            b=np.einsum("kij,kj->ki", A, x),
            lb=np.full(7, -1.0),
            ub=np.full(7, 1.0),
        )
    import ftqp
    from ftqp.kernel.entry.session import ArmSession

    robot = ftqp.robots.load("panda")
    arm, limits = ArmSession(robot.chain.constants()), robot.limits
    J = np.zeros((count, 6, 7))
    middle, half = 0.5 * (limits.q_max + limits.q_min), 0.4 * (limits.q_max - limits.q_min)
    for k in range(count):
        arm.kinematics(middle + half * rng.uniform(-1.0, 1.0, 7))
        J[k] = arm.K.kinematics.J[:, :7]
    v = 0.3 * limits.v_max * rng.uniform(-1.0, 1.0, (count, 7))
    b = np.einsum("kij,kj->ki", J, v)
    return dict(H=np.eye(7), g=np.zeros(7), A=J, b=b, lb=-limits.v_max, ub=limits.v_max)


def measured(kind: str, count: int, options: argparse.Namespace) -> dict[str, Any]:
    """One kind and number of QPs: QPs a second and thread, and how good the answers are."""
    import numpy as np

    from ftqp.qp import dtrnn

    given = problems(kind, count)
    dtrnn.solve_batch(**given)
    best = float("inf")
    for _ in range(3):
        before = perf_counter()
        found = dtrnn.solve_batch(**given)
        best = min(best, perf_counter() - before)
    solved = found.codes == 0
    rest = np.abs(np.einsum("kij,kj->ki", given["A"], found.x) - given["b"])[solved]
    at_bound = ((found.x <= given["lb"]) | (found.x >= given["ub"]))[solved]
    return {
        "kind": kind,
        "count": count,
        "qps_per_second_and_thread": count / best / options.threads,
        "iterations_median": float(np.median(found.iterations)),
        "iterations_max": int(found.iterations.max()),
        "solved": int(solved.sum()),
        "largest_row_residual": float(rest.max(initial=0.0)),
        "bounds_active_mean": float(at_bound.sum(axis=1).mean()) if solved.any() else 0.0,
    }


def lines(result: dict[str, Any]) -> list[str]:
    """The table."""
    head = (
        "QPs",
        "number",
        "QPs a second and thread",
        "solved",
        "iterations",
        "at a bound",
        "worst error of Ax = b",
    )
    table = [f"| {' | '.join(head)} |", "|---|" + "---:|" * (len(head) - 1)]
    for row in result["rows"]:
        table.append(
            f"| {row['kind']} | {row['count']:,} | {row['qps_per_second_and_thread']:,.0f} "
            f"| {row['solved']:,} | "
            f"{row['iterations_median']:.0f}/{row['iterations_max']} | {row['bounds_active_mean']:.2f} | "
            f"{row['largest_row_residual']:.0e} |"
        )
    return table


def written(result: dict[str, Any], options: argparse.Namespace) -> list[Path]:
    """Table, figure and JSON."""
    from bench import results

    name = results.stem("bench_dtrnn_batch", name=None, quick=options.quick)
    versions = ", ".join(f"{name} {number}" for name, number in result["versions"].items())
    machine = ", ".join(f"{key} {value}" for key, value in result["machine"].items())
    text = [
        "# Batches of the recurrent network",
        "",
        f"{result['date']}. Made by `{result['command']}`.",
        "",
        *lines(result),
        "",
        "iterations: median/largest. at a bound: how many of the 7 variables, on average.",
        "",
        f"Machine: {machine}. Versions: {versions}.",
        "",
        *(f"- {limitation}" for limitation in result["limitations"]),
    ]
    return results.written(result, "\n".join(text), options.out, name, draw)


def draw(result: dict[str, Any], folder: Path, name: str) -> list[Path]:
    """QPs a second against their number."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.8), layout="constrained")
    axes = figure.subplots()
    names = {"panda": "Panda, pose task", "random": "random, tight box"}
    for kind, marker in zip(KINDS, "os", strict=True):
        rows = [row for row in result["rows"] if row["kind"] == kind]
        x, y = [row["count"] for row in rows], [row["qps_per_second_and_thread"] for row in rows]
        axes.loglog(x, y, marker=marker, label=names[kind])
    axes.axhline(1e5, color="0.6", linewidth=1.0, linestyle="--", label="100,000 a second")
    axes.set(
        xlabel="QPs in one call",
        ylabel="QPs a second and thread",
        title="n = 7, m = 6, cold starts",
    )
    axes.grid(alpha=0.3, which="both")
    axes.legend()
    file = folder / f"{name}.png"
    figure.savefig(file, dpi=120)
    return [file]


if __name__ == "__main__":
    sys.exit(main())
