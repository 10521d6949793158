"""What study_dtrnn measures: one function a part, each returning its entries of the result."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from comparison.dtrnn_study import (
    EXPLICIT,
    JUMPING,
    METHODS,
    SCALED_LVI,
    Spent,
    along,
    each,
    settings,
    until_right,
)  # fmt: skip
from comparison.dtrnn_study_problems import (
    OBJECTIVES,
    ROWS,
    VARIABLES,
    random_qp,
    square,
)
from comparison.recorded import recorded
from comparison.sequences import sequences
from comparison.truth import Fact, truth

from ftqp.core.checks import FloatArray
from ftqp.qp import QP, Claim

STARTS = ("cold", "warm")
EVERY = 10
"""Ticks between two QPs of the square that are solved cold."""
NEWTON_TOLERANCE = 1e-9
"""Of |e|, of the variant with jumps on the square."""
CONDITIONS = tuple(10.0**k for k in range(11))
CONDITION = 1e3
"""Of W, where something else varies."""
ACTIVE = 1
"""Active bounds, where something else varies."""
TOLERANCES = tuple(10.0**-k for k in range(2, 11))
QUICK_SEQUENCES = (
    "panda-degraded", "panda-healthy", "panda-infeasible", "panda-too-fast",
    "planar6-infeasible", "planar6-mtn", "planar6-moving-bounds",
)  # fmt: skip
QUICK_CAP = 4000
"""Most iterations of a quick run's variants of the paper, on the recorded sequences."""


def on_square(objective: str) -> Iterator[dict[str, Any]]:
    """Every variant on the square, cold on every tenth QP and warm on all of them.

    The explicit methods, of which most solves with MTN run into the cap, are warm on every tenth QP there.
    """
    sequence, breaks = square(objective)
    for method in METHODS:
        chosen = settings(method, **({"tolerance": NEWTON_TOLERANCE} if method == JUMPING else {}))
        for start in STARTS:
            rare = start == "cold" or (objective == "MTN" and method in EXPLICIT)
            spent = along(sequence, chosen, warm=start == "warm", breaks=breaks, step=EVERY if rare else 1)
            yield spent.cell(part="square", objective=objective, method=method, start=start)


def objectives(quick: bool) -> tuple[str, ...]:
    """The objectives of the square; a quick run has the first two."""
    return OBJECTIVES[:2] if quick else OBJECTIVES


def random_set(count: int, condition: float, active: int) -> list[tuple[QP, FloatArray]]:
    """Random QPs with their solutions; the same ones in every run."""
    rng = np.random.default_rng([count, active, round(np.log10(condition))])
    return [random_qp(rng, condition, active) for _ in range(count)]


def conditions(quick: bool) -> Iterator[dict[str, Any]]:
    """Iterations against the condition of W."""
    for condition in CONDITIONS[::3] if quick else CONDITIONS:
        yield from _difficulty("condition", condition, random_set(_count(quick), condition, ACTIVE))


def active_bounds(quick: bool) -> Iterator[dict[str, Any]]:
    """Iterations against the number of active bounds."""
    for active in range(VARIABLES - ROWS + 1):
        yield from _difficulty("active", active, random_set(_count(quick), CONDITION, active))


def _count(quick: bool) -> int:
    """Random QPs a point."""
    return 8 if quick else 20


def _difficulty(part: str, at: float, problems: list[tuple[QP, FloatArray]]) -> Iterator[dict[str, Any]]:
    """Every variant: iterations by its own stopping rule, and until x is right, [median, largest]."""
    for method in METHODS:
        chosen = settings(method)
        right = [until_right(problem, x, chosen) for problem, x in problems]
        entry = each(problems, chosen).cell(part=part, at=at, method=method)
        yield entry | {"right": [float(np.median(right)), max(right)]}


def tolerances(quick: bool) -> Iterator[dict[str, Any]]:
    """Iterations, and the error that is left, against the tolerance of |e|."""
    problems = random_set(_count(quick), CONDITION, ACTIVE)
    for tolerance in TOLERANCES[::2] if quick else TOLERANCES:
        for method in METHODS:
            if settings(method).paper:
                spent = each(problems, settings(method, tolerance=tolerance))
                yield spent.cell(part="tolerance", at=tolerance, method=method)


def recorded_sequences(quick: bool) -> Iterator[dict[str, Any]]:
    """Every variant on every recorded sequence: iterations, and claims of infeasibility against the truth."""
    for name, recording in sequences(QUICK_SEQUENCES if quick else None, quick=quick).items():
        sequence = recorded(name, recording)
        facts = truth(sequence.problems, sequence.solutions, sequence.feasible).facts
        for method in (*METHODS, SCALED_LVI):
            paper = quick and settings(method).paper
            chosen = settings(method, **({"max_iterations": QUICK_CAP} if paper else {}))
            for start in STARTS:
                spent = along(sequence, chosen, warm=start == "warm", breaks=recording.cold)
                entry = spent.cell(part="recorded", sequence=name, method=method, start=start)
                yield entry | _against(spent, facts)


def _against(spent: Spent, facts: list[Fact]) -> dict[str, int]:
    """Claims against facts: how many QPs of each combination."""
    pairs = list(zip(spent.claims, facts, strict=True))
    return {
        "solvable": facts.count(Fact.SOLVABLE),
        "false_alarms": pairs.count((Claim.INFEASIBLE, Fact.SOLVABLE)),
        "solved": pairs.count((Claim.SOLVED, Fact.SOLVABLE)),
        "infeasible": facts.count(Fact.INFEASIBLE),
        "found": pairs.count((Claim.INFEASIBLE, Fact.INFEASIBLE)),
        "called_solved": pairs.count((Claim.SOLVED, Fact.INFEASIBLE)),
    }
