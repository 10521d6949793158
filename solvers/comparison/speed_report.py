"""What compare_speed says: tables and the report."""

from math import exp, log
from statistics import fmean, median
from typing import Any

from bench import docs
from bench.contenders import REFERENCE
from bench.tables import Table, quantity
from comparison.speed import EMPTY

SUMMARY = (
    "", "set-up", "cold p50", "warm p50", "warm p99", "worst", f"x {REFERENCE}", "solved %",
)  # fmt: skip
DETAILS = (
    "", "set-up", "cold p50", "p99", "worst", "warm p50", "p99", "worst", "own", f"x {REFERENCE}",
    "solved %",
)  # fmt: skip
LIMITATIONS = (
    "The profiles of the external solvers were chosen on these same QPs, by trying a few settings of each: "
    "they show what can be reached here, not what to expect of QPs that nobody has seen.",
    "Microseconds belong to this machine; ratios within one run carry over better.",
    "Every solver is driven through ftqp's Backend interface, as the planner drives the external ones: the "
    "time is that of solve(cold=...) on buffers that already hold the QP. The row 'empty' is what that "
    "interface costs without a solver; column 'own' has it taken off.",
    "active_set and dtrnn are driven through the same interface here, to be comparable. Inside the planner "
    "they run in the compiled step, without Python, without copies and with task rows that need no slack "
    "variable: bench_step.py measures that.",
    "Solvers behind qpsolvers are set up anew at every call and have no warm start, and most of their time "
    "is conversion; a binding of their own would be faster. quadprog has no warm start either.",
    "A time counts whether the answer is right or not: read it with the column 'solved', the share of "
    "solvable QPs whose residuals are small. Sequences with infeasible QPs are left out of the summary and "
    "have tables below.",
    "A warm start is that of the QP before; the first QP of each pass is solved cold and not counted.",
    "All contenders run in one process on one core in turns; the first solves of each turn are not counted, "
    "so caches are warm. A solver that crashes the process ends the run.",
    "A contender that is slow has fewer samples (see the JSON); no p99 is given for fewer than 100. The "
    "worst time on a shared or virtual machine is mostly its interrupts: compare with 'empty'.",
)


def _cells(result: dict[str, Any], **wanted: str) -> list[dict[str, Any]]:
    return [cell for cell in result["cells"] if all(cell[key] == value for key, value in wanted.items())]


def _solvable(result: dict[str, Any]) -> list[str]:
    """Sequences without an infeasible QP."""
    return [name for name, about in result["sequences"].items() if not about["infeasible"]]


def present(result: dict[str, Any]) -> list[str]:
    """The contenders that have results, the empty one first."""
    names = (EMPTY, *result["contenders"])
    return [name for name in names if _cells(result, contender=name)]


def ratio(result: dict[str, Any], contender: str, sequence: str, start: str) -> float | None:
    """Its p50 over that of the reference on the same QPs in the same run."""
    own = _cells(result, contender=contender, sequence=sequence, start=start)
    reference = _cells(result, contender=REFERENCE, sequence=sequence, start=start)
    return own[0]["p50"] / reference[0]["p50"] if own and reference else None


def _mean(values: list[float | None]) -> float | None:
    """Geometric mean; None without values."""
    given = [value for value in values if value]
    return exp(fmean(log(value) for value in given)) if given else None


def _largest(values: list[float | None]) -> float | None:
    return max((value for value in values if value is not None), default=None)


def tables(result: dict[str, Any]) -> list[Table]:
    """The summary over all sequences without infeasible QPs."""
    chosen = _solvable(result)
    rows = []
    for name in present(result):
        cold, warm = (
            [cell for cell in _cells(result, contender=name, start=start) if cell["sequence"] in chosen]
            for start in ("cold", "warm")
        )
        if not warm:
            continue
        both = [ratio(result, name, cell["sequence"], "warm") for cell in warm]
        solved = "-" if name == EMPTY else quantity(fmean(cell["solved"] for cell in (*cold, *warm)), 4)
        rows.append(
            (
                name,
                quantity(median(cell["setup"] for cell in warm)),
                quantity(_mean([cell["p50"] for cell in cold])),
                quantity(_mean([cell["p50"] for cell in warm])),
                quantity(_largest([cell["p99"] for cell in warm])),
                quantity(_largest([cell["worst"] for cell in (*cold, *warm)])),
                "-" if name == EMPTY else quantity(_mean(both)),
                solved,
            )
        )
    return [
        Table(
            title=f"One solve [us], over {len(chosen)} sequences without infeasible QPs",
            headings=SUMMARY,
            rows=rows,
            notes=(
                f"p50, x {REFERENCE} (warm p50 over that of {REFERENCE}): geometric means over sequences; "
                "p99: of the slowest sequence; worst: of all, cold or warm; solved: residuals are small.",
            ),
            bold=REFERENCE,
        )
    ]


def by_sequence(result: dict[str, Any]) -> list[Table]:
    """A table a sequence."""
    found = []
    for sequence, about in result["sequences"].items():
        rows = []
        for name in present(result):
            cells = {cell["start"]: cell for cell in _cells(result, contender=name, sequence=sequence)}
            if not cells:
                continue
            cold, warm = cells["cold"], cells["warm"]
            base = _cells(result, contender=EMPTY, sequence=sequence, start="warm")[0]["p50"]
            times = [cell[part] for cell in (cold, warm) for part in ("p50", "p99", "worst")]
            rows.append(
                (
                    name,
                    quantity(warm["setup"]),
                    *(quantity(value) for value in times),
                    "-" if name == EMPTY else quantity(max(warm["p50"] - base, 0.0)),
                    "-" if name == EMPTY else quantity(ratio(result, name, sequence, "warm")),
                    "-" if name == EMPTY else quantity(warm["solved"], 4),
                )
            )
        n, m, p = about["size"]
        told = f", {about['infeasible']} of them infeasible" if about["infeasible"] else ""
        found.append(
            Table(
                title=f"{sequence}: {about['qps']} QPs{told}, n = {n}, m = {m}, p = {p} [us]",
                headings=DETAILS,
                rows=rows,
                bold=REFERENCE,
            )
        )
    return found


def markdown(result: dict[str, Any]) -> str:
    """The whole report."""
    return docs.report("Time of QP solvers on recorded QPs", result, [*tables(result), *by_sequence(result)])
