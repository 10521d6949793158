"""The recurrent network inside the kernel, for QPs that are not a planner's."""

import numpy as np

from ftqp.kernel.entry.workspace import NetworkMemory
from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers
from ftqp.qp.dtrnn.dtrnn_settings import CAP, DtrnnSettings


class Dtrnn(Backend):
    """The kernel's network on memory of its own; a warm solve starts from what the buffers hold as solution.

    A warm solve and its cold repeat together take at most ``settings.cap`` iterations.

    Attributes:
        settings: The settings as they were given.
        numbers: What the kernel takes; behind the options it leaves the iterations and |e| of the last solve.
        trace: |e|, r_eq, gap and whether a jump succeeded, one row an iteration as far as there are rows,
            (k, 4). The start of a cold repeat takes the row of the last iterate before it.
    """

    package = "ftqp"
    settings_type = DtrnnSettings

    def __init__(self, settings: DtrnnSettings) -> None:
        super().__init__("dtrnn")
        self.settings = settings
        self.numbers = settings.numbers()
        self.trace = np.zeros((0, 4))

    def start(self) -> None:
        """The buffers hold a start as their solution: the next solve may be warm."""
        self._stale = False

    def _prepare(self, qp: QPBuffers) -> None:
        self._memory = NetworkMemory(qp.n, qp.m, qp.p)

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        left = self.settings.cap - self._spent
        if left <= 0:
            self.iterations = 0
            return Claim.MAX_ITERATIONS
        self.numbers[CAP] = left
        trace = self.trace[self._spent :]
        claim = self._memory.solve(qp.flat, qp.solution, self.numbers, trace, not cold)
        self.iterations = int(self.numbers[-2])
        return Claim(claim)
