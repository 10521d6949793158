"""What study_dtrnn says: tables and the report."""

from typing import Any

from bench import docs
from bench.tables import Table, exponent
from comparison.dtrnn_study import JUMPING, METHODS, PRODUCT, SCALED, SCALED_LVI, cells
from comparison.dtrnn_study_problems import OBJECTIVES

EXPECTED: dict[tuple[str, str], tuple[tuple[int, int, int] | int, ...]] = {
    ("94lvi", "cold"): ((478, 741, 1338), (2803, 8198, 12639), (5243, 11800, 14165), 149, 5),
    ("94lvi", "warm"): ((203, 364, 744), (244, 2318, 8246), (1362, 3700, 7384), 141, 11),
    ("implicit", "cold"): ((173, 366, 729), (221, 538, 850), (1383, 2854, 3435), 58, (413, 979, 6163)),
    (SCALED, "cold"): ((24, 25, 39), (57, 171, 248), (91, 173, 192), (248, 833, 3156), (173, 458, 1144)),
    (SCALED, "warm"): ((13, 14, 24), (12, 51, 176), (37, 91, 147), (100, 649, 3252), (72, 242, 18231)),
    (JUMPING, "warm"): ((1, 1, 1), (1, 1, 36), (1, 6, 46), (1, 31, 721), (1, 26, 19316)),
}
"""Iterations of each of ``OBJECTIVES`` by the independent program that the methods were chosen with.

Median, 95 % value and largest, or how many did not converge; the table of ``docs/evidence/jin2017.md``.
"""
SHORT = {
    "94lvi": "94lvi", "e47": "e47", "implicit": "implicit", SCALED: "+ scaling", JUMPING: "+ Newton",
    PRODUCT: "product", SCALED_LVI: "94lvi scaled",
}  # fmt: skip
LIMITATIONS = (
    "An iteration of implicit costs one solve with a factored matrix, one of 94lvi or e47 two products; a "
    "Newton jump factors a matrix. Iterations are not time.",
    "|e| is measured on the scale that the network works on: the same tolerance is another accuracy of x "
    "with scaling than without. Where it says 'until x is right' the goal is the same for all.",
    "A solve that runs into the cap counts with the cap in medians; the cap is 20000, for product mode 2000.",
    "The random QPs have 7 variables, 3 equalities and directions without structure; an arm's W and A are "
    "related. The recorded sequences are our planner's.",
    "Iterations until x is right are found by bisection, as if the error fell monotonically.",
    "MTN is chaotic: a change of 1e-9 rad in the start changes which QPs the path has, and with them the "
    "tail of the counts.",
    "A jump of '+ Newton' is one Newton step at every fifth iteration, taken when it halves |e|, as the "
    "expected figures have it. A jump of product mode is a row of Newton steps, each with a factorisation, "
    "taken when it solves the QP, and counts as one iteration: never compare its iterations with the others' "
    "as work.",
)


def number(value: float, cap: int, capped: int = 1) -> str:
    """A number of iterations; the cap is more than that many."""
    return f">{cap}" if capped and value >= cap else f"{value:.0f}"


def triple(cell: dict[str, Any]) -> str:
    """Median, 95 % value, maximum."""
    return "/".join(number(cell[key], cell["cap"], cell["capped"]) for key in ("median", "p95", "max"))


def tables(result: dict[str, Any]) -> list[Table]:
    """Those of the parts that were measured; the first is the one for the README."""
    made = {"square": _square, "recorded": _recorded, "condition": _conditions}
    present = {cell["part"] for cell in result["cells"]}
    return [table for part, tables_of in made.items() if part in present for table in tables_of(result)]


def _square(result: dict[str, Any]) -> list[Table]:
    found = cells(result, "square")
    rows = []
    for objective in dict.fromkeys(cell["objective"] for cell in found):
        for start in ("cold", "warm"):
            row = {c["method"]: c for c in cells(result, "square", objective=objective, start=start)}
            texts = [
                "/".join(number(row[m][key], row[m]["cap"], row[m]["capped"]) for key in ("median", "max"))
                for m in METHODS
            ]
            rows.append((f"{objective} {start}", *texts))
    overview = Table(
        title="Iterations on the square of Jin et al. 2017 (median/largest)",
        headings=("", *(SHORT[m] for m in METHODS)),
        rows=rows,
        notes=(
            "cold: every tenth of 2001 QPs; warm: all, each from the answer before (MTN with 94lvi and e47: "
            "every tenth). Stop at |e| <= 1e-5, + Newton 1e-9.",
            "+ scaling: implicit with the scaling rule; + Newton: with jumps, too; product: the backend as "
            "it comes, where a jump of several Newton steps counts as one iteration.",
        ),
    )
    return [overview, _against_expected(result, found)]


