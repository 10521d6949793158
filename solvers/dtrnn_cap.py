"""How often the network ends at its cap: feasible QPs whose objective is ill-conditioned, in a narrow box.

Random QPs of seven variables and three equalities: W has the condition of its row, evenly apart on a
logarithmic axis; x_0 is a point with A x_0 = b, from which every bound is 0.05 to 1 away, and the objective
is least at a normally distributed point, so many times as far off: that says how many bounds get active.
Every QP has a solution, and ``active_set`` is asked for it, too. The backend ``dtrnn`` is taken as it comes:
product mode, cold.

    python solvers/dtrnn_cap.py [--quick] [--count N] [--out DIR] [--json]

Full study: some seconds on one core. Results go to ``solvers/results`` unless --out says otherwise.
"""

import argparse
import json
import platform
import sys
from collections import Counter
from datetime import date
from typing import Any

import numpy as np
from bench import results

from ftqp.qp import QP, SolveStatus, solve

VARIABLES, ROWS = 7, 3
CONDITIONS = (1e2, 1e4, 1e6, 1e7, 1e8)
REACHES = (1.0, 10.0, 100.0)
"""How far off the least objective is, in the size of the box."""
ILL = 1e6
"""The condition from which the total counts."""
PACKAGES = ("ftqp", "numpy", "numba")


def feasible_qp(rng: np.random.Generator, condition: float, reach: float) -> QP:
    """A QP with a point inside its box that keeps all rows."""
    n = VARIABLES
    directions, _ = np.linalg.qr(rng.normal(size=(n, n)))
    W = (directions * np.logspace(0.0, -np.log10(condition), n)) @ directions.T
    inside, A = rng.uniform(-1.0, 1.0, n), rng.normal(size=(ROWS, n))
    lb, ub = inside - rng.uniform(0.05, 1.0, n), inside + rng.uniform(0.05, 1.0, n)
    W = 0.5 * (W + W.T)
    return QP(W, -W @ rng.normal(size=n) * reach, A, A @ inside, lb=lb, ub=ub)


def study(count: int) -> list[dict[str, Any]]:
    """A row a condition and reach: how the network and ``active_set`` ended on the same QPs."""
    rows = []
    for reach in REACHES:
        rng = np.random.default_rng(0)
        for condition in CONDITIONS:
            ends: Counter[str] = Counter()
            solved = bounds = 0
            for _ in range(count):
                problem = feasible_qp(rng, condition, reach)
                ends[solve(problem, "dtrnn").status.name] += 1
                exact = solve(problem)
                solved += exact.status is SolveStatus.SOLVED
                bounds += int(np.count_nonzero(exact.z_box))
            rows.append(
                {
                    "reach": reach,
                    "condition": condition,
                    "count": count,
                    "active": bounds / count,
                    "ends": dict(ends),
                    "active_set": solved,
                }
            )
    return rows


def capped(rows: list[dict[str, Any]]) -> tuple[int, int]:
    """How many QPs with a condition of 1e6 to 1e8 ended at the cap, and how many there were."""
    ill = [row for row in rows if row["condition"] >= ILL]
    return sum(row["ends"].get("MAX_ITERATIONS", 0) for row in ill), sum(row["count"] for row in ill)


def markdown(result: dict[str, Any]) -> str:
    """The table for a reader."""
    at_cap, of = result["capped"], result["ill_conditioned"]
    lines = [
        "# Feasible QPs on which the network ends at its cap",
        "",
        f"`{result['command']}`, {result['date']}, {result['machine']}, "
        f"Python {result['versions']['python']}, "
        + ", ".join(f"{name} {result['versions'][name]}" for name in PACKAGES),
        "",
        "| least objective off by | condition of W | bounds active, mean | `dtrnn` solves | at its cap "
        "| otherwise | `active_set` solves |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in result["rows"]:
        ends = row["ends"]
        solved, at_limit = ends.get("SOLVED", 0), ends.get("MAX_ITERATIONS", 0)
        lines.append(
            f"| {row['reach']:g} | {row['condition']:.0e} | {row['active']:.1f} | {solved} of {row['count']} "
            f"| {at_limit} | {row['count'] - solved - at_limit} | {row['active_set']} |"
        )
    lines += [
        "",
        f"Condition 1e6 to 1e8: {at_cap} of {of} at the cap, {100.0 * at_cap / of:.0f} %.",
        "",
        "What this does not say: how often a planner meets such a QP. Of the recorded ones of arms `dtrnn`",
        "solves all ([the study](study_dtrnn.md)).",
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="a tenth of the QPs")
    parser.add_argument("--count", type=int, default=200, help="QPs a row (200)")
    results.add_out(parser, "dtrnn_cap")
    parser.add_argument("--json", action="store_true", help="print the rows as JSON and write nothing")
    given = parser.parse_args()
    rows = study(max(given.count // 10, 1) if given.quick else given.count)
    at_cap, of = capped(rows)
    result = {
        "command": results.command("dtrnn_cap", sys.argv[1:]),
        "date": date.today().isoformat(),
        "machine": f"{platform.machine()} {platform.system()}",
        "versions": {"python": platform.python_version()} | results.packages(PACKAGES),
        "rows": rows,
        "capped": at_cap,
        "ill_conditioned": of,
    }
    if given.json:
        print(json.dumps(result))
        return
    results.written(
        result, markdown(result), given.out, results.stem("dtrnn_cap", name=None, quick=given.quick)
    )
    print(markdown(result))


if __name__ == "__main__":
    main()
