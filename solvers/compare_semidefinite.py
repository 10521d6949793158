"""QPs that no planner poses: H may be semidefinite, nothing need be bounded, some have no solution.

    python solvers/compare_semidefinite.py [--sets DIR] [--quick] [--out DIR] [--json]

Random QPs of 3 to 30 variables with a solution that is known: H = F'F of any rank below full, times 1e-3 to
1e3, hard equalities, two-sided rows, no box. Random QPs whose rows contradict each other by a margin. And,
with --sets, what fits ``active_set`` of the sets of Maros and Meszaros and of model predictive control, as
qpsolvers keeps them; clone them into DIR:

    git clone https://github.com/qpsolvers/maros_meszaros_qpbenchmark DIR/maros_meszaros_qpbenchmark
    git clone https://github.com/qpsolvers/mpc_qpbenchmark DIR/mpc_qpbenchmark

Backends are taken with default settings or a profile, cold, through ``ftqp.qp.solve``, which judges by
residuals. Half a minute on one core. Results go to ``solvers/results`` unless --out says otherwise.
"""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from bench import results, study
from bench.contenders import Contender, contenders
from bench.tables import Table
from scipy.io import loadmat

from ftqp.qp import QP, SolveStatus, solve

CONTENDERS = ("active_set", "daqp", "daqp-accurate", "qpsolvers:clarabel", "clarabel-accurate")
"""Backends with their default settings, and the accurate profiles of two of them."""
VARIABLES, EQUALITIES, TWO_SIDED = 128, 64, 512
"""What ``active_set`` holds."""
COUNT, QUICK = 1000, 20
MARGINS = (1.0, 1e-1, 1e-2, 1e-3, 1e-4)
INFINITE, EQUAL = 9e19, 1e-10
"""In the sets of Maros and Meszaros a bound from here on is none, and bounds this near are one."""
LIMITATIONS = (
    "Settings are defaults or the profiles here; a maintainer may know better. One cold solve each.",
    "Times are those of `ftqp.qp.solve` as a whole: set-up, conversion, solve and the check of the answer.",
)


