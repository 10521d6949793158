"""The two-sided rows of a tick, kind by kind in the order of ``ftqp.kernel.layout.rows.ROW_KINDS``."""

from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import motion
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import VELOCITY
from ftqp.kernel.rows.torque_rows import torque_rows


@jit
def add_constraints(K: Any) -> None:
    """M, h and all rows of C; each kind fills its rows from the first free one on and returns the next."""
    if K.state.level == VELOCITY:
        motion(K)
    dynamics(K)
    K.kinematics.has_dynamics = 1
    at = torque_rows(K, 0)
    K.qp.nc = at


@jit
def within_guard(K: Any) -> bool:
    """Whether x asks for so little acceleration that every torque limit holds without being looked at.

    max_i |a_i| / a_max_i <= guard, where the planner has made sure that |h| + guard |M| a_max stays below the
    torque limits.
    """
    chain, limits, state, qp = K.chain, K.limits, K.state, K.qp
    for i in range(chain.n):
        a = qp.x[i] if state.level != VELOCITY else (qp.x[i] - state.v[i]) / state.dt
        if not abs(a) <= limits.guard * limits.a_max[i]:
            return False
    return True
