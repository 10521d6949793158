"""The verdict on a path that does not go on, in directions and joints."""

from typing import final

import numpy as np

from ftqp.control.planner.certificate import NEAR
from ftqp.control.planner.lead import Lead
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.control.planner.target import Target
from ftqp.core.checks import BoolArray, FloatArray
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
        self._A, self._rows = A / lead.length, tuple(COMPONENTS[c] for c in components)
        self._tangent: FloatArray = target.twist[components] * scale
        self._at_limit = at_limit
        self._failed = {name: fault.kind.replace("_", "-") for name, fault in planner.faults.items()}
        self._free: BoolArray = lead.working & ~np.array(stuck, dtype=np.bool_)

    @property
    def _along(self) -> FloatArray:
        """The direction of the path."""
        return self._tangent / max(float(np.linalg.norm(self._tangent)), 1e-300)

    @property
    def direction(self) -> FloatArray:
        """Unit vector over the task's rows, (m,), along which the path goes and the tip cannot."""
        tangent = self._along
        U, sigma, _ = np.linalg.svd(self._A[:, self._free])
        values = np.zeros(len(U))
        values[: len(sigma)] = sigma
        lost = U[:, values < SINGULAR]
        missing: FloatArray = lost @ (lost.T @ tangent)
        size = float(np.linalg.norm(missing))
        return tangent if size < NOTICEABLE else missing / size

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        ways = _named(self.direction, self._rows)
        wanted = _named(self._along, self._rows)
        causes = [f"{joint} ({kind})" for joint, kind in self._failed.items()]
        causes += [
            f"{joint} ({kind} limit)"
            for joint, kind in self._at_limit.items()
            if joint not in self._failed and kind != NEAR
        ]
        near = [pair for pair, kind in self._at_limit.items() if kind == NEAR]
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
