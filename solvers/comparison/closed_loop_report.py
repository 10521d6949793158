"""What compare_closed_loop says: a table a case, the report."""

from collections.abc import Sequence
from typing import Any

from bench import docs
from bench.contenders import REFERENCE
from bench.tables import Table, quantity
from comparison.closed_loop import AGREEMENT, KEPT, SIMILAR

HEADINGS = (
    "", "step p50", "p99", "max", f"x {REFERENCE}", "joint difference", "max error", "limits",
    "relaxed", "fallback", "iterations", "agrees",
)  # fmt: skip
SHORT = ("", "p50", "p99", "max", "joints", "error", "fb", "agrees")
COLUMNS = (0, 1, 2, 3, 5, 6, 9, 11)
"""The columns that a terminal has space for, and what they are called there."""
UNITS = (
    "p50, p99, max: time of a whole step in us; joints: largest joint difference to active_set in the run in "
    "rad; error: largest task error in um; fb: ticks with a fallback."
)
ALL_UNITS = (
    "Times of a whole step in us; the largest joint difference to active_set in the run in rad; the largest "
    "task error in um; limits exceeded in SI units; relaxed and fallback in ticks; iterations, median/max, "
    "in each solver's own counting."
)
LIMITATIONS = (
    "Microseconds belong to this machine, and other programs may run on it meanwhile; ratios within a case "
    "carry over better. The largest time on a shared or virtual machine is mostly its interrupts.",
    "A step is the whole of planner.step(): checks, kinematics, bounds, assembly, QP, check of the answer, "
    "integration. compare_speed.py times the solvers alone.",
    "Backends run one after the other in one process, each a whole run; the first step of each, in which a "
    "solver may set itself up, counts.",
    "A FALLBACK step is the kernel's work, not the backend's: a run with many of them says little about the "
    "backend.",
    "Solvers behind qpsolvers are set up anew at every step, have no warm start and tell no iterations.",
    f"In a chaotic case joint differences are no measure. A run then agrees when it ends as {REFERENCE}'s, "
    f"no limit is exceeded further, and its task error is at most {SIMILAR:g} times as large.",
)


def tables(result: dict[str, Any]) -> list[Table]:
    """One table a case, narrow enough for a terminal."""
    return [_table(case, result, SHORT, COLUMNS, UNITS) for case in result["cases"]]


def _table(
    case: dict[str, Any], result: dict[str, Any], headings: Sequence[str], columns: Sequence[int], units: str
) -> Table:
    nudged = f"A start {case['nudge']:g} rad away ends up to {case['difference_after_nudge']:.1e} rad away"
    judged = (
        "the case is chaotic, and invariants are compared"
        if case["chaotic"]
        else f"runs agree when their joints differ by at most {AGREEMENT:g} rad"
    )
    cells = [_cells(row) for row in result["cells"] if row["case"] == case["title"]]
    return Table(
        title=f"{case['title']}: {case['robot']}, {case['level']} level, dt {1e3 * case['dt']:g} ms, "
        f"{case['ticks']} ticks",
        headings=headings,
        rows=[[row[column] for column in columns] for row in cells],
        notes=[units, f"{nudged}: {judged}."],
        bold=REFERENCE,
        text_last=True,
    )


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    times, qp, counts = row["step_time_us"], row["qp"], row["status_counts"]
    beyond = [f"{key} by {value:.1g}" for key, value in row["max_limit_violation"].items() if value > KEPT]
    difference = row["joint_difference"]
    return (
        row["contender"],
        *(quantity(times[part]) for part in ("p50", "p99", "max")),
        quantity(row["ratio"], 2),
        "0" if difference == 0.0 else f"{difference:.0e}",
        quantity(1e6 * row["max_position_error"]),
        ", ".join(beyond) or "kept",
        str(counts.get("RELAXED", 0)),
        str(counts.get("FALLBACK", 0)),
        f"{quantity(qp['iterations_median'])}/{quantity(qp['iterations_max'])}"
        if qp["iterations_max"]
        else "-",
        f"no: {row['disagreement']}" if row["disagreement"] else "yes",
    )


def markdown(result: dict[str, Any]) -> str:
    """The whole report."""
    every = range(len(HEADINGS))
    found = [_table(case, result, HEADINGS, every, ALL_UNITS) for case in result["cases"]]
    return docs.report("One scenario under every backend", result, found)
