"""What is true of recorded QPs, whatever a solver says: solvable or not, with a proof of either."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.qp import QP, Certificate, residuals
from ftqp.qp.solving import ACCEPTANCE, infeasibility, scales

REFERENCE_TOLERANCE = 1e-9
"""Largest relative residual of a recorded solution that errors of x are measured against."""
ZERO = 1e-9
"""Largest entry of A'y + C'z + z_box, relative to the largest multiplier, that counts as zero."""


class Fact(IntEnum):
    """What is known of a QP."""

    SOLVABLE = 0
    INFEASIBLE = 1
    OPEN = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """Facts of a sequence of K QPs.

    Attributes:
        facts: What is known of each, (K,).
        violations: How far each infeasible one is from feasible, (K,), 0 for others.
        references: The solution that errors are measured against, (K, n), NaN where there is none.
        worst_reference: The largest relative residual among these solutions.
        disputed: QPs of which the recording says the opposite of what is proven here.
    """

    facts: list[Fact]
    violations: FloatArray
    references: FloatArray
    worst_reference: float
    disputed: int

    def count(self, fact: Fact) -> int:
        """How many QPs this holds for."""
        return self.facts.count(fact)


def truth(
    problems: Sequence[QP],
    solutions: Sequence[tuple[FloatArray, ...]],
    feasible: BoolArray | None = None,
) -> Truth:
    """Facts from recorded solutions and certificates; no solver's word is taken.

    A QP is solvable when the recorded solution has small KKT residuals and infeasible when there is a Farkas
    certificate that ``proves`` accepts. What neither settles is what the recording says of it, or open.

    Args:
        problems: The QPs, K.
        solutions: (x, y, z, z_box) of each; NaN where there is none.
        feasible: What a linear program said when they were recorded, (K,), or None.
    """
    facts, references, worst, disputed = [], [], 0.0, 0
    violations = np.zeros(len(problems))
    for k, (problem, solution) in enumerate(zip(problems, solutions, strict=True)):
        size = float(relative_residuals(problem, *solution).max())
        reference = np.full(problem.n, np.nan)
        fact = Fact.SOLVABLE if size <= ACCEPTANCE else Fact.OPEN
        if size <= REFERENCE_TOLERANCE:
            reference, worst = solution[0], max(worst, size)
        if fact is Fact.OPEN:
            certificate = infeasibility(problem)
            if certificate is not None and proves(problem, certificate):
                fact, violations[k] = Fact.INFEASIBLE, certificate.violation
        if feasible is not None:
            said = Fact.SOLVABLE if feasible[k] else Fact.INFEASIBLE
            disputed += fact not in (Fact.OPEN, said)
            fact = said if fact is Fact.OPEN else fact
        facts.append(fact)
        references.append(reference)
    return Truth(
        facts=facts,
        violations=violations,
        references=np.array(references),
        worst_reference=worst,
        disputed=disputed,
    )


def proves(problem: QP, certificate: Certificate) -> bool:
    """Whether multipliers show that no x satisfies the constraints, by arithmetic on the QP alone.

    A'y + C'z + z_box = 0, b'y + sum(z+ u - z- l) + sum(z_box+ ub - z_box- lb) < 0, and no multiplier at an
    infinite bound.
    """
    y, z, z_box = certificate.y, certificate.z, certificate.z_box
    multipliers = np.concatenate([z_box, z])
    low, high = np.concatenate([problem.lb, problem.l]), np.concatenate([problem.ub, problem.u])
    bounds = np.where(multipliers > 0.0, high, low)
    largest = max(np.abs(multipliers).max(initial=0.0), np.abs(y).max(initial=0.0))
    used = np.abs(multipliers) > ZERO * largest
    if not largest > 0.0 or not np.isfinite(bounds[used]).all():
        return False
    rest = np.abs(problem.A.T @ y + problem.C.T @ z + z_box).max(initial=0.0)
    value = float(problem.b @ y + multipliers[used] @ bounds[used])
    return bool(rest <= ZERO * largest and value < 0.0)


def relative_residuals(
    problem: QP, x: FloatArray, y: FloatArray, z: FloatArray, z_box: FloatArray
) -> FloatArray:
    """The four residuals over ``ftqp.qp.solving.scales``, (4,); inf where not finite."""
    found = residuals(problem, x, y, z, z_box)
    if not np.isfinite(found.largest):
        return np.full(4, np.inf)
    values = np.array([found.primal, found.dual, found.complementarity, found.gap])
    return values / scales(problem, x, y)
