"""Closed forms in the place of the QP, as recipes; they work at the velocity level only.

Bounds, faults, errors and statuses are those of every scheme. A closed form knows no bounds: where it breaks
one, the command is the nearest one that is allowed, and the step says RELAXED.

Source: Bedrossian 1993; Holt and Desrochers 1994; the derivations are in ``docs/theory/singularities.md``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ftqp.core.checks import positive
from ftqp.core.errors import InputError, nearest
from ftqp.kernel.layout.criteria import Criterion
from ftqp.kernel.layout.enums import ClosedForm, Rule

RULES = {rule.name.lower(): rule for rule in Rule}
"""The rules of the damping factor kappa, by name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Damping:
    """How much a damped inverse is damped, where the undamped rates would break the limit.

    Args:
        rule: How the damping factor is found, from the most to the least damping as a rule: ``bound``
            (equation 16 of Bedrossian 1993), ``tight`` (its equation 15 solved exactly), ``bound_2``
            (equation 16 in the 2-norm), ``exact_2`` (the 2-norm of all rates meets the limit), ``row`` (the
            triangle inequality for each joint, the default) and ``exact_inf`` (the largest rate meets the
            limit). Less damping keeps more of the task; all of them keep the limit.
    """

    rule: str = "row"

    def __post_init__(self) -> None:
        rule_code(self.rule)


def rule_code(rule: Any) -> int:
    """The kernel's code of a rule."""
    if not isinstance(rule, str) or rule not in RULES:
        raise InputError(
            f"damping rule is {rule!r}{nearest(str(rule), RULES)}, expected one of {', '.join(RULES)}"
        )
    return RULES[rule]


@dataclass(frozen=True, slots=True, kw_only=True)
class Resolver:
    """A closed form and its parameters; the recipes of this module make it.

    Attributes:
        name: The name that tables and files use.
        method: The kernel's code of the method.
        weights: Weights of v'diag(weights) v, > 0, one a joint, or None for equal ones. The larger a weight,
            the less its joint moves.
        rule: The rule of the damping factor, see ``Damping``.
        limit: The largest rate of any joint, > 0 [rad/s or m/s]; None takes every joint's own velocity limit.
        threshold: Singular values up to this one are dropped, > 0 [m]. Larger is calmer and gives up more.
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

        Args:
            level: The planner's level; only ``velocity`` has closed forms.

        Raises:
            InputError: The level is not ``velocity``.
        """
        if level != "velocity":
            raise InputError(
                f"scheme {self.name!r} is a closed form for rates; make the planner with level='velocity'"
            )
        return Criterion(norm=1.0)


def positive_weights(weights: Any) -> tuple[float, ...]:
    """Weights as numbers."""
    try:
        values = tuple(weights)
    except TypeError as error:
        raise InputError(f"weights are {weights!r:.60}, expected one positive number a joint") from error
    return tuple(positive(f"weight {i}", value) for i, value in enumerate(values))


def pseudoinverse() -> Resolver:
    """Pseudoinverse: the least rates among those nearest to the task, bounds aside."""
    return Resolver(name="pseudoinverse", method=ClosedForm.PSEUDOINVERSE)


def weighted_pseudoinverse(weights: Sequence[float] | None = None) -> Resolver:
    """Weighted pseudoinverse: the least v'diag(weights) v.

    Args:
        weights: One positive number a joint. The larger a weight, the less its joint moves.

    Raises:
        InputError: The weights are missing or not positive.
    """
    if weights is None:
        raise InputError("weighted_pseudoinverse needs weights, one positive number a joint")
    return Resolver(
        name="weighted_pseudoinverse", method=ClosedForm.PSEUDOINVERSE, weights=positive_weights(weights)
    )


def singularity_robust(rule: str = "row", limit: float | None = None) -> Resolver:
    """Singularity-robust inverse: the pseudoinverse, damped by a rule where it would break the rate limit.

    Args:
        rule: The rule of the damping factor, see ``Damping``.
        limit: The largest rate of any joint, > 0 [rad/s or m/s]. A larger one damps later and lets joints
            race more near a singularity. None takes each joint's velocity limit, and the least sum of (v /
            limit)^2 in place of the least norm.
    """
    rule_code(rule)
    return Resolver(
        name="singularity_robust",
        method=ClosedForm.DAMPED,
        rule=rule,
        limit=None if limit is None else positive("limit", limit, "rad/s"),
    )


def approximate_pseudoinverse(threshold: float = 0.1) -> Resolver:
    """Approximate pseudoinverse of an arm with a spherical wrist: position first, both blocks truncated.

    Args:
        threshold: Singular values up to this one are dropped, > 0 [m; without unit for the wrist]. A larger
            one keeps farther from singularities and gives up more of the task; it bounds no rate.
    """
    return Resolver(
        name="approximate_pseudoinverse",
        method=ClosedForm.APPROXIMATE,
        threshold=positive("threshold", threshold, "m"),
    )
