"""The two-sided rows of a tick, kind by kind in the order of ``ftqp.kernel.layout.rows.ROW_KINDS``."""

from functools import reduce
from importlib import import_module
from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import motion
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import VELOCITY
from ftqp.kernel.layout.rows import ROW_KINDS, RowKind


@jit
def _nothing(K: Any, at: int) -> int:
    """No rows."""
    return at


def _then(first: Any, kind: RowKind) -> Any:
    """The rows of the first, then those of a kind, if the arm has what they need."""
    needs_inertia, fill = kind.needs_inertia, import_module(f"ftqp.kernel.rows.{kind.module}").fill

    @jit
    def both(K: Any, at: int) -> int:
        at = first(K, at)
        if needs_inertia and not K.chain.has_inertia:
            return at
        return fill(K, at)

    return both


fill_all: Any = reduce(_then, ROW_KINDS, _nothing)
"""All rows of C, kind by kind."""


@rare_jit
def add_constraints(K: Any) -> None:
    """All rows of C, and M and h of an arm that has them."""
    if K.state.level == VELOCITY:
        motion(K)
    if K.chain.has_inertia:
        dynamics(K)
        K.kinematics.has_dynamics = 1
    K.qp.nc = fill_all(K, 0)


@jit
def within_guard(K: Any) -> bool:
    """Whether x asks for so little acceleration that every torque limit holds without being looked at.

    It does when max_i |a_i| / a_max_i <= guard, where the planner has made sure that |h| + guard |M| a_max
    stays below the torque limits.
    """
    chain, limits, state, qp = K.chain, K.limits, K.state, K.qp
    for i in range(chain.n):
        a = qp.x[i] if state.level != VELOCITY else (qp.x[i] - state.v[i]) / state.dt
        if not abs(a) <= limits.guard * limits.a_max[i]:
            return False
    return True
