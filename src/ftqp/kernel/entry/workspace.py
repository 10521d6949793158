"""QPs that no robot made: memory for the active set and the network on them, and their residuals."""

from collections.abc import Sequence

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import bound, rooms, share_out
from ftqp.kernel.layout.flat_arrays import standalone_memory_size
from ftqp.kernel.layout.other_records import CONSTRAINTS, ROWS, VARIABLES
from ftqp.kernel.layout.record import dtype

TOLERANCE = 1e-10
"""Largest violation of a bound or row that counts as none. A convention: far above rounding of numbers about
1, and far below what any use of a QP tells apart."""


class Workspace:
    """Memory of one QP of fixed sizes, with the names and shapes of ``ftqp.qp``, to be filled in place.

    The solution is x, (n,), with multipliers y, (m,), z, (p,), and z_box, (n,).
    """

    def __init__(self, n: int, m: int, p: int) -> None:
        for name, got, capacity in (
            ("variables", n, VARIABLES),
            ("equality rows", m, ROWS),
            ("two-sided rows", p, CONSTRAINTS),
        ):
            if got > capacity:
                raise InputError(
                    f"the QP has {got} {name}, active_set holds at most {capacity}; "
                    "use backend 'daqp' or 'proxqp'"
                )
        self._memory = np.zeros(1, dtype("standalone"))
        Q = rooms(self._memory)
        self._Q = Q
        Q.nx, Q.meq, Q.nc, Q.rigid, Q.dense = n, m, p, p, 1
        Q.tolerance, Q.max_iterations = TOLERANCE, 50 * (n + p + 10)
        Q.lb[:], Q.ub[:], Q.l[:], Q.u[:] = -np.inf, np.inf, -np.inf, np.inf
        self.H, self.g, self.A, self.b = Q.H[:n, :n], Q.g[:n], Q.A[:m, :n], Q.b[:m]
        self.C, self.l, self.u, self.lb, self.ub = Q.C[:p, :n], Q.l[:p], Q.u[:p], Q.lb[:n], Q.ub[:n]
        self.x, self.y, self.z, self.z_box = Q.x[:n], Q.y[:m], Q.z[:p], Q.z_box[:n]
        self._solve = bound("solve_qp", self._memory)

    def solve(self, cold: bool = False) -> int:
        """Solve what the arrays hold now: 0 solved, 1 iteration limit, 2 infeasible, 3 failed."""
        if cold:
            self._Q.warm = 0
        return self._solve()

    @property
    def iterations(self) -> int:
        """Changes of the working set in the last solve."""
        return int(self._Q.iterations)

    @property
    def tolerance(self) -> float:
        """Largest violation of a bound or row that counts as none."""
        return float(self._Q.tolerance)

    @tolerance.setter
    def tolerance(self, value: float) -> None:
        self._Q.tolerance = value


class NetworkMemory:
    """Memory of the network for one QP of n variables, m equality rows and p two-sided rows."""

    def __init__(self, n: int, m: int, p: int) -> None:
        self._sizes = (n, m, p)
        self._memory = np.zeros(standalone_memory_size(n, m, p))

    def solve(
        self, flat: FloatArray, solution: FloatArray, numbers: FloatArray, trace: FloatArray, warm: bool
    ) -> int:
        """The claim of the network; see ``ftqp.kernel.entry.standalone_entries.solve_network``."""
        things = flat, solution, self._memory, len(self._memory), numbers, trace, len(trace), *self._sizes
        return bound("solve_network", *things, int(warm))()


def solve_many(
    parts: Sequence[FloatArray], numbers: FloatArray, count: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, IntArray, IntArray, FloatArray]:
    """The network on many QPs of the same sizes, on all cores: x, y, z, z_box, codes, iterations, |e|.

    The parts are H, g, A, b, C, l, u, lb, ub, each with a leading axis of ``count``, or 1 for what all share.
    """
    n, m, p = (parts[k].shape[1] for k in (1, 3, 5))
    x, y, z, z_box = (np.full((count, size), np.nan) for size in (n, m, p, n))
    codes, iterations, residual = np.zeros(count, np.int64), np.zeros(count, np.int64), np.zeros(count)
    each = [thing for part in parts for thing in (part, len(part))]
    things = (n, m, p, count, *each, numbers, x, y, z, z_box, codes, iterations, residual)
    size = standalone_memory_size(n, m, p)

    def work(first: int, last: int) -> None:
        memory = np.zeros(size)
        bound("solve_network_batch", *things, memory, size, first, last)()

    share_out(work, count)
    return x, y, z, z_box, codes, iterations, residual


def kkt(flat: FloatArray, solution: FloatArray, n: int, m: int, p: int) -> FloatArray:
    """The KKT residuals of a solution, (4,); see ``ftqp.kernel.judge.solution_check.kkt_residuals``."""
    out = np.empty(4)
    bound("kkt", flat, solution, out, n, m, p)()
    return out
