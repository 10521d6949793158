"""The way in to a plan that leads the null space."""

from collections.abc import Callable

import numpy as np

from ftqp.kernel.jit import carray, pointer
from ftqp.kernel.layout.plan_memory import plan_dtype
from ftqp.kernel.layout.record import record_dtype
from ftqp.kernel.rows.plan_posture import follow

FLOAT = np.dtype(np.float64)


def follow_plan(capacity: int) -> Callable[..., int]:
    """The posture of a planner's next tick, from the plan's record: 0."""
    dtype, plan = record_dtype(capacity), plan_dtype()

    def follow_plan(address: int, plan_at: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        P = carray(pointer(plan_at), 1, plan)[0]
        q = carray(pointer(P.q_at), (P.rows, K.chain.n), FLOAT)
        tips = carray(pointer(P.tip_at), (P.rows, 12), FLOAT)
        follow(K.state, K.criteria, K.kinematics, K.chain, P, q, tips)
        return 0

    return follow_plan
