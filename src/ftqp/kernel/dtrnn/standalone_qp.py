"""The network on one QP that is not a planner's."""

from typing import Any

from ftqp.kernel.dtrnn.iterations import dtrnn
from ftqp.kernel.dtrnn.network_of_qp import assemble, publish, start
from ftqp.kernel.dtrnn.projection import Network, is_number, residual
from ftqp.kernel.dtrnn.stopping import options_of
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FAILED, MAX_ITERATIONS, SOLVED
from ftqp.kernel.maths.cholesky import factor

CONVEX = 1e-9
"""H + CONVEX max(H_ii) I has a Cholesky factor when H counts as positive semidefinite: rounding makes
eigenvalues of zero some 1e-15 of the largest."""


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
def solve_network_standalone(
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
