"""The network on the QP of a planner's tick, with a warm start of its own."""

from typing import Any

from ftqp.kernel.dtrnn.iterations import dtrnn
from ftqp.kernel.dtrnn.network_of_qp import assemble, publish, start
from ftqp.kernel.dtrnn.stopping import options_of
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import SOLVED
from ftqp.kernel.layout.network_memory import KEPT, SIZES, VALID
from ftqp.kernel.maths.matrix_view import matrix_view


@jit
def _row_kind(low: float, high: float) -> float:
    """2 for an equality, 1 for an inequality."""
    return 2.0 if low == high else 1.0


@jit
def _same_structure(qp: Any, kept: Any) -> bool:
    """Whether sizes, fixed variables and equality rows are those of the warm start; from now on they are."""
    same = kept[SIZES] == qp.nx and kept[SIZES + 1] == qp.meq and kept[SIZES + 2] == qp.nc
    kept[SIZES], kept[SIZES + 1], kept[SIZES + 2] = qp.nx, qp.meq, qp.nc
    for i in range(qp.nx):
        kind = _row_kind(qp.lb[i], qp.ub[i])
        same = same and kept[KEPT + i] == kind
        kept[KEPT + i] = kind
    for j in range(qp.nc):
        kind = _row_kind(qp.l[j], qp.u[j])
        same = same and kept[KEPT + qp.nx + j] == kind
        kept[KEPT + qp.nx + j] = kind
    return same


@part_jit
def solve_planner_qp(cascade: Any, qp: Any, memory: Any) -> int:
    """The QP that stands in a planner's record, from the warm start if there is one; the claim."""
    n, m, p = qp.nx, qp.meq, qp.nc
    at = KEPT + n + p
    x, y, z = memory[at : at + n], memory[at + n : at + n + m], memory[at + n + m : at + n + m + p]
    rest = memory[at + n + m + p :]
    warm = _same_structure(qp, memory) and memory[VALID] != 0.0
    memory[VALID] = 0.0
    code, net = assemble(
        rest,
        n,
        m,
        p,
        qp.dense,
        qp.H,
        qp.H_diagonal,
        qp.g,
        qp.A,
        qp.b,
        qp.soft,
        qp.C,
        qp.l,
        qp.u,
        qp.lb,
        qp.ub,
    )
    cascade.qp_iterations = 0
    if code != SOLVED:
        return code
    if warm:
        start(net, n, m, x, y, z)
    code, cascade.qp_iterations = dtrnn(net, options_of(memory), matrix_view(rest, 0, 0, 4))
    publish(
        net, n, m, p, qp.dense, qp.H, qp.H_diagonal, qp.g, qp.A, qp.C, qp.lb, qp.ub, qp.x, qp.y, qp.z,
        qp.z_box
    )  # fmt: skip
    if code == SOLVED:
        memory[VALID] = 1.0
        for i in range(n):
            x[i] = qp.x[i]
        for k in range(m):
            y[k] = qp.y[k]
        for j in range(p):
            z[j] = qp.z[j]
    return code
