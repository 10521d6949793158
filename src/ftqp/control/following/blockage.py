"""The verdict on a path that does not go on, in directions and joints."""

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ftqp.control.planner.certificate import NEAR
from ftqp.control.planner.lead import Lead
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target
from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.rows import COMPONENTS, ROW_KINDS

SINGULAR = 0.03
"""A singular value of the scaled reduced Jacobian [characteristic lengths] below this is a direction in which
the tip cannot move."""
NOTICEABLE = 0.05
"""A share of the path's direction, or of a direction's components, below this is left out."""
ALONG_ONE = 0.98
"""A direction with this cosine to a row of the task goes by the row's name. A cosine of 0.98 is 11 degrees,
for a sentence to an operator: a convention."""
LASTING = ("position", *(kind.name for kind in ROW_KINDS))
"""Limits of these kinds are named as what holds a joint."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Facts:
    """What the verdict is made from, copied when it falls."""

    A: FloatArray
    tangent: FloatArray
    rows: tuple[str, ...]
    at_limit: dict[str, str]
    failed: dict[str, str]
    free: Any


@final
class Blockage:
    """Why a path is blocked where it is.

    The directions are those of the path's tangent that lie along left singular vectors of the reduced
    Jacobian, where its singular values vanish. Its linear rows are divided by the characteristic length, and
    its columns are those of the joints that are free to move: a joint counts as free unless it has failed or
    stands at a position limit that the step pushes against. If none of the tangent is singular, the direction
    is the tangent itself, and limits are what blocks it.
    """

    def __init__(
        self,
        planner: Planner,
        lead: Lead,
        target: Target,
        progress: float,
        duration: float,
        step: Step,
        searched: str = "",
    ) -> None:
        components, scale, A = lead.rows()
        at_limit = {}
        for text in step.limits_active:
            joint, _, kind = text.partition(" ")
            if text.endswith(NEAR):
                joint, kind = text.removesuffix(f" {NEAR}"), NEAR
            if kind.endswith(LASTING):  # others come and go
                at_limit[joint] = kind
        stuck = [j in at_limit and "position" in at_limit[j] for j in planner.robot.joints]
        self.progress, self.duration, self._searched = progress, duration, searched
        self._facts = _Facts(
            A=A / lead.length,
            tangent=np.array(target.twist[components]) * scale,
            rows=tuple(COMPONENTS[c] for c in components),
            at_limit=at_limit,
            failed={name: fault.kind.replace("_", "-") for name, fault in planner.faults.items()},
            free=lead.working & ~np.array(stuck, dtype=np.bool_),
        )

    @property
    def direction(self) -> FloatArray:
        """Unit vector over the task's rows, (m,), along which the path goes and the tip cannot."""
        facts = self._facts
        tangent = facts.tangent / max(float(np.linalg.norm(facts.tangent)), 1e-300)
        U, sigma, _ = np.linalg.svd(facts.A[:, facts.free])
        values = np.zeros(len(U))
        values[: len(sigma)] = sigma
        lost = U[:, values < SINGULAR]
        missing: FloatArray = lost @ (lost.T @ tangent)
        size = float(np.linalg.norm(missing))
        return tangent if size < NOTICEABLE else missing / size

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        facts = self._facts
        ways = _named(self.direction, facts.rows)
        wanted = _named(facts.tangent / max(float(np.linalg.norm(facts.tangent)), 1e-300), facts.rows)
        causes = [f"{joint} ({kind})" for joint, kind in facts.failed.items()]
        causes += [
            f"{joint} ({kind} limit)"
            for joint, kind in facts.at_limit.items()
            if joint not in facts.failed and kind != NEAR
        ]
        near = [pair for pair, kind in facts.at_limit.items() if kind == NEAR]
        pairs = [f"{pair} are as near as they may be" for pair in near]
        held = ", ".join([f"joints {', '.join(causes)}"] * bool(causes) + pairs) or "the posture is singular"
        if ways != wanted:
            wanted = f"{wanted}, which takes a motion along {ways},"
        at = f"progress {self.progress:.3g} s of {self.duration:.3g} s"
        text = f"the end effector cannot go on along {wanted} at {at}: {held}"
        return f"{text}; {self._searched}" if self._searched else text


def _named(direction: FloatArray, rows: tuple[str, ...]) -> str:
    """A direction by the name of its row, or by its components."""
    largest = int(np.argmax(np.abs(direction)))
    if abs(direction[largest]) >= ALONG_ONE:
        return ("-" if direction[largest] < 0.0 else "+") + rows[largest]
    parts = [
        f"{value:+.2f} {row}" for value, row in zip(direction, rows, strict=True) if abs(value) >= NOTICEABLE
    ]
    return f"({' '.join(parts)})"
