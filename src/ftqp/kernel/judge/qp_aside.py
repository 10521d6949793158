"""The task's QP put aside while another one is solved with its rows: sizes, objective and box."""

from typing import Any

from ftqp.kernel.jit import jit


@jit
def put_aside(chain: Any, qp: Any, aside: Any) -> None:
    """Keep sizes, objective and box of the joints."""
    aside.nx, aside.meq, aside.dense = qp.nx, qp.meq, qp.dense
    for i in range(chain.n):
        aside.g[i], aside.H_diagonal[i] = qp.g[i], qp.H_diagonal[i]
        aside.lb[i], aside.ub[i] = qp.lb[i], qp.ub[i]


@jit
def take_up(chain: Any, qp: Any, aside: Any) -> None:
    """Sizes and objective again; the box is up to whoever takes the QP up."""
    for i in range(chain.n):
        qp.g[i], qp.H_diagonal[i] = aside.g[i], aside.H_diagonal[i]
    qp.nx, qp.meq, qp.dense = aside.nx, aside.meq, aside.dense
