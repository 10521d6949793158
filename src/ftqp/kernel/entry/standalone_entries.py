"""QPs that no robot made: the active set and the network on memory of their own, and the residuals."""

from typing import Any

from ftqp.kernel.active_set.active_set import solve_standalone
from ftqp.kernel.dtrnn.network_of_qp import solve_network_standalone
from ftqp.kernel.jit import jit
from ftqp.kernel.judge.solution_check import kkt_residuals
from ftqp.kernel.layout.flat_arrays import OPTIONS
from ftqp.kernel.maths.elementary import matrix_view

__all__ = ["OPTIONS", "solve_standalone"]


@jit
def _parts(flat: Any, n: int, m: int, p: int) -> Any:
    """H, g, A, b, C, l, u, lb, ub of a QP in one piece, as in ``ftqp.qp.QPBuffers.flat``."""
    k = n + m + p
    at = n * n + n
    rows = matrix_view(flat, at, m + p, n)
    low = at + (m + p) * n
    high = low + k
    return (
        matrix_view(flat, 0, n, n), flat[n * n : at], rows[:m], flat[low + n : low + n + m], rows[m:],
        flat[low + n + m : high], flat[high + n + m : high + k], flat[low : low + n], flat[high : high + n],
    )  # fmt: skip


@jit
def kkt(problem: Any, s: Any, out: Any, n: int, m: int, p: int) -> None:
    """The KKT residuals, (4,), of a solution: x, z_box, y, z one after the other."""
    H, g, A, b, C, l, u, lb, ub = _parts(problem, n, m, p)
    x, z_box, y, z = s[:n], s[n : 2 * n], s[2 * n : 2 * n + m], s[2 * n + m :]
    kkt_residuals(H, g, A, b, C, l, u, lb, ub, x, y, z, z_box, out)


@jit
def solve_network(
    problem: Any, s: Any, memory: Any, numbers: Any, trace: Any, n: int, m: int, p: int, warm: int
) -> int:
    """The network on one QP: SOLVED, MAX_ITERATIONS, INFEASIBLE or FAILED.

    The solution, x, z_box, y, z one after the other, is the start when ``warm``, and is written for SOLVED
    and MAX_ITERATIONS. Iterations and |e| are written behind the options in ``numbers``, (9,).
    """
    H, g, A, b, C, l, u, lb, ub = _parts(problem, n, m, p)
    code, iterations, size = solve_network_standalone(
        memory, numbers, trace, n, m, p, warm, H, g, A, b, C, l, u, lb, ub,
        s[:n], s[2 * n : 2 * n + m], s[2 * n + m :], s[n : 2 * n],
    )  # fmt: skip
    numbers[OPTIONS], numbers[OPTIONS + 1] = iterations, size
    return code


@jit
def solve_network_batch(
    n: int, m: int, p: int, H: Any, g: Any, A: Any, b: Any, C: Any, l: Any, u: Any, lb: Any, ub: Any,
    numbers: Any, x: Any, y: Any, z: Any, z_box: Any, code: Any, iterations: Any, size: Any, memory: Any,
    first: int, last: int,
) -> None:  # fmt: skip
    """The network on problems ``first`` to ``last - 1``, each from zero; one input may be that of all."""
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
