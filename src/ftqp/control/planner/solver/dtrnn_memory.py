"""The recurrent network as a planner's solver: its memory, and how exact its answers have to be."""

from typing import Any, Final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.flat_arrays import OPTIONS, planner_memory_size
from ftqp.kernel.layout.rows import constraint_capacity

NETWORK: Final = "dtrnn"
"""The backend that takes the place of the active set in the kernel."""
MARGIN = 10.0
"""Largest scaled residual that counts as solved, in tolerances of the network."""


def network_memory(solver: Any, session: Session) -> FloatArray:
    """The memory of the network that solves a planner's QPs, (k,), its options filled in."""
    K = session.K
    n, m = int(K.chain.n), int(K.task.m)
    memory = np.zeros(planner_memory_size(n + 1, m, constraint_capacity(n)))
    memory[:OPTIONS] = solver.numbers[:OPTIONS]
    K.cascade.external = 1
    K.cascade.accept = max(float(K.cascade.accept), MARGIN * solver.settings.accuracy)
    return memory
