"""The solver inside the kernel, for QPs that are not a planner's."""

from dataclasses import dataclass

from ftqp.kernel.entry.workspace import Workspace
from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers
from ftqp.qp.problem import ANSWER, PARTS


@dataclass(frozen=True, slots=True, kw_only=True)
class ActiveSetSettings:
    """The in-kernel solver has no settings: it works to rounding, its cap follows from the size of the QP."""


class ActiveSet(Backend):
    """The kernel's active set on a workspace of its own; its capacity bounds the size of the QP."""

    package = "ftqp"
    settings_type = ActiveSetSettings

    def _prepare(self, qp: QPBuffers) -> None:
        self._work = Workspace(qp.n, qp.m, qp.p)

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        work = self._work
        for name in PARTS:
            getattr(work, name)[...] = getattr(qp, name)
        claim = Claim(work.solve(cold))
        self.iterations = int(work.iterations)
        if claim <= Claim.MAX_ITERATIONS:
            for name in ANSWER:
                getattr(qp, name)[:] = getattr(work, name)
        return claim
