"""The solver inside the kernel, for QPs that are not a planner's."""

from dataclasses import dataclass

from ftqp.kernel.entry.workspace import Workspace
from ftqp.qp.adapters.backend import Backend, Claim
from ftqp.qp.adapters.buffers import QPBuffers


@dataclass(frozen=True, slots=True, kw_only=True)
class ActiveSetSettings:
    """The in-kernel solver has no settings: it works to rounding, its cap follows from the size of the QP."""


class ActiveSet(Backend):
    """The kernel's active set on a workspace of its own; its capacity bounds the size of the QP."""

    package = "ftqp"
    settings_type = ActiveSetSettings

    def __init__(self, settings: ActiveSetSettings) -> None:
        super().__init__("active_set")

    def _prepare(self, qp: QPBuffers) -> None:
        self._work = Workspace(qp.n, qp.m, qp.p)

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        work = self._work
        work.H[...] = qp.H
        work.g[:] = qp.g
        work.A[...] = qp.A
        work.b[:] = qp.b
        work.C[...] = qp.C
        work.l[:] = qp.l
        work.u[:] = qp.u
        work.lb[:] = qp.lb
        work.ub[:] = qp.ub
        claim = Claim(work.solve(cold))
        self.iterations = int(work.iterations)
        if claim <= Claim.MAX_ITERATIONS:
            qp.x[:] = work.x
            qp.y[:] = work.y
            qp.z[:] = work.z
            qp.z_box[:] = work.z_box
        return claim
