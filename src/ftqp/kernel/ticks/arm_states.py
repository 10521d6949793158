"""Kinematics and dynamics of an arm alone, for set-up, simulation and studies."""

from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.jit import jit, take
from ftqp.kernel.judge.solution_check import torques_without_inertia
from ftqp.kernel.layout.enums import WRONG_SHAPE
from ftqp.kernel.ticks.accepted_inputs import accept_state


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


@jit
def kinematics(K: Any, nq: int) -> None:
    """Tip pose, J and drift at the state that the arm's record was given."""
    accept_state(K.state, K.chain, nq)
    forward_kinematics(K, K.state)
    motion(K, K.state)


@jit
def inverse_dynamics(K: Any, nq: int) -> None:
    """Everything of ``kinematics``, and M and h."""
    kinematics(K, nq)
    dynamics(K, K.state)


@jit
def torques(K: Any) -> None:
    """The torques of the command in the record, when the tick itself did without M and h."""
    forward_kinematics(K, K.state)  # the record may hold a kept step's state
    motion(K, K.state)
    torques_without_inertia(K)


@jit
def servo_torques(K: Any, S: Any, q: Any, v: Any, limit: Any) -> int:
    """The torques of joint servos at a state: 1 if a motor is at its limit, 0 if none is, or a mistake."""
    n = K.chain.n
    if (
        take(q, 0, K.state.q.ctypes.data, n, 1) != n
        or take(v, 0, K.state.v.ctypes.data, n, 1) != n
        or take(limit, 0, S.limit.ctypes.data, n, 1) != n
    ):
        return WRONG_SHAPE
    forward_kinematics(K, K.state)
    motion(K, K.state)
    dynamics(K, K.state)
    wanted(K.state, K.chain, S)
    return ask(K.kinematics, K.chain, S)
