"""What compare_accuracy says: tables and the report."""

from collections import Counter
from typing import Any

import numpy as np
from bench.contenders import REFERENCE
from bench.tables import Table, counted, exponent
from comparison.accuracy import COARSE, INFEASIBLE, PARTS, SOLVABLE, STARTS, Outcome

from ftqp.qp.solving import ACCEPTANCE

LIMITATIONS = (
    "The profiles of the external solvers were chosen on these same QPs, by trying a few settings of each: "
    "they show what can be reached here, not what to expect of QPs that nobody has seen.",
    "The QPs are those of ftqp's planner on these robots: small, dense, strictly convex but for rounding, "
    "with bounds on every joint. Another problem class may rank the solvers differently.",
    f"Right means that every KKT residual is at most {exponent(ACCEPTANCE)} of 1 + the size of what is "
    f"compared, as the planner demands it; coarse is up to {exponent(COARSE)}. A profile with looser "
    "tolerances is called coarse for doing what it was asked to do.",
    "Whether a QP is solvable is proven: by a solution with small residuals, or by a Farkas certificate "
    "whose arithmetic is checked; where neither is there, the linear program of the recorder decides. A QP "
    "that is infeasible by less than 1e-6 counts as solvable.",
    "The error of x is measured against the recorded solution where that one's residuals are below 1e-9. It "
    "is the better of active_set's and daqp's: their own errors only say how far these two disagree. "
    "With an ill-conditioned objective (mtn) x can be off by much more than the residuals.",
    "qpsolvers says only whether there is a solution: through it an infeasible QP is given up, never called "
    "infeasible. It has no warm start.",
    "The planner checks every answer itself and counts the claim of no solver; a wrong claim costs it a "
    "fallback step and not a wrong motion.",
)


def _totals(result: dict[str, Any], contender: str, start: str) -> Counter[str]:
    total: Counter[str] = Counter()
    for cell in result["cells"]:
        if cell["contender"] == contender and cell["start"] == start:
            total.update(cell["outcomes"])
    return total


def present(result: dict[str, Any]) -> list[str]:
    """The contenders that have results, in their order."""
    return [
        name for name in result["contenders"] if any(cell["contender"] == name for cell in result["cells"])
    ]


def _claims(result: dict[str, Any], kinds: tuple[Outcome, ...], title: str, notes: tuple[str, ...]) -> Table:
    rows = []
    for name in present(result):
        cold, warm = (_totals(result, name, start) for start in STARTS)
        rows.append((name, *(counted(cold[kind.value], warm[kind.value]) for kind in kinds)))
    return Table(
        title=title,
        headings=("", *(kind.value for kind in kinds)),
        rows=rows,
        notes=notes,
        bold=REFERENCE,
    )


def _worst(result: dict[str, Any]) -> Table:
    """Residuals and errors over all sequences: the median of medians and the largest."""
    rows = []
    for name in present(result):
        cells = [cell for cell in result["cells"] if cell["contender"] == name]
        spreads = [[cell["residuals"][part] for cell in cells] for part in PARTS]
        spreads.append([cell["error"] for cell in cells])
        rows.append((name, *(_both(found) for found in spreads)))
    return Table(
        title="Answers that were claimed solved, on solvable QPs: median and largest",
        headings=("", "primal", "dual", "complementary", "gap", "error of x"),
        rows=rows,
        notes=(
            "KKT residuals, relative to 1 + the size of what is compared; error |x - x_ref| / (1 + |x_ref|).",
        ),
        bold=REFERENCE,
    )


def _both(found: list[list[float] | None]) -> str:
    given = [one for one in found if one is not None]
    if not given:
        return "-"
    middle, worst = float(np.median([one[0] for one in given])), max(one[1] for one in given)
    return f"{exponent(middle)} {exponent(worst):>6}"


def tables(result: dict[str, Any]) -> list[Table]:
    """Claims on solvable QPs, claims on infeasible ones, residuals; the first is the one for the README."""
    facts = [about["facts"] for about in result["sequences"].values()]
    solvable, infeasible, still_open = (
        sum(fact[kind] for fact in facts) for kind in ("solvable", "infeasible", "open")
    )
    differs = "a / b: a from cold starts, b from warm ones, where they differ."
    unsettled = (
        (f"{still_open} QPs are neither proven solvable nor infeasible and left out.",) if still_open else ()
    )
    found = [
        _claims(
            result, SOLVABLE, f"Claims about {solvable} solvable QPs (number of QPs)", (differs, *unsettled)
        )
    ]
    if infeasible:
        title = f"Claims about {infeasible} QPs that are proven infeasible (number of QPs)"
        found.append(_claims(result, INFEASIBLE, title, (differs,)))
    return [*found, _worst(result)]


def every_table(result: dict[str, Any]) -> list[Table]:
    """Those, the sequences, and the same sequence by sequence."""
    return [*tables(result), _sequences(result), *_by_sequence(result)]


_FACTS = (
    "", "variables", "equalities", "rows", "solvable", "infeasible", "open", "violation", "reference",
)  # fmt: skip


def _sequences(result: dict[str, Any]) -> Table:
    rows = []
    for name, about in result["sequences"].items():
        facts, size = about["facts"], about["size"]
        proven = exponent(about["median_violation"]) if facts["infeasible"] else "-"
        counts = (f"{facts['solvable']}", f"{facts['infeasible']}", f"{facts['open']}")
        rows.append((name, *map(str, size), *counts, proven, exponent(about["worst_reference"])))
    return Table(
        title="The sequences",
        headings=_FACTS,
        rows=rows,
        notes=(
            "violation: what at least one constraint of an infeasible QP must give, median, in its own unit; "
            "reference: largest relative residual of the recorded solutions.",
        ),
    )


def share(result: dict[str, Any], contender: str, sequence: str) -> float | None:
    """Percent of answers, cold and warm, that a planner can use: right, or infeasibility told."""
    total: Counter[str] = Counter()
    for cell in result["cells"]:
        if cell["contender"] == contender and cell["sequence"] == sequence:
            total.update(cell["outcomes"])
    known = sum(total.values()) - total[Outcome.OPEN.value]
    if not known:
        return None
    return 100.0 * (total[Outcome.RIGHT.value] + total[Outcome.FOUND.value]) / known


def _by_sequence(result: dict[str, Any]) -> list[Table]:
    names = present(result)
    shares, errors = [], []
    for sequence in result["sequences"]:
        found = [share(result, name, sequence) for name in names]
        shares.append((sequence, *("-" if one is None else f"{_rounded(one)}" for one in found)))
        cells = {
            name: [
                cell["error"][1]
                for cell in result["cells"]
                if cell["contender"] == name and cell["sequence"] == sequence and cell["error"]
            ]
            for name in names
        }
        errors.append((sequence, *(exponent(max(cells[name])) if cells[name] else "-" for name in names)))
    return [
        Table(title="Right answers by sequence (percent)", headings=("", *names), rows=shares),
        Table(title="Largest relative error of x by sequence", headings=("", *names), rows=errors),
    ]


def _rounded(percent: float) -> str:
    """Whole percent, but 100 only for all and 0 only for none."""
    if percent in (0.0, 100.0):
        return f"{percent:.0f}"
    return f"{min(max(percent, 1.0), 99.0):.0f}"
