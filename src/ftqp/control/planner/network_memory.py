"""The recurrent network as a planner's solver: its memory, and how exact its answers have to be."""

from typing import Any, Final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.dtrnn.stopping import OPTIONS
from ftqp.kernel.entry.network_entries import planner_memory_size

NETWORK: Final = "dtrnn"
"""The backend that takes the place of the active set in the kernel."""
MARGIN = 10.0
"""Largest scaled residual that counts as solved, in tolerances of the network."""


def network_memory(solver: Any, W: Any) -> FloatArray:
    """Make the network the solver of a planner's record; the memory that it works in, to be kept alive.

    Args:
        solver: the backend ``dtrnn``.
        W: the planner's record, (1,), its sizes filled in.
    """
    n, m = int(W["n"][0]), int(W["m"][0])
    memory = np.zeros(int(planner_memory_size(n + 1, m, n)))
    memory[:OPTIONS] = solver.numbers[:OPTIONS]
    W["network"], W["external"] = memory.ctypes.data, 1
    W["accept"] = max(float(W["accept"][0]), MARGIN * solver.settings.accuracy)
    return memory
