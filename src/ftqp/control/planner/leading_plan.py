"""What a planner asks of a plan that leads it, and what a plan answers after a failure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.faults.kinds import Fault
from ftqp.model.robot import Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class Remaining:
    """One thing that can still be done of a path after a failure.

    Attributes:
        kind: ``task`` (the rest of the path with all rows), ``rows`` (with fewer), ``until`` (a part of it),
            ``retreat`` (the way that has been done, back) or ``stop``.
        rows: The rows of the pose that are kept, by name.
        until: The time of the plan up to which it can be done [s]; of a retreat the one that it leads back
            to.
        q: The joints on the way, (k, nv) [rad or m]; the first row is where the arm is.
        sentence: The same in words.
    """

    kind: str
    rows: str
    until: float
    q: FloatArray
    sentence: str


class LeadingPlan(Protocol):
    """What a planner needs of a plan; those of ``ftqp.analysis.plan`` and ``load_plan`` have it."""

    @property
    def q(self) -> FloatArray:
        """Joint positions at the times ``t``, (N + 1, nv) [rad or m]."""

    @property
    def t(self) -> FloatArray:
        """Times from 0 at equal distances, (N + 1,) [s]."""

    def of(self, robot: Robot) -> "LeadingPlan":
        """The plan with its arm; InputError where it was made for another one."""

    def remaining(self, q: FloatArray, at: float, faults: Sequence[Fault]) -> tuple[Remaining, ...]:
        """What can be done after faults at time ``at`` [s] and joints q, (nv,), least lost first."""

    def continuation(
        self, q: FloatArray, at: float, faults: Sequence[Fault]
    ) -> tuple[int, FloatArray] | None:
        """The postures that are verified after faults, from a row on; None keeps those of the plan."""


def plan_for(plan: LeadingPlan, robot: Robot) -> LeadingPlan:
    """A plan with its arm.

    Args:
        plan: The plan.
        robot: The arm.

    Raises:
        InputError: It is no plan, or one of another arm.
    """
    for name in ("q", "t", "of", "remaining", "continuation"):
        if not hasattr(plan, name):
            raise InputError(
                f"plan is {plan!r:.60}, expected one of ftqp.analysis.plan or ftqp.analysis.load_plan"
            )
    return plan.of(robot)
