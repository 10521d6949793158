"""Kinematics and dynamics of an arm alone, for set-up, simulation and studies."""

from collections.abc import Callable
from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.arm.servo import ask, wanted
from ftqp.kernel.compiled.taking import take
from ftqp.kernel.jit import carray, pointer
from ftqp.kernel.judge.solution_check import torques_without_inertia
from ftqp.kernel.layout.enums import WRONG_SHAPE
from ftqp.kernel.layout.record import arm_dtype, record_dtype
from ftqp.kernel.layout.servo_memory import servo_dtype
from ftqp.kernel.ticks.accepted_inputs import accept_state


def kinematics(capacity: int) -> Callable[..., int]:
    """Tip pose, J and drift at the state that the arm's record was given."""
    dtype = arm_dtype(capacity)

    def kinematics(address: int, nq: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        accept_state(K.state, K.chain, nq)
        forward_kinematics(K, K.state)
        motion(K, K.state)
        return 0

    return kinematics


def inverse_dynamics(capacity: int) -> Callable[..., int]:
    """Everything of ``kinematics``, and M and h."""
    dtype = arm_dtype(capacity)

    def inverse_dynamics(address: int, nq: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        accept_state(K.state, K.chain, nq)
        forward_kinematics(K, K.state)
        motion(K, K.state)
        dynamics(K, K.state)
        return 0

    return inverse_dynamics


def torques(capacity: int) -> Callable[..., int]:
    """The torques of the command in the record, when the tick itself did without M and h."""
    dtype = record_dtype(capacity)

    def torques(address: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        forward_kinematics(K, K.state)  # the record may hold a kept step's state
        motion(K, K.state)
        torques_without_inertia(K)
        return 0

    return torques


def servo_torques(capacity: int) -> Callable[..., int]:
    """The torques of joint servos at a state: 1 if a motor is at its limit, 0 if none is, or a mistake."""
    dtype, servo = arm_dtype(capacity), servo_dtype(capacity)

    def servo_torques(address: int, servo_at: int, q: Any, v: Any, limit: Any) -> int:
        K, S = carray(pointer(address), 1, dtype)[0], carray(pointer(servo_at), 1, servo)[0]
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

    return servo_torques
