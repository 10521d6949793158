"""The recurrent network's form of a QP: a projection equation e(u) = 0 in primal and dual variables.

    min 1/2 x'Wx + c'x,  A x + diag(soft) y = b,  l <= C x <= u,  lb <= x <= ub

becomes, with s = C x in [l, u] as variables of their own and u = (x; s; y),

    Gamma = [[W, 0, -A', -C'], [0, 0, 0, I], [A, 0, diag(soft), 0], [C, -I, 0, 0]],   z = (c; 0; -b; 0),
    Omega = [lb, ub] x [l, u] x R^m,   e(u) = u - P(u - (Gamma u + z)) = 0  <=>  u solves the QP,

P being the projection onto Omega, a clip. Here L = f(x) - y'(Ax - b), so that y is minus that of ``ftqp.QP``.
The dual's bounds of +-1e10 in the paper stand for no bounds. A compliant row A_k x + s_k = b_k with cost
s_k^2/(2 soft_k) has s_k = soft_k y_k.

Fixed variables (lb = ub) are eliminated, rows of C are divided by their norm, those with l = u need no s,
those without a bound are left out. The matrices are scaled by the rule of ``ftqp.kernel.dtrnn.iterations``:
the objective by ``scales[0]``, the rows by ``scales[1]``, so that y of the network is ``scales[0]/scales[1]``
times that of the QP.
Source: Jin et al. 2017, section 3; the slacks and the compliance are additions.
"""

from math import sqrt
from typing import Any, NamedTuple

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.finite import is_finite
from ftqp.kernel.maths.matrix_view import matrix_view


class Network(NamedTuple):
    """Gamma, z, Omega and the state u in the memory of a solve; N = variables + slacks + rows.

    Attributes:
        variables: How many free variables there are.
        slacks: How many two-sided rows have one.
        rows: How many multipliers there are; the last ones belong to the slacks.
        Gamma: (N, N).
        z: (N,).
        low: Lower ends of Omega, (N,).
        high: Upper ends of Omega, (N,).
        u: The state (x; s; y), (N,).
        F: Gamma u + z, (N,).
        e: The residual, (N,).
        factor: The factors of I + Gamma, (N, N).
        jump: Memory of the last jump, (N, N).
        pivots: Those of ``factor``, (N,).
        jump_pivots: Those of ``jump``, (N,).
        order: The open components of a jump, (N,), whole numbers.
        side: Which bound each component sits at in a jump, (N,): -1, 0 or 1.
        direction: Memory, (N,).
        trial: The point that a jump tries, (N,).
        variable: The index in the QP of each free variable.
        row: The index in the QP of each row, those of C after those of A.
        norm: What each row was divided by.
        scales: Of objective and rows, (2,).
    """

    variables: int
    slacks: int
    rows: int
    Gamma: Any
    z: Any
    low: Any
    high: Any
    u: Any
    F: Any
    e: Any
    factor: Any
    jump: Any
    pivots: Any
    jump_pivots: Any
    order: Any
    side: Any
    direction: Any
    trial: Any
    variable: Any
    row: Any
    norm: Any
    scales: Any


@jit
def network(memory: Any, variables: int, slacks: int, rows: int) -> Network:
    """The views of a network of these sizes, one after the other in ``memory``."""
    N = variables + slacks + rows
    at = 3 * N * N
    return Network(
        variables,
        slacks,
        rows,
        matrix_view(memory, 0, N, N),
        memory[at : at + N],
        memory[at + N : at + 2 * N],
        memory[at + 2 * N : at + 3 * N],
        memory[at + 3 * N : at + 4 * N],
        memory[at + 4 * N : at + 5 * N],
        memory[at + 5 * N : at + 6 * N],
        matrix_view(memory, N * N, N, N),
        matrix_view(memory, 2 * N * N, N, N),
        memory[at + 6 * N : at + 7 * N],
        memory[at + 7 * N : at + 8 * N],
        memory[at + 8 * N : at + 9 * N],
        memory[at + 9 * N : at + 10 * N],
        memory[at + 10 * N : at + 11 * N],
        memory[at + 11 * N : at + 12 * N],
        memory[at + 12 * N : at + 13 * N],
        memory[at + 13 * N : at + 14 * N],
        memory[at + 14 * N : at + 15 * N],
        memory[at + 15 * N : at + 15 * N + 2],
    )


@jit
def rescale(net: Network, objective: float, rows: float) -> None:
    """Scale Gamma, z and y to another scale of objective and rows; the solution x stays the same.

    Gamma^ = [[s W, -q A'], [q A, (q^2/s) soft]],  z^ = (s c; -q b),  y^ = y s/q
    """
    s, q = objective / net.scales[0], rows / net.scales[1]
    net.scales[0], net.scales[1] = objective, rows
    primal = net.variables + net.slacks
    N = primal + net.rows
    for i in range(N):
        net.z[i] *= s if i < primal else q
        for j in range(N):
            if i < primal and j < primal:
                net.Gamma[i, j] *= s
            elif i < primal or j < primal:
                net.Gamma[i, j] *= q
            else:
                net.Gamma[i, j] *= q * q / s
        if i >= primal:
            net.u[i] *= s / q


@jit
def project(net: Network, v: Any) -> None:
    """v <- P(v), componentwise clip onto Omega."""
    for i in range(len(v)):
        v[i] = min(max(v[i], net.low[i]), net.high[i])


@jit
def residual(net: Network, u: Any) -> float:
    """e = u - P(u - F) with F = Gamma u + z, both kept; returns |e|."""
    N = len(u)
    total = 0.0
    for i in range(N):
        row = net.Gamma[i]
        F = net.z[i]
        for j in range(N):
            F += row[j] * u[j]
        net.F[i] = F
        e = u[i] - min(max(u[i] - F, net.low[i]), net.high[i])
        net.e[i] = e
        total += e * e
    return sqrt(total)


@jit
def is_number(net: Network) -> bool:
    """Whether Gamma and z are finite."""
    N = len(net.z)
    for i in range(N):
        if not is_finite(net.z[i]):
            return False
        for j in range(N):
            if not is_finite(net.Gamma[i, j]):
                return False
    return True