def _against_expected(result: dict[str, Any], found: list[dict[str, Any]]) -> Table:
    rows = []
    by_key = {(cell["objective"], cell["method"], cell["start"]): cell for cell in found}
    for (method, start), expected in EXPECTED.items():
        for objective, said in zip(OBJECTIVES, expected, strict=True):
            cell = by_key.get((objective, method, start))
            if cell is None:
                continue
            texts = [f"{objective}, {SHORT[method]}, {start}", triple(cell)]
            capped = f"{cell['capped']} of {cell['count']}" if cell["capped"] else ""
            if isinstance(said, int):
                texts += [capped, f"{said} of {cell['count']}", "", "", ""]
            else:
                texts += [capped, "/".join(map(str, said))]
                texts += [
                    f"{100.0 * (cell[key] / value - 1.0):+.0f}"
                    for key, value in zip(("median", "p95", "max"), said, strict=True)
                ]
            rows.append(tuple(texts))
    return Table(
        title="Against the expected figures (median/95 %/largest, or how many ran into the cap)",
        headings=("", "measured", "capped", "expected", "by", "by", "by"),
        rows=rows,
        notes=(
            "Expected: the figures of the time when the methods were chosen, where there are any. By: how "
            "much the median, the 95 % value and the largest differ from them [percent].",
        ),
    )


def _recorded(result: dict[str, Any]) -> list[Table]:
    found = cells(result, "recorded")
    rows = []
    for method in dict.fromkeys(cell["method"] for cell in found):
        for start in ("cold", "warm"):
            mine = [cell for cell in found if (cell["method"], cell["start"]) == (method, start)]
            total = {
                key: sum(cell[key] for cell in mine)
                for key in ("solvable", "solved", "false_alarms", "infeasible", "found", "called_solved")
            }
            rows.append((f"{SHORT[method]} {start}", *map(str, total.values())))
    claims = Table(
        title="Certificates on the recorded sequences (number of QPs)",
        headings=("", "solvable", "converged", "called infeasible", "infeasible", "found", "called solved"),
        rows=rows,
        notes=("The network's own word against the truth; 'converged' is the stopping rule of its mode.",),
    )
    return [claims, _by_sequence(found)]


def _by_sequence(found: list[dict[str, Any]]) -> Table:
    methods = list(dict.fromkeys(cell["method"] for cell in found))
    rows = []
    for name in dict.fromkeys(cell["sequence"] for cell in found):
        row = {cell["method"]: cell for cell in found if (cell["sequence"], cell["start"]) == (name, "cold")}
        rows.append((name, *(number(row[m]["median"], row[m]["cap"], row[m]["capped"]) for m in methods)))
    return Table(
        title="Iterations on the recorded sequences, cold (median)",
        headings=("", *(SHORT[m] for m in methods)),
        rows=rows,
        notes=(
            "94lvi scaled: 94lvi under the scaling rule of implicit. Infeasible QPs end with a certificate.",
        ),
    )


def _conditions(result: dict[str, Any]) -> list[Table]:
    made = []
    goals = {
        "until the variant stops": lambda cell: number(cell["median"], cell["cap"], cell["capped"]),
        "until x is right to 1e-5": lambda cell: number(cell["right"][0], cell["cap"]),
    }
    for part, what in (("condition", "condition of W"), ("active", "active bounds")):
        for goal, text in goals.items():
            rows = []
            for at in dict.fromkeys(cell["at"] for cell in cells(result, part)):
                row = {cell["method"]: cell for cell in cells(result, part, at=at)}
                label = exponent(at) if part == "condition" else f"{at}"
                rows.append((label, *(text(row[method]) for method in METHODS)))
            other = "one active bound" if part == "condition" else "condition 1e3, 4 degrees of freedom"
            made.append(
                Table(
                    title=f"Iterations against {what}, {goal}",
                    headings=(what, *(SHORT[method] for method in METHODS)),
                    rows=rows,
                    notes=(f"Random QPs, 7 variables, 3 equalities, {other}, cold, medians.",),
                )
            )
    return [*made, _tolerances(result)]


def _tolerances(result: dict[str, Any]) -> Table:
    methods = [m for m in METHODS if m != PRODUCT]
    rows = []
    for at in dict.fromkeys(cell["at"] for cell in cells(result, "tolerance")):
        row = {cell["method"]: cell for cell in cells(result, "tolerance", at=at)}
        texts = [
            f"{number(row[m]['median'], row[m]['cap'], row[m]['capped'])}, {exponent(row[m]['error'][0])}"
            for m in methods
        ]
        rows.append((exponent(at), *texts))
    return Table(
        title="Iterations against the tolerance of |e|, random QPs (median, median error of x)",
        headings=("tolerance", *(SHORT[m] for m in methods)),
        rows=rows,
        notes=("Condition 1e3, one active bound, cold.",),
    )


def markdown(result: dict[str, Any]) -> str:
    """The whole report."""
    return docs.report("How the recurrent network converges", result, tables(result))
