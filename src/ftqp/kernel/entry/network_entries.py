"""The network's ways in: a planner's tick, one QP alone, and many QPs at once.

Whoever calls keeps the arrays alive whose addresses are passed.
"""

from typing import Any

from ftqp.kernel.dtrnn.iterations import dtrnn
from ftqp.kernel.dtrnn.network_of_qp import assemble, publish, start
from ftqp.kernel.dtrnn.projection import Network, is_number, memory_size, residual
from ftqp.kernel.dtrnn.stopping import OPTIONS, options_of
from ftqp.kernel.entry.entries import FLOAT, accept
from ftqp.kernel.entry.tick import prepare
from ftqp.kernel.jit import batch_entry, carray, entry, jit, pointer, prange
from ftqp.kernel.judge.ladder import climb
from ftqp.kernel.layout.enums import ANSWERED, FAILED, MAIN_STAGE, MAX_ITERATIONS, READY, SOLVED
from ftqp.kernel.layout.record import DTYPE
from ftqp.kernel.maths.cholesky import factor

CONVEX = 1e-9
"""H + CONVEX max(H_ii) I has a Cholesky factor when H counts as positive semidefinite."""
VALID, SIZES, KEPT = OPTIONS, OPTIONS + 1, OPTIONS + 4
"""In a planner's memory: options, whether a warm start is kept, the sizes it is for, then it and the
network."""


@jit
def planner_memory_size(n: int, m: int, p: int) -> int:
    """Numbers that a planner of n variables, m task rows and p two-sided rows needs for the network."""
    return KEPT + 2 * (n + p) + m + memory_size(n, m, p)


@jit
def _row_kind(low: float, high: float) -> float:
    """2 for an equality, 1 for an inequality."""
    return 2.0 if low == high else 1.0


@jit
def _same_structure(K: Any, kept: Any) -> bool:
    """Whether sizes, fixed variables and equality rows are those of the warm start; from now on they are."""
    same = kept[SIZES] == K.nx and kept[SIZES + 1] == K.meq and kept[SIZES + 2] == K.nc
    kept[SIZES], kept[SIZES + 1], kept[SIZES + 2] = K.nx, K.meq, K.nc
    for i in range(K.nx):
        kind = _row_kind(K.lb[i], K.ub[i])
        same = same and kept[KEPT + i] == kind
        kept[KEPT + i] = kind
    for j in range(K.nc):
        kind = _row_kind(K.l[j], K.u[j])
        same = same and kept[KEPT + K.nx + j] == kind
        kept[KEPT + K.nx + j] = kind
    return same


@jit
def _solve_record(K: Any, memory: Any) -> int:
    """The QP that stands in a planner's record, from the warm start if there is one; the claim."""
    n, m, p = K.nx, K.meq, K.nc
    at = KEPT + n + p
    x, y, z = memory[at : at + n], memory[at + n : at + n + m], memory[at + n + m : at + n + m + p]
    rest = memory[at + n + m + p :]
    warm = _same_structure(K, memory) and memory[VALID] != 0.0
    memory[VALID] = 0.0
    code, net = assemble(
        rest, n, m, p, K.dense, K.H, K.H_diagonal, K.g, K.A, K.b, K.soft, K.C, K.l, K.u, K.lb, K.ub
    )
    K.qp_iterations = 0
    if code != SOLVED:
        return code
    if warm:
        start(net, n, m, x, y, z)
    code, K.qp_iterations = dtrnn(net, options_of(memory), rest[:0].reshape((0, 4)))
    publish(
        net, n, m, p, K.dense, K.H, K.H_diagonal, K.g, K.A, K.C, K.lb, K.ub, K.x, K.y, K.z, K.z_box
    )  # fmt: skip
    if code == SOLVED:
        memory[VALID] = 1.0
        for i in range(n):
            x[i] = K.x[i]
        for k in range(m):
            y[k] = K.y[k]
        for j in range(p):
            z[j] = K.z[j]
    return code


@entry
def step_dtrnn(address: int, q_at: int, v_at: int, target_at: int, nq: int) -> int:
    """One tick with the network: ``ftqp.kernel.entry.entries.step``, the QP of the task solved by
    ``ftqp.kernel.dtrnn.iterations``.

    The other rungs of the ladder use the active set. The warm start lives in the memory at ``K.network`` and
    is dropped when ``K.warm`` is 0 (a fault, a reset), when the last tick did not end with a solved QP of the
    task, or when which variables are fixed has changed.
    """
    K = carray(pointer(address), 1, DTYPE)[0]
    code = accept(K, q_at, v_at, target_at, nq)
    if code < 0:
        return code
    memory = carray(pointer(K.network), (planner_memory_size(K.n + 1, K.m, K.n),), FLOAT)
    if K.warm == 0:
        memory[VALID] = 0.0
    code = climb(K, prepare(K), SOLVED)
    while code == READY:
        code = climb(K, ANSWERED, _solve_record(K, memory))
    K.warm = 1 if K.stage == MAIN_STAGE and memory[VALID] != 0.0 else 0
    return code


