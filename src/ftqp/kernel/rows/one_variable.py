"""What is asked of one variable of the QP: its interval, and the value that it should be near.

The intervals of all joints come from ``ftqp.kernel.rows.joint_intervals`` and the objective from
``ftqp.kernel.rows.objective``; whatever asks for something else of a joint or of a path's rate says it so.
"""

from typing import Any

from ftqp.kernel.jit import jit


@jit
def bound(qp: Any, i: int, low: float, high: float) -> None:
    """low <= x_i <= high."""
    qp.lb[i], qp.ub[i] = low, high


@jit
def fix(qp: Any, i: int, x: float) -> None:
    """x_i = x."""
    bound(qp, i, x, x)


@jit
def widen(qp: Any, i: int, low: float, high: float) -> None:
    """Let x_i go to low and to high, too."""
    bound(qp, i, min(qp.lb[i], low), max(qp.ub[i], high))


@jit
def narrow(qp: Any, i: int, low: float, high: float) -> None:
    """low <= x_i <= high within the interval that x_i has; where they do not meet, its nearer end."""
    lb, ub = qp.lb[i], qp.ub[i]
    bound(qp, i, min(max(low, lb), ub), max(min(high, ub), lb))


@jit
def draw(qp: Any, i: int, weight: float, x: float) -> None:
    """weight (x_i - x)^2/2 in the place of what a diagonal objective has for x_i."""
    qp.H_diagonal[i] = weight
    qp.g[i] = -weight * x


@jit
def lighten(qp: Any, i: int, share: float) -> None:
    """The same with that share of its weight."""
    qp.H_diagonal[i] *= share
    qp.g[i] *= share
