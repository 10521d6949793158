"""The ways in from Python: by the address of a record, so nothing is unboxed or allocated.

Whoever calls keeps the arrays alive that own the record and the inputs.
"""

from typing import Any

import numpy as np

from ftqp.kernel.chain import forward_kinematics, motion
from ftqp.kernel.codes import (
    ANSWERED,
    NO_ROTATION,
    NOT_RESET,
    READY,
    SOLVED,
    TARGET_HAS_ROTATION,
    TARGET_SIZE,
    WRONG_SHAPE,
)
from ftqp.kernel.dynamics import dynamics
from ftqp.kernel.external import pack, unpack
from ftqp.kernel.jit import batch_entry, carray, entry, jit, pointer, prange
from ftqp.kernel.ladder import climb
from ftqp.kernel.record import DTYPE
from ftqp.kernel.tick import accept_state, prepare
from ftqp.kernel.verdict import joint_torques

FLOAT = np.dtype(np.float64)


@jit
def accept(K: Any, q_at: int, v_at: int, target_at: int, nq: int) -> int:
    """Copy the inputs that lie at the three addresses; 0, or a programmer's mistake (negative)."""
    if nq != K.n and nq != K.nq:
        return WRONG_SHAPE
    if not K.is_reset:
        return NOT_RESET
    target = carray(pointer(target_at), (TARGET_SIZE,), FLOAT)
    if K.uses_rotation and target[TARGET_HAS_ROTATION] == 0.0:
        return NO_ROTATION
    accept_state(K, carray(pointer(q_at), (nq,), FLOAT), carray(pointer(v_at), (K.n,), FLOAT))
    for k in range(TARGET_SIZE):
        K.target[k] = target[k]
    return 0


@entry
def step(address: int, q_at: int, v_at: int, target_at: int, nq: int) -> int:
    """One tick with the in-kernel solver: the status, or a negative code for a programmer's mistake.

    Args:
        address: of the record.
        q_at: of (nq,) numbers, nq being n for joint values or the size of a configuration [rad or m].
        v_at: of (n,) [rad/s or m/s].
        target_at: of a packed target, (29,).
        nq: how many numbers lie at q_at.
    """
    K = carray(pointer(address), 1, DTYPE)[0]
    code = accept(K, q_at, v_at, target_at, nq)
    if code < 0:
        return code
    return climb(K, prepare(K), SOLVED)


@entry
def prepare_external(address: int, q_at: int, v_at: int, target_at: int, nq: int, flat: Any) -> int:
    """Assemble the QP of a tick into ``flat``: READY, or a status that needed no external solver."""
    K = carray(pointer(address), 1, DTYPE)[0]
    code = accept(K, q_at, v_at, target_at, nq)
    if code < 0:
        return code
    code = climb(K, prepare(K), SOLVED)
    if code == READY:
        pack(K, flat)
    return code


@entry
def finish_external(address: int, flat: Any, claim: int, iterations: int) -> int:
    """Judge and clamp what the external solver answered, and turn it into a command: the status."""
    K = carray(pointer(address), 1, DTYPE)[0]
    unpack(K, flat)
    K.qp_iterations = iterations
    return climb(K, ANSWERED, claim)


@entry
def kinematics(address: int, q: Any, v: Any) -> int:
    """Tip pose, J and drift at (q, v) into the record: for set-up and studies, not for the loop."""
    K = carray(pointer(address), 1, DTYPE)[0]
    accept_state(K, q, v)
    forward_kinematics(K)
    motion(K)
    return 0


@entry
def inverse_dynamics(address: int, q: Any, v: Any) -> int:
    """Everything of ``kinematics``, and M and h."""
    K = carray(pointer(address), 1, DTYPE)[0]
    accept_state(K, q, v)
    forward_kinematics(K)
    motion(K)
    dynamics(K)
    return 0


@entry
def torques(address: int) -> int:
    """M, h and the torques of the last command, when the tick itself did without them."""
    K = carray(pointer(address), 1, DTYPE)[0]
    forward_kinematics(K)
    motion(K)
    dynamics(K)
    joint_torques(K)
    K.has_torques = 1
    return 0


@batch_entry
def batch(W: Any, q: Any, v: Any, targets: Any, events: Any, rates: Any, worst: Any, counts: Any) -> None:
    """Advance every record through the whole trajectory in closed loop, each with a fault of its own.

    Args:
        W: (B,) records. q, v: (B, n) start states, the final ones on return. targets: (K, 29) packed.
        events: (B, 3) joint, tick and fault code (joint -1: none). rates: (B,) locking deceleration.
        worst: (B, 2) largest position [m] and rotation error [rad]. counts: (B, 7) ticks per status.
    """
    for r in prange(len(W)):
        K = W[r]
        n = K.n
        for k in range(len(targets)):
            if events[r, 0] >= 0 and events[r, 1] == k:
                joint = events[r, 0]
                K.fault[joint] = events[r, 2]
                K.lock_rate[joint] = rates[r]
                K.lock_velocity[joint] = 1e300
                K.warm = 0
            accept_state(K, q[r], v[r])
            for i in range(TARGET_SIZE):
                K.target[i] = targets[k, i]
            code = climb(K, prepare(K), SOLVED)
            worst[r, 0] = max(worst[r, 0], K.position_error)
            worst[r, 1] = max(worst[r, 1], K.rotation_error)
            counts[r, code] += 1
            for i in range(n):
                q[r, i] = K.q_command[i]
                v[r, i] = K.v_command[i]