@jit
def _is_convex(net: Network) -> bool:
    """Whether W is positive semidefinite, up to rounding."""
    n, S = net.variables, net.jump
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(net.Gamma[i, i]))
    for i in range(n):
        for j in range(i + 1):
            S[i, j] = net.Gamma[i, j]
        S[i, i] += CONVEX * largest
    return largest == 0.0 or factor(S, n)


@jit
def _solve(
    memory: Any,
    numbers: Any,
    trace: Any,
    n: int,
    m: int,
    p: int,
    warm: int,
    H: Any,
    g: Any,
    A: Any,
    b: Any,
    C: Any,
    l: Any,
    u: Any,
    lb: Any,
    ub: Any,
    x: Any,
    y: Any,
    z: Any,
    z_box: Any,
) -> tuple[int, int, float]:
    """One QP with hard rows: code, iterations and |e|; outputs are written for SOLVED and MAX_ITERATIONS."""
    soft = memory[len(memory) - m :]
    for k in range(m):
        soft[k] = 0.0
    code, net = assemble(memory, n, m, p, 1, H, g, g, A, b, soft, C, l, u, lb, ub)
    iterations, size = 0, 0.0
    if code == SOLVED and not (is_number(net) and _is_convex(net)):
        code = FAILED
    if code == SOLVED:
        if warm:
            start(net, n, m, x, y, z)
        code, iterations = dtrnn(net, options_of(numbers), trace)
        size = residual(net, net.u)
    if code == SOLVED or code == MAX_ITERATIONS:
        publish(net, n, m, p, 1, H, g, g, A, C, lb, ub, x, y, z, z_box)
    return code, iterations, size


@entry
def solve_dtrnn(problem: Any, solution: Any, memory: Any, numbers: Any, trace: Any, n: int, m: int, p: int,
                warm: int) -> int:  # fmt: skip
    """One QP: SOLVED, MAX_ITERATIONS, INFEASIBLE or FAILED.

    Args:
        problem: H, g, A, C, lb, b, l, ub, b, u one after the other, as in ``ftqp.qp.QPBuffers.flat``.
        solution: x, z_box, y, z one after the other; the start when ``warm``; written for SOLVED and
            MAX_ITERATIONS.
        memory: of ``solve_memory_size(n, m, p)``.
        numbers: the options, (9,); iterations and |e| are written behind them.
        trace: (iterations, 4), see ``ftqp.kernel.dtrnn.iterations``.
        n, m, p: sizes.
        warm: whether to start from ``solution``.
    """
    k = n + m + p
    at = n * n + n
    rows = problem[at : at + (m + p) * n].reshape((m + p, n))
    low = at + (m + p) * n
    high = low + k
    code, iterations, size = _solve(
        memory,
        numbers,
        trace,
        n,
        m,
        p,
        warm,
        problem[: n * n].reshape((n, n)),
        problem[n * n : at],
        rows[:m],
        problem[low + n : low + n + m],
        rows[m:],
        problem[low + n + m : high],
        problem[high + n + m : high + k],
        problem[low : low + n],
        problem[high : high + n],
        solution[:n],
        solution[2 * n : 2 * n + m],
        solution[2 * n + m :],
        solution[n : 2 * n],
    )
    numbers[OPTIONS], numbers[OPTIONS + 1] = iterations, size
    return code


@jit
def solve_memory_size(n: int, m: int, p: int) -> int:
    """Numbers that ``solve_dtrnn`` needs."""
    return memory_size(n, m, p) + m


@batch_entry
def solve_dtrnn_batch(H: Any, g: Any, A: Any, b: Any, C: Any, l: Any, u: Any, lb: Any, ub: Any, numbers: Any,
                      memory: Any, x: Any, y: Any, z: Any, z_box: Any, code: Any, iterations: Any,
                      size: Any) -> None:  # fmt: skip
    """Many QPs of the same sizes, each from 0; an input with a leading axis of length 1 is shared by all.

    Args:
        H: (B or 1, n, n). g, lb, ub: (B or 1, n). A: (B or 1, m, n). b: (B or 1, m). C: (B or 1, p, n).
        l, u: (B or 1, p).
        numbers: the options, (7,).
        memory: (parts, ``solve_memory_size(n, m, p)``): the problems are shared out among the parts.
        x, z_box: (B, n). y: (B, m). z: (B, p). code, iterations: (B,). size: |e|, (B,).
    """
    count, n, m, p = len(x), g.shape[1], b.shape[1], l.shape[1]
    parts = len(memory)
    trace = numbers[:0].reshape((0, 4))
    for part in prange(parts):
        for k in range(part * count // parts, (part + 1) * count // parts):
            code[k], iterations[k], size[k] = _solve(
                memory[part],
                numbers,
                trace,
                n,
                m,
                p,
                0,
                H[min(k, len(H) - 1)],
                g[min(k, len(g) - 1)],
                A[min(k, len(A) - 1)],
                b[min(k, len(b) - 1)],
                C[min(k, len(C) - 1)],
                l[min(k, len(l) - 1)],
                u[min(k, len(u) - 1)],
                lb[min(k, len(lb) - 1)],
                ub[min(k, len(ub) - 1)],
                x[k],
                y[k],
                z[k],
                z_box[k],
            )
