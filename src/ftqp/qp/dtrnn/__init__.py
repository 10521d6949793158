"""The discrete-time recurrent network (DTRNN) as a solver: one QP with its trace, or many at once."""

from ftqp.qp.dtrnn.alone import DtrnnSolution, Trace, solve
from ftqp.qp.dtrnn.dtrnn_settings import METHODS, MODES, DtrnnSettings
from ftqp.qp.dtrnn.many import BatchSolution, solve_batch

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
