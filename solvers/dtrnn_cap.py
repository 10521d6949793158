"""How often the network ends at its cap: feasible QPs whose objective is ill-conditioned, in a narrow box.

Random QPs of seven variables and three equalities: W has the condition of its row, evenly apart on a
logarithmic axis; x_0 is a point with A x_0 = b, from which every bound is 0.05 to 1 away, and the objective
is least at a normally distributed point, so many times as far off: that says how many bounds get active.
Every QP has a solution, and ``active_set`` is asked for it, too. The backend ``dtrnn`` is taken as it comes:
product mode, cold.

    python solvers/dtrnn_cap.py [--quick] [--count N] [--out DIR] [--json]

Full study: some seconds on one core. Results go to ``solvers/results`` unless --out says otherwise.
"""

from collections import Counter
from typing import Any

import numpy as np
from bench import study
from bench.tables import Table

from ftqp.qp import QP, SolveStatus, solve

VARIABLES, ROWS = 7, 3
CONDITIONS = (1e2, 1e4, 1e6, 1e7, 1e8)
REACHES = (1.0, 10.0, 100.0)
"""How far off the least objective is, in the size of the box."""
ILL = 1e6
"""The condition from which the total counts."""


def feasible_qp(rng: np.random.Generator, condition: float, reach: float) -> QP:
    """A QP with a point inside its box that keeps all rows."""
    n = VARIABLES
    directions, _ = np.linalg.qr(rng.normal(size=(n, n)))
    W = (directions * np.logspace(0.0, -np.log10(condition), n)) @ directions.T
    inside, A = rng.uniform(-1.0, 1.0, n), rng.normal(size=(ROWS, n))
    lb, ub = inside - rng.uniform(0.05, 1.0, n), inside + rng.uniform(0.05, 1.0, n)
    W = 0.5 * (W + W.T)
    return QP(W, -W @ rng.normal(size=n) * reach, A, A @ inside, lb=lb, ub=ub)


def ended(count: int) -> list[dict[str, Any]]:
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


def tables(found: dict[str, Any]) -> list[Table]:
    """How the network ended, by reach and condition."""
    lines = []
    for row in found["rows"]:
        ends = row["ends"]
        solved, at_limit = ends.get("SOLVED", 0), ends.get("MAX_ITERATIONS", 0)
        other, exact = row["count"] - solved - at_limit, row["active_set"]
        lines.append((
            f"{row['reach']:g}", f"{row['condition']:.0e}", f"{row['active']:.1f}",
            f"{solved} of {row['count']}", *map(str, (at_limit, other, exact)),
        ))  # fmt: skip
    headings = (
        "least objective off by", "condition of W", "bounds active, mean", "`dtrnn` solves", "at its cap",
        "otherwise", "`active_set` solves",
    )  # fmt: skip
    at_cap, of = found["capped"], found["ill_conditioned"]
    share = f"Condition 1e6 to 1e8: {at_cap} of {of} at the cap, {100.0 * at_cap / of:.0f} %."
    return [Table(title="How the network ends", headings=headings, rows=lines, notes=(share,))]


def measured(given: Any) -> dict[str, Any]:
    """Every row, and the total of the ill-conditioned ones."""
    rows = ended(max(given.count // 10, 1) if given.quick else given.count)
    at_cap, of = capped(rows)
    return {"rows": rows, "capped": at_cap, "ill_conditioned": of}


if __name__ == "__main__":
    parser = study.options(__doc__, "dtrnn_cap", "a tenth of the QPs")
    parser.add_argument("--count", type=int, default=200, help="QPs a row (200)")
    study.on_record(
        parser.parse_args(), "Feasible QPs on which the network ends at its cap", measured, tables,
        ("How often a planner meets such a QP: of the recorded ones of arms `dtrnn-fast` solves all "
         "([accuracy](compare_accuracy.md)).",),
    )  # fmt: skip
