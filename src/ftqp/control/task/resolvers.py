"""Closed forms in the place of the QP, as recipes; velocity level only.

Bounds, faults, errors, monitor and statuses are those of every scheme. A closed form knows no bounds: where
it breaks one, the command is the allowed one that is nearest and the step says RELAXED.
Source: Bedrossian 1993; Holt, Desrochers (NASA N94-26281); formulas in
``ftqp.kernel.closed_forms.pseudoinverses``."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ftqp.control.task.scheme import Criterion
from ftqp.core.checks import positive
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.layout import enums as codes

RULES = {
    "bound": codes.BOUND,
    "bound_2": codes.BOUND_2,
    "tight": codes.TIGHT,
    "row": codes.ROW,
    "exact_2": codes.EXACT_2,
    "exact_inf": codes.EXACT_INF,
}
"""The rules of the damping factor kappa, by name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Damping:
    """How much a damped inverse is damped; only where the undamped rates break the limit.

    Args:
        rule: ``bound`` (the paper's equation 16), ``bound_2`` (the same in the 2-norm), ``tight`` (equation
            15 solved exactly), ``row`` (triangle inequality a joint), ``exact_2`` (the 2-norm of all rates
            meets the limit), ``exact_inf`` (the largest rate meets it; the least damping of all).
    """

    rule: str = "row"

    def __post_init__(self) -> None:
        rule_code(self.rule)


def rule_code(rule: Any) -> int:
    """The kernel's code of a rule.

    Raises:
        InputError: unknown rule.
    """
    if not isinstance(rule, str) or rule not in RULES:
        raise InputError(
            f"damping rule is {rule!r}{nearest(str(rule), RULES)}, expected one of {', '.join(RULES)}"
        )
    return RULES[rule]


@dataclass(frozen=True, slots=True, kw_only=True)
class Resolver:
    """A closed form and its parameters; made by the recipes of this module.

    Attributes:
        name: how tables and files call it.
        method: the kernel's code.
        weights: of x'diag(weights) x, one a joint, or None.
        rule: of the damping factor.
        limit: largest rate of any joint [rad/s or m/s], None: every joint's own velocity limit.
        threshold: singular values up to this one are dropped [m].
    """

    name: str
    method: int
    weights: tuple[float, ...] | None = None
    rule: str = "row"
    limit: float | None = None
    threshold: float = 0.0

    @property
    def rule_code(self) -> int:
        """The kernel's code of the rule."""
        return rule_code(self.rule)

    def at(self, level: str) -> Criterion:
        """The criterion of a QP without task that takes over where the closed form has no answer.

        Raises:
            InputError: another level than velocity.
        """
        if level != "velocity":
            raise InputError(
                f"scheme {self.name!r} is a closed form for rates; make the planner with level='velocity'"
            )
        return Criterion(norm=1.0)


def positive_weights(weights: Any) -> tuple[float, ...]:
    """Weights as numbers.

    Raises:
        InputError: not a sequence of numbers, or one of them is not positive.
    """
    try:
        values = tuple(weights)
    except TypeError as error:
        raise InputError(f"weights are {weights!r:.60}, expected one positive number a joint") from error
    return tuple(positive(f"weight {i}", value) for i, value in enumerate(values))


def pseudoinverse() -> Resolver:
    """Pseudoinverse: the least rates among those nearest to the task, bounds aside."""
    return Resolver(name="pseudoinverse", method=codes.PSEUDOINVERSE)


def weighted_pseudoinverse(weights: Sequence[float] | None = None) -> Resolver:
    """Weighted pseudoinverse: the least v'diag(weights) v.

    Args:
        weights: one positive number a joint.
    """
    if weights is None:
        raise InputError("weighted_pseudoinverse needs weights, one positive number a joint")
    return Resolver(
        name="weighted_pseudoinverse", method=codes.PSEUDOINVERSE, weights=positive_weights(weights)
    )


def singularity_robust(rule: str = "row", limit: float | None = None) -> Resolver:
    """Singularity-robust inverse: the pseudoinverse, damped by a rule where it would break the rate limit.

    Args:
        rule: of the damping factor, see ``Damping``.
        limit: largest rate of any joint [rad/s or m/s]; None takes each joint's velocity limit, and the least
            sum of (v / limit)^2 in place of the least norm.
    """
    rule_code(rule)
    return Resolver(
        name="singularity_robust",
        method=codes.DAMPED,
        rule=rule,
        limit=None if limit is None else positive("limit", limit, "rad/s"),
    )


def approximate_pseudoinverse(threshold: float = 0.1) -> Resolver:
    """Approximate pseudoinverse of an arm with a spherical wrist: position first, both blocks truncated.

    Args:
        threshold: singular values up to this one are dropped [m; without unit for the wrist].
    """
    return Resolver(
        name="approximate_pseudoinverse",
        method=codes.APPROXIMATE,
        threshold=positive("threshold", threshold, "m"),
    )