def flat_qp(seed: int) -> QP:
    """A QP with a semidefinite H, no box, and a solution."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 31))
    rank, m, p = int(rng.integers(1, n)), int(rng.integers(0, n // 3 + 2)), int(rng.integers(0, 2 * n))
    F = rng.normal(size=(rank, n))
    H = F.T @ F * 10.0 ** rng.uniform(-3.0, 3.0)
    A, C, x = rng.normal(size=(m, n)), rng.normal(size=(p, n)), rng.normal(size=n)
    l, u, z = C @ x - rng.uniform(0.0, 1.0, p), C @ x + rng.uniform(0.0, 1.0, p), np.zeros(p)
    active = rng.random(p) < 0.3
    u[active], z[active] = (C @ x)[active], rng.uniform(0.1, 2.0, active.sum())
    return QP(
        H, -(H @ x + A.T @ rng.normal(size=m) + C.T @ z), A, A @ x, C if p else None, *((l, u) if p else ())
    )


def contradicting_qp(seed: int, margin: float) -> QP:
    """A QP whose rows, weighted and added, ask for less than 0 by a margin; half have a box, too."""
    rng = np.random.default_rng(seed)
    n, p = int(rng.integers(2, 12)), int(rng.integers(2, 20))
    m, some = int(rng.integers(0, n // 2 + 1)), int(rng.integers(1, p))
    A, C, x = rng.normal(size=(m, n)), rng.normal(size=(p, n)), rng.normal(size=n)
    weights = np.where(np.arange(p) < some, rng.uniform(0.1, 1.0, p), 0.0)
    u, b, mu = C @ x + np.where(weights > 0.0, 0.0, rng.uniform(0.0, 1.0, p)), A @ x, rng.normal(size=m)
    last, below = -(weights @ C + mu @ A), -(weights @ u + mu @ b) - margin
    box = (x - 10.0, x + 10.0) if rng.random() < 0.5 else (None, None)
    return QP(np.eye(n), rng.normal(size=n), A, b, np.vstack([C, last]), None, np.append(u, below), *box)


def maros_meszaros(folder: Path) -> Iterator[QP]:
    """What fits ``active_set`` of the sets of Maros and Meszaros."""
    for path in sorted((folder / "maros_meszaros_qpbenchmark" / "data").glob("*.mat")):
        data = loadmat(path)
        n = int(data["n"].item())
        low, high = (np.array(data[name], float).ravel() for name in ("l", "u"))
        low[low < -INFINITE], high[high > INFINITE] = -np.inf, np.inf
        equal = high[:-n] - low[:-n] < EQUAL
        if n <= VARIABLES and equal.sum() <= EQUALITIES and (~equal).sum() <= TWO_SIDED:
            rows = data["A"].toarray().astype(float)[:-n]
            yield QP(
                data["P"].toarray().astype(float), np.array(data["q"], float).ravel(),
                rows[equal], high[:-n][equal], rows[~equal], low[:-n][~equal], high[:-n][~equal],
                low[-n:], high[-n:],
            )  # fmt: skip


def predictive_control(folder: Path) -> Iterator[QP]:
    """What fits ``active_set`` of the set of model predictive control."""
    for path in sorted((folder / "mpc_qpbenchmark" / "data").glob("*.npz")):
        with np.load(path, allow_pickle=True) as data:
            given = {name: data[name] if data[name].ndim else None for name in data.files}
        if len(given["q"]) <= VARIABLES and len(given["h"]) <= TWO_SIDED:
            part = given.get
            yield QP(
                part("P"), part("q"), part("A"), part("b"), part("G"), None, part("h"), part("lb"), part("ub")
            )


def row(title: str, who: Contender, problems: list[QP], wanted: SolveStatus) -> dict[str, Any]:
    """How a backend ended on problems, and how long it took [ms]."""
    ends, times = [], []
    for problem in problems:
        began = time.perf_counter()
        ends.append(solve(problem, who.settings).status)
        times.append(1e3 * (time.perf_counter() - began))
    return {
        "set": title, "backend": who.name, "right": sum(one is wanted for one in ends), "of": len(ends),
        "ends": sorted({one.name for one in ends}), "median": float(np.median(times)), "worst": max(times),
    }  # fmt: skip


def measured(given: Any) -> dict[str, Any]:
    """Every backend on every set."""
    count, solved, empty = QUICK if given.quick else COUNT, SolveStatus.SOLVED, SolveStatus.INFEASIBLE
    sets: list[tuple[str, Callable[[], Iterator[QP]], SolveStatus]] = [
        ("random, semidefinite", lambda: (flat_qp(k) for k in range(count)), solved)
    ]
    if given.sets is not None:
        sets += [("Maros and Meszaros", lambda: maros_meszaros(given.sets), solved)]
        sets += [("model predictive control", lambda: predictive_control(given.sets), solved)]
    for margin in MARGINS:
        made = lambda margin=margin: (contradicting_qp(k, margin) for k in range(count // 10))  # noqa: E731
        sets.append((f"infeasible by {margin:g}", made, empty))
    rows, chosen = [], contenders(CONTENDERS)
    for title, problems, wanted in sets:
        found = list(problems())
        rows += [row(title, who, found, wanted) for who in chosen if found]
    settings = {who.name: who.settings for who in chosen}
    return {"versions": results.versions(chosen), "contenders": settings, "rows": rows}


def tables(found: dict[str, Any]) -> list[Table]:
    """A row for each set and backend."""
    lines = [
        (one["set"], one["backend"], f"{one['right']} of {one['of']}", f"{one['median']:.2f}",
         f"{one['worst']:.1f}")
        for one in found["rows"]
    ]  # fmt: skip
    headings = ("set", "backend", "right", "median [ms]", "worst [ms]")
    note = "Right: solved to the residuals of `ftqp.qp.accepted`, or proven infeasible."
    return [Table(title="By set and backend", headings=headings, rows=lines, notes=(note,))]


if __name__ == "__main__":
    parser = study.options(__doc__, "compare_semidefinite", f"{QUICK} random QPs in place of {COUNT}")
    cloned = "where the two sets were cloned (default: neither)"
    parser.add_argument("--sets", type=Path, metavar="DIR", help=cloned)
    given = parser.parse_args()
    study.on_record(given, "QPs that no planner poses", measured, tables, LIMITATIONS)
