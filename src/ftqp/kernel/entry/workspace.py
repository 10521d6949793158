"""QPs that no robot made: memory for the active set and the network on them, and their residuals."""

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import bound, rooms, share_out
from ftqp.kernel.layout.flat_arrays import memory_size
from ftqp.kernel.layout.other_records import CONSTRAINTS, ROWS, VARIABLES
from ftqp.kernel.layout.record import dtype

TOLERANCE = 1e-10
"""Largest violation of a bound or row that counts as none. A convention: far above rounding of numbers about
1, and far below what any use of a QP tells apart."""


NO_TRACE = np.zeros((0, 4))


class Workspace:
    """Memory of one QP of fixed sizes, with the names and shapes of ``ftqp.qp``, to be filled in place."""

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


def solve_networks(
    problems: FloatArray,
    solutions: FloatArray,
    sizes: tuple[int, int, int],
    numbers: FloatArray,
    memory: FloatArray | None = None,
    trace: FloatArray = NO_TRACE,
    warm: bool = False,
) -> FloatArray:
    """The network on QPs of the same sizes, on all cores: code, iterations and |e| of each, (count, 3).

    Problems are as in ``ftqp.qp.QPBuffers.flat``, (count, k), or (1, k) for one that is all; solutions have
    x, z_box, y, z of each, the start when ``warm``, the answer on return. ``numbers`` are the options, (7,),
    and ``trace``, (k, 4), is filled as far as it reaches. A QP that is alone may have a ``memory``.
    """
    found, size = np.zeros((len(solutions), 3)), memory_size(*sizes)
    things = problems, len(problems), solutions, len(solutions), found

    def work(first: int, last: int) -> None:
        own = np.zeros(size) if memory is None else memory
        bound(
            "solve_networks", *things, own, size, numbers, trace, len(trace), *sizes, int(warm), first, last
        )()

    share_out(work, len(solutions))
    return found
