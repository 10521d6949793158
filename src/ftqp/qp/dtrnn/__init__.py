"""The discrete-time recurrent network (DTRNN) as a solver: one QP with its trace, or many at once."""

from ftqp.qp.adapters._dtrnn import METHODS, MODES, DtrnnSettings
from ftqp.qp.dtrnn.solves import BatchSolution, DtrnnSolution, Trace, solve, solve_batch

__all__ = [
    "METHODS",
    "MODES",
    "BatchSolution",
    "DtrnnSettings",
    "DtrnnSolution",
    "Trace",
    "solve",
    "solve_batch",
]
