"""Kinematics and dynamics of an arm alone, for set-up, simulation and studies."""

from collections.abc import Callable

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.jit import carray, pointer
from ftqp.kernel.judge.verdict import torques_without_inertia
from ftqp.kernel.layout.record import arm_dtype, record_dtype
from ftqp.kernel.ticks.accepted_inputs import accept_state


def kinematics(capacity: int) -> Callable[..., int]:
    """Tip pose, J and drift at the state that the arm's record was given."""
    dtype = arm_dtype(capacity)

    def kinematics(address: int, nq: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        accept_state(K, nq)
        forward_kinematics(K)
        motion(K)
        return 0

    return kinematics


def inverse_dynamics(capacity: int) -> Callable[..., int]:
    """Everything of ``kinematics``, and M and h."""
    dtype = arm_dtype(capacity)

    def inverse_dynamics(address: int, nq: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        accept_state(K, nq)
        forward_kinematics(K)
        motion(K)
        dynamics(K)
        return 0

    return inverse_dynamics


def torques(capacity: int) -> Callable[..., int]:
    """The torques of the command in the record, when the tick itself did without M and h."""
    dtype = record_dtype(capacity)

    def torques(address: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        forward_kinematics(K)  # the record may hold a kept step's state
        motion(K)
        torques_without_inertia(K)
        return 0

    return torques
