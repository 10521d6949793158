"""QPs that no robot made: the active set and the network on memory of their own, and the residuals."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ftqp.kernel.active_set.standalone import solve_standalone
from ftqp.kernel.dtrnn.standalone_qp import solve_network_standalone
from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.judge.kkt import kkt_residuals
from ftqp.kernel.layout.network_memory import OPTIONS
from ftqp.kernel.layout.standalone_memory import standalone_dtype
from ftqp.kernel.maths.matrix_view import matrix_view
from ftqp.kernel.ticks.steps import FLOAT

WHOLE = np.dtype(np.int64)


def solve_qp(capacity: int) -> Callable[..., int]:
    """The active set on the QP of a workspace: SOLVED, MAX_ITERATIONS, INFEASIBLE or FAILED."""
    dtype = standalone_dtype()

    def solve_qp(address: int) -> int:
        return solve_standalone(carray(pointer(address), 1, dtype)[0])

    return solve_qp


@jit
def _parts(flat: Any, n: int, m: int, p: int) -> Any:
    """H, g, A, b, C, l, u, lb, ub of a QP in one piece, as in ``ftqp.qp.QPBuffers.flat``."""
    k = n + m + p
    at = n * n + n
    rows = matrix_view(flat, at, m + p, n)
    low = at + (m + p) * n
    high = low + k
    return (
        matrix_view(flat, 0, n, n),
        flat[n * n : at],
        rows[:m],
        flat[low + n : low + n + m],
        rows[m:],
        flat[low + n + m : high],
        flat[high + n + m : high + k],
        flat[low : low + n],
        flat[high : high + n],
    )


@jit
def _whole(address: int, n: int, m: int, p: int) -> Any:
    """A QP in one piece."""
    return carray(pointer(address), (n * n + n + (m + p) * n + 2 * (n + m + p),), FLOAT)


def kkt(capacity: int) -> Callable[..., int]:
    """The KKT residuals of a point, (4,), see ``ftqp.kernel.judge.kkt``."""

    def kkt(problem_at: int, solution_at: int, out_at: int, n: int, m: int, p: int) -> int:
        """The solution is x, z_box, y, z one after the other."""
        H, g, A, b, C, l, u, lb, ub = _parts(_whole(problem_at, n, m, p), n, m, p)
        s = carray(pointer(solution_at), (2 * n + m + p,), FLOAT)
        out = carray(pointer(out_at), (4,), FLOAT)
        kkt_residuals(
            H, g, A, b, C, l, u, lb, ub, s[:n], s[2 * n : 2 * n + m], s[2 * n + m :], s[n : 2 * n], out
        )
        return 0

    return kkt


def solve_network(capacity: int) -> Callable[..., int]:
    """The network on one QP: SOLVED, MAX_ITERATIONS, INFEASIBLE or FAILED."""

    def solve_network(problem_at: int, solution_at: int, memory_at: int, memory_size: int, numbers_at: int,
    trace_at: int,
                      trace_rows: int, n: int, m: int, p: int, warm: int) -> int:  # fmt: skip
        """Solve a QP in one piece; the solution is x, z_box, y, z one after the other.

        It is the start when ``warm``, and is written for SOLVED and MAX_ITERATIONS. Iterations and |e| are
        written behind the options in ``numbers``, (9,).
        """
        H, g, A, b, C, l, u, lb, ub = _parts(_whole(problem_at, n, m, p), n, m, p)
        s = carray(pointer(solution_at), (2 * n + m + p,), FLOAT)
        memory = carray(pointer(memory_at), (memory_size,), FLOAT)
        numbers = carray(pointer(numbers_at), (OPTIONS + 2,), FLOAT)
        trace = carray(pointer(trace_at), (trace_rows, 4), FLOAT)
        code, iterations, size = solve_network_standalone(
            memory, numbers, trace, n, m, p, warm, H, g, A, b, C, l, u, lb, ub,
            s[:n], s[2 * n : 2 * n + m], s[2 * n + m :], s[n : 2 * n],
        )  # fmt: skip
        numbers[OPTIONS], numbers[OPTIONS + 1] = iterations, size
        return code

    return solve_network


def solve_network_batch(capacity: int) -> Callable[..., int]:
    """The network on many QPs of the same sizes, each from zero."""

    def solve_network_batch(
        table_at: int, memory_at: int, memory_size: int, first: int, last: int, count: int
    ) -> int:
        """Problems ``first`` to ``last - 1`` of ``count``.

        The table holds n, m, p, then addresses and leading axes (1 for an input that all share) of H, g, A,
        b, C, l, u, lb, ub, then the address of the options, then of x, y, z, z_box, code, iterations and |e|.
        """
        table = carray(pointer(table_at), (29,), WHOLE)
        n, m, p = table[0], table[1], table[2]
        H, g = (
            carray(pointer(table[3]), (table[4], n, n), FLOAT),
            carray(pointer(table[5]), (table[6], n), FLOAT),
        )
        A, b = (
            carray(pointer(table[7]), (table[8], m, n), FLOAT),
            carray(pointer(table[9]), (table[10], m), FLOAT),
        )
        C = carray(pointer(table[11]), (table[12], p, n), FLOAT)
        l, u = (
            carray(pointer(table[13]), (table[14], p), FLOAT),
            carray(pointer(table[15]), (table[16], p), FLOAT),
        )
        lb, ub = (
            carray(pointer(table[17]), (table[18], n), FLOAT),
            carray(pointer(table[19]), (table[20], n), FLOAT),
        )
        numbers = carray(pointer(table[21]), (OPTIONS,), FLOAT)
        x, y = carray(pointer(table[22]), (count, n), FLOAT), carray(pointer(table[23]), (count, m), FLOAT)
        z, z_box = (
            carray(pointer(table[24]), (count, p), FLOAT),
            carray(pointer(table[25]), (count, n), FLOAT),
        )
        code = carray(pointer(table[26]), (count,), WHOLE)
        iterations = carray(pointer(table[27]), (count,), WHOLE)
        size = carray(pointer(table[28]), (count,), FLOAT)
        memory = carray(pointer(memory_at), (memory_size,), FLOAT)
        trace = matrix_view(numbers, 0, 0, 4)
        for k in range(first, last):
            code[k], iterations[k], size[k] = solve_network_standalone(
                memory, numbers, trace, n, m, p, 0,
                H[min(k, len(H) - 1)], g[min(k, len(g) - 1)],
                A[min(k, len(A) - 1)], b[min(k, len(b) - 1)],
                C[min(k, len(C) - 1)], l[min(k, len(l) - 1)], u[min(k, len(u) - 1)],
                lb[min(k, len(lb) - 1)], ub[min(k, len(ub) - 1)],
                x[k], y[k], z[k], z_box[k],
            )  # fmt: skip
        return 0

    return solve_network_batch
