"""The discrete-time recurrent network (DTRNN) as a solver: one QP with its trace, or many at once."""

from ftqp.qp.dtrnn.dtrnn_settings import METHODS, MODES, DtrnnSettings
from ftqp.qp.dtrnn.many import BatchSolution, solve_batch
from ftqp.qp.dtrnn.traced_solve import DtrnnSolution, Trace, solve

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
