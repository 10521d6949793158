"""QPs that no robot made: the active set and the network on memory of their own."""

from typing import Any

from ftqp.kernel.active_set.active_set import solve_standalone
from ftqp.kernel.dtrnn.iterations import solve_network
from ftqp.kernel.dtrnn.network import Problem
from ftqp.kernel.jit import jit
from ftqp.kernel.maths.elementary import matrix_view

__all__ = ["solve_standalone"]


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
def solve_networks(
    problems: Any, solutions: Any, found: Any, memory: Any, numbers: Any, trace: Any, n: int, m: int, p: int,
    warm: int, first: int, last: int,
) -> None:  # fmt: skip
    """The network on QPs ``first`` to ``last - 1``; one may stand for all.

    A solution, x, z_box, y, z one after the other, is the start when ``warm``, and is written for SOLVED and
    MAX_ITERATIONS. Code, iterations and |e| go into the rows of ``found``.
    """
    soft = memory[len(memory) - m :]
    soft[:m] = 0.0
    for k in range(first, last):
        H, g, A, b, C, l, u, lb, ub = _parts(problems[min(k, len(problems) - 1)], n, m, p)
        Q = Problem(n, m, p, 1, H, g, g, A, b, soft, C, l, u, lb, ub)
        s = solutions[k]
        found[k, 0], found[k, 1], found[k, 2] = solve_network(
            memory, numbers, trace, warm, Q, s[:n], s[2 * n : 2 * n + m], s[2 * n + m :], s[n : 2 * n]
        )
