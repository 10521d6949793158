"""The active set for QPs that no robot made: a record that holds a QP alone."""

from typing import Any

import numpy as np

from ftqp.core.errors import InputError
from ftqp.kernel.active_set.active_set import active_set
from ftqp.kernel.jit import carray, entry, jit, pointer
from ftqp.kernel.layout.enums import FAILED, MAX_ITERATIONS, SOLVED
from ftqp.kernel.layout.record import qp_fields

VARIABLES = 64
ROWS = 64
CONSTRAINTS = 128
"""Capacity of a QP solved alone."""

DTYPE = np.dtype(
    [
        *qp_fields(VARIABLES, ROWS, CONSTRAINTS),
        ("centre", "f8", (VARIABLES,)),
        ("g_given", "f8", (VARIABLES,)),
    ],
    align=True,
)
PROXIMAL_STEPS = 200


@jit
def _proximal(K: Any) -> int:
    """A semidefinite H: min f(x) + eps |x - x_k|^2/2 again and again until x_k settles (proximal point)."""
    n = K.nx
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(K.H[i, i]))
    eps = 1e-6 * largest + 1e-8
    for i in range(n):
        K.H[i, i] += eps
        K.centre[i] = 0.0
        K.g_given[i] = K.g[i]
    code, total = MAX_ITERATIONS, 0
    for _ in range(PROXIMAL_STEPS):
        for i in range(n):
            K.g[i] = K.g_given[i] - eps * K.centre[i]
        code = active_set(K)
        total += K.iterations
        if code != SOLVED:
            break
        moved, size = 0.0, 0.0
        for i in range(n):
            moved = max(moved, abs(K.x[i] - K.centre[i]))
            size = max(size, abs(K.x[i]))
            K.centre[i] = K.x[i]
        if not size < 1e15:
            code = FAILED
            break
        if eps * moved <= 1e-11 * (1.0 + eps * size):
            break
        code = MAX_ITERATIONS
    for i in range(n):
        K.H[i, i] -= eps
        K.g[i] = K.g_given[i]
    K.iterations = total
    return code


@entry
def solve_qp(address: int) -> int:
    """Solve the QP at ``address``: SOLVED, MAX_ITERATIONS, INFEASIBLE or FAILED."""
    K = carray(pointer(address), 1, DTYPE)[0]
    code = active_set(K)
    if code == FAILED:
        K.warm = 0
        return _proximal(K)
    return code


class Workspace:
    """Memory of one QP of fixed sizes; its arrays are views to be filled in place.

    Attributes:
        H: (n, n). g: (n,). A: (m, n). b: (m,). C: (p, n). l, u: (p,). lb, ub: (n,). x: (n,). y: (m,). z:
            (p,). z_box: (n,).
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
        self._record: Any = np.zeros(1, DTYPE)
        self._address: int = self._record.ctypes.data
        K = self._record
        K["nx"], K["meq"], K["nc"], K["dense"] = n, m, p, 1
        K["tolerance"], K["max_iterations"] = 1e-10, 50 * (n + p + 10)
        K["lb"], K["ub"], K["l"], K["u"] = -np.inf, np.inf, -np.inf, np.inf
        self.H, self.g = K["H"][0][:n, :n], K["g"][0][:n]
        self.A, self.b = K["A"][0][:m, :n], K["b"][0][:m]
        self.C, self.l, self.u = K["C"][0][:p, :n], K["l"][0][:p], K["u"][0][:p]
        self.lb, self.ub = K["lb"][0][:n], K["ub"][0][:n]
        self.x, self.y, self.z, self.z_box = K["x"][0][:n], K["y"][0][:m], K["z"][0][:p], K["z_box"][0][:n]

    def solve(self, cold: bool = False) -> int:
        """Solve what the arrays hold now: 0 solved, 1 iteration limit, 2 infeasible, 3 failed."""
        if cold:
            self._record["warm"] = 0
        return int(solve_qp(self._address))

    @property
    def iterations(self) -> int:
        """Changes of the working set in the last solve."""
        return int(self._record["iterations"][0])

    @property
    def tolerance(self) -> float:
        """Largest violation of a bound or row that counts as none."""
        return float(self._record["tolerance"][0])

    @tolerance.setter
    def tolerance(self, value: float) -> None:
        self._record["tolerance"] = value


def workspace(n: int, m: int, p: int) -> Workspace:
    """Memory for QPs of n variables, m equality rows and p two-sided rows.

    Raises:
        InputError: beyond the capacity.
    """
    return Workspace(n, m, p)
