"""QPs that no robot made, on memory whose every field the test can fill."""

from functools import cache
from typing import Any

import numpy as np

from ftqp.kernel.entry.session import bound, rooms
from ftqp.kernel.entry.workspace import TOLERANCE
from ftqp.kernel.layout.record import dtype


class StandaloneQP:
    """Memory of one QP of n variables, m rows of A, which may be compliant, and p two-sided rows.

    Attributes:
        Q: Every field of the solver's memory.
        H, g, A, b, soft, C, l, u, lb, ub: The QP, to be filled in place.
        x, y, z, z_box: The solution.
    """

    def __init__(self, n: int, m: int, p: int) -> None:
        memory = np.zeros(1, dtype("standalone"))
        self.Q: Any = rooms(memory)
        Q = self.Q
        Q.nx, Q.meq, Q.nc, Q.dense = n, m, p, 1
        Q.tolerance, Q.max_iterations = TOLERANCE, 50 * (n + p + 10)
        self.H, self.g, self.A, self.b, self.soft = Q.H[:n, :n], Q.g[:n], Q.A[:m, :n], Q.b[:m], Q.soft[:m]
        self.C, self.l, self.u, self.lb, self.ub = Q.C[:p, :n], Q.l[:p], Q.u[:p], Q.lb[:n], Q.ub[:n]
        self.x, self.y, self.z, self.z_box = Q.x[:n], Q.y[:m], Q.z[:p], Q.z_box[:n]
        self._memory = memory
        self._solve = bound("solve_qp", memory)

    def solve(self, cold: bool = False) -> int:
        """The claim of the active set on what the arrays hold now."""
        if cold:
            self.Q.warm = 0
        return self._solve()

    @property
    def iterations(self) -> int:
        """Changes of the working set in the last solve."""
        return int(self.Q.iterations)


standalone_qp = cache(StandaloneQP)
"""One memory a size, as a solver keeps it."""
