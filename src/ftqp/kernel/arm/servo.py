"""The torques by which joint servos make an arm follow positions or velocities."""

from typing import Any

from ftqp.kernel.jit import jit


@jit
def wanted(state: Any, chain: Any, S: Any) -> None:
    """a_i = g_p (q_c - q) + g_d (v_c - v), what the servo of each joint wants of it."""
    q, v = state.q, state.v
    for i in range(chain.n):
        S.a[i] = S.stiffness * (S.q[i] - q[i]) + S.damping * (S.v[i] - v[i])


@jit
def _obeys(S: Any, i: int) -> bool:
    """Whether joint i does what its servo wants."""
    obeys: bool = S.limit[i] > 0.0 and S.unresponsive[i] == 0.0
    return obeys


@jit
def ask(kinematics: Any, chain: Any, S: Any) -> int:
    """tau_i = sum_j M_ij a_j + h_i over joint i and those that obey: 1 if a motor that obeys is at its limit.

    Needs M and h. What joints that do not obey are wanted to do throws no other about.
    Source: docs/mujoco-plant.md, "The arm".
    """
    n, M, h = chain.n, kinematics.M, kinematics.h
    full = 0
    for i in range(n):
        total = h[i]
        for j in range(n):
            if i == j or _obeys(S, j):
                total += M[i, j] * S.a[j]
        if _obeys(S, i) and abs(total) > S.limit[i]:
            full = 1
        S.demand[i] = min(max(total, -S.tau_max[i]), S.tau_max[i])
        S.tau[i] = min(max(total, -S.limit[i]), S.limit[i])
    return full
