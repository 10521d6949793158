"""What solvers claim of recorded QPs, and what is true: the measuring half of compare_accuracy."""

from collections import Counter
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
from bench.contenders import Contender
from comparison.recorded import Recorded
from comparison.truth import Fact, Truth, relative_residuals

from ftqp.core.checks import FloatArray
from ftqp.qp import Backend, Claim
from ftqp.qp.solving import ACCEPTANCE

COARSE = 1e-3
"""Largest relative residual of an answer that is called coarse and not wrong."""
STARTS = ("cold", "warm")
PARTS = ("primal", "dual", "complementarity", "gap")


class Outcome(StrEnum):
    """A claim against the truth; the value is the heading of a table."""

    RIGHT = "solved, right"
    COARSE = "solved, coarse"
    WRONG = "solved, wrong"
    UNSURE = "gave up, right"
    GAVE_UP = "gave up"
    FALSE_ALARM = "called infeasible"
    FOUND = "called infeasible, right"
    MISSED = "gave up on it"
    CLAIMED = "called solved"
    OPEN = "open"


SOLVABLE = (
    Outcome.RIGHT, Outcome.COARSE, Outcome.WRONG, Outcome.UNSURE, Outcome.GAVE_UP, Outcome.FALSE_ALARM,
)  # fmt: skip
"""What can be said of a solvable QP."""
INFEASIBLE = (Outcome.FOUND, Outcome.MISSED, Outcome.CLAIMED)
"""What can be said of an infeasible QP."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Answers:
    """What one contender said of one sequence of K QPs from one kind of start.

    Attributes:
        claims: The solver's own word, (K,).
        residuals: Relative KKT residuals, (K, 4), inf where there is no answer.
        x: The answers, (K, n), NaN where there is none.
        iterations: Iterations in the solver's own counting, (K,).
    """

    claims: list[Claim]
    residuals: FloatArray
    x: FloatArray
    iterations: list[int]


def answers(solver: Backend, sequence: Recorded, *, start: str) -> Answers:
    """Solve a whole sequence in its order; a warm start is that of the QP before, the first QP is cold."""
    qp = sequence.buffers()
    solver.setup(qp)
    claims, iterations = [], []
    found = np.full((len(sequence), 4), np.inf)
    points = np.full((len(sequence), qp.n), np.nan)
    for k, problem in enumerate(sequence.problems):
        qp.flat[:] = sequence.packed[k]  # the solution stays: some solvers start from it
        claims.append(Claim(solver.solve(cold=start == "cold" or k == 0)))
        iterations.append(int(solver.iterations))
        if claims[-1] <= Claim.MAX_ITERATIONS:
            found[k] = relative_residuals(problem, qp.x, qp.y, qp.z, qp.z_box)
            points[k] = qp.x
    return Answers(claims=claims, residuals=found, x=points, iterations=iterations)


def every_answer(who: Contender, sequence: Recorded) -> list[Answers]:
    """What a contender says from each kind of start.

    Raises:
        FtqpError: It cannot take this sequence.
    """
    solver = who.made()
    return [answers(solver, sequence, start=start) for start in STARTS]


def outcome(claim: Claim, residual: float, fact: Fact) -> Outcome:
    """A claim against the truth."""
    if fact is Fact.OPEN:
        return Outcome.OPEN
    if fact is Fact.INFEASIBLE:
        if claim is Claim.SOLVED:
            return Outcome.CLAIMED
        return Outcome.FOUND if claim is Claim.INFEASIBLE else Outcome.MISSED
    if claim is Claim.INFEASIBLE:
        return Outcome.FALSE_ALARM
    good = residual <= ACCEPTANCE
    if claim is not Claim.SOLVED:
        return Outcome.UNSURE if good else Outcome.GAVE_UP
    if good:
        return Outcome.RIGHT
    return Outcome.COARSE if residual <= COARSE else Outcome.WRONG


def summed_up(
    contender: Contender, sequence: Recorded, start: str, said: Answers, true: Truth
) -> dict[str, Any]:
    """One cell of the result: outcomes, residuals and errors of the answers claimed solved, iterations.

    Residuals and errors are [median, largest]; errors are |x - x_ref| / (1 + |x_ref|), largest entries.
    """
    outcomes = [
        outcome(claim, float(found.max()), fact)
        for claim, found, fact in zip(said.claims, said.residuals, true.facts, strict=True)
    ]
    solved = np.array(
        [one in (Outcome.RIGHT, Outcome.COARSE, Outcome.WRONG) for one in outcomes], dtype=np.bool_
    )
    measurable = solved & np.isfinite(true.references).all(axis=1)
    size = 1.0 + np.abs(true.references[measurable]).max(axis=1, initial=0.0)
    errors = np.abs(said.x[measurable] - true.references[measurable]).max(axis=1, initial=0.0) / size
    return {
        "contender": contender.name,
        "sequence": sequence.name,
        "start": start,
        "outcomes": {one.value: count for one, count in Counter(outcomes).items()},
        "residuals": {part: spread(said.residuals[solved, i]) for i, part in enumerate(PARTS)},
        "error": spread(errors),
        "iterations": spread(np.array(said.iterations, dtype=np.float64)),
    }


def spread(values: FloatArray) -> list[float] | None:
    """[median, largest]; None for no values."""
    return [float(np.median(values)), float(values.max())] if len(values) else None


def settled(true: Truth, every: list[Answers]) -> Truth:
    """Open questions answered by any answer with small residuals: such a QP is solvable."""
    facts = [
        Fact.SOLVABLE
        if fact is Fact.OPEN and any(said.residuals[k].max() <= ACCEPTANCE for said in every)
        else fact
        for k, fact in enumerate(true.facts)
    ]
    return replace(true, facts=facts)
