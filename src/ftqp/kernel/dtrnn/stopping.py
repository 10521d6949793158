"""When the network stops, and how: what an iterate is worth as a solution of the QP."""

from typing import Any, NamedTuple

from ftqp.kernel.dtrnn.projection import Network
from ftqp.kernel.jit import jit

ROW_TOLERANCE = 1e-8
"""Largest |Ax - b| of a solved QP, beside max(1, |b|). A convention (docs/theory/recurrent-network.md, "When
to stop"): 10 nm of a path in metres."""
ROUNDING = 1e-14
"""Rounding of a sum, relative to its largest terms. 45 units of rounding, for some 60 terms."""
GAP_TOLERANCE = 1e-14
"""Largest duality gap of a solved QP, beside 1 + |x'Wx| + |c'x|. It bounds (x - x*)'W(x - x*)
(docs/theory/recurrent-network.md, "When to stop"), so that x is off by 1e-7 in the norm of W."""


class Options(NamedTuple):
    """How to solve.

    Attributes:
        method: LVI94, E47 or IMPLICIT of ``ftqp.kernel.dtrnn.iterations``.
        scaling: whether to scale.
        newton: whether to jump.
        paper: whether |e| <= tolerance alone is the end.
        cap: most iterations.
        gamma: step size.
        tolerance: of |e|; relative to 1 + |x| unless ``paper``.
    """

    method: int
    scaling: int
    newton: int
    paper: int
    cap: int
    gamma: float
    tolerance: float


@jit
def options_of(numbers: Any) -> Options:
    """Options from seven numbers in the order of the fields."""
    return Options(
        int(numbers[0]),
        int(numbers[1]),
        int(numbers[2]),
        int(numbers[3]),
        int(numbers[4]),
        numbers[5],
        numbers[6],
    )


@jit
def quality(net: Network, u: Any) -> tuple[float, float, float, float]:
    """What u is worth as a solution after clipping, in the QP's units: (r_eq, its scale, gap, its scale).

    With x clipped and g = Wx + c - A'y,

        r_eq = max |Ax - b|,  gap = sum max(g_i (x_i - lb_i), g_i (x_i - ub_i)) >= 0,

    and for r_eq = 0 both f(x) - f* <= gap and (x - x*)'W(x - x*) <= gap. Slacks count as variables.
    Source: docs/theory/recurrent-network.md, "When to stop".
    """
    N, primal = len(u), net.variables + net.slacks
    v = net.direction
    for i in range(N):
        v[i] = min(max(u[i], net.low[i]), net.high[i])
    gap, energy, r_eq, right = 0.0, 0.0, 0.0, 0.0
    for i in range(N):
        row = net.Gamma[i]
        force = net.z[i]
        for j in range(primal):
            force += row[j] * v[j]
        s = force
        for j in range(primal, N):
            s += row[j] * v[j]
        if i < primal:
            if s != 0.0:
                gap += s * (v[i] - (net.low[i] if s > 0.0 else net.high[i]))
            energy += (abs(force) + abs(net.z[i])) * abs(v[i])
        else:
            unit = net.norm[i - primal] / net.scales[1]
            r_eq = max(r_eq, abs(s) * unit)
            right = max(right, abs(net.z[i]) * unit)
    return r_eq, max(1.0, right), gap / net.scales[0], 1.0 + energy / net.scales[0]


@jit
def _rounding(net: Network, u: Any) -> float:
    """What rounding leaves of |e| at best: ROUNDING max_i sum_j |Gamma_ij u_j|."""
    N = len(u)
    largest = 0.0
    for i in range(N):
        row = net.Gamma[i]
        s = 0.0
        for j in range(N):
            s += abs(row[j] * u[j])
        largest = max(largest, s)
    return ROUNDING * largest


@jit
def is_solved(net: Network, o: Options, u: Any, size: float) -> bool:
    """Whether u, with e its residual and |e| = size, may be called solved.

    Paper: |e| <= tolerance. Else r_eq <= 1e-8 max(1, |b|) and (|e| <= tolerance (1 + |x|), or |e| is no more
    than rounding, or gap <= 1e-14 (1 + energy)).
    """
    if o.paper:
        return size <= o.tolerance
    primal = net.variables + net.slacks
    most = 1.0
    for i in range(primal):
        most = max(most, abs(u[i]))
    small = size <= o.tolerance * (1.0 + most)
    if not small:
        if size > 1e-3 * (1.0 + most):
            return False
        for k in range(net.rows):
            if abs(net.e[primal + k]) > 1e-6 * net.scales[1] * (1.0 + most):
                return False
        small = size <= _rounding(net, u)
    r_eq, right, gap, energy = quality(net, u)
    if not r_eq <= ROW_TOLERANCE * right:
        return False
    return small or gap <= GAP_TOLERANCE * energy
