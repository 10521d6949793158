"""The ways in from Python: by the address of a record, so nothing is unboxed or allocated.

Whoever calls keeps the arrays alive that own the record and the inputs.
"""

from typing import Any

import numpy as np

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.closed_forms.approximate_inverse import approximate_inverse
from ftqp.kernel.closed_forms.damping_factor import damping_factor
from ftqp.kernel.closed_forms.pseudoinverses import closed_form
from ftqp.kernel.closed_forms.reduced_problem import DTYPE as REDUCED
from ftqp.kernel.closed_forms.reduced_problem import gather
from ftqp.kernel.closed_forms.singularity import measure
from ftqp.kernel.entry.resolver import resolve
from ftqp.kernel.entry.tick import accept_state, prepare
from ftqp.kernel.jit import batch_entry, carray, entry, jit, pointer, prange
from ftqp.kernel.judge.external_qp import pack, unpack
from ftqp.kernel.judge.ladder import climb
from ftqp.kernel.judge.verdict import joint_torques
from ftqp.kernel.layout.enums import (
    ANSWERED,
    APPROXIMATE,
    NO_ROTATION,
    NOT_RESET,
    READY,
    SOLVED,
    TARGET_HAS_ROTATION,
    TARGET_SIZE,
    WRONG_SHAPE,
)
from ftqp.kernel.layout.record import DTYPE
from ftqp.kernel.maths.svd import svd
from ftqp.kernel.rows.inertial_target import base_verdict
from ftqp.kernel.rows.path_rows import COLUMNS, look_up

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
def path_target(address: int, table_at: int, rows: int, target_at: int) -> int:
    """The path's target at the record's progress, for a step along the path that follows.

    Args:
        address: of the record.
        table_at: of the path's table, (rows, 50).
        rows: how many intervals it has, the rest at its end included.
        target_at: where the packed target goes, (29,).
    """
    K = carray(pointer(address), 1, DTYPE)[0]
    table = carray(pointer(table_at), (rows, COLUMNS), FLOAT)
    look_up(K, table, rows, carray(pointer(target_at), (TARGET_SIZE,), FLOAT))
    return 0


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


@entry
def base_finish(address: int) -> int:
    """After a step on a moving base: the set point moves on; one of the codes BASE_*."""
    return base_verdict(carray(pointer(address), 1, DTYPE)[0])


@entry
def step_closed_form(address: int, q_at: int, v_at: int, target_at: int, nq: int) -> int:
    """One tick with the closed form whose memory the record names: as ``step``."""
    K = carray(pointer(address), 1, DTYPE)[0]
    code = accept(K, q_at, v_at, target_at, nq)
    if code < 0:
        return code
    return resolve(K, carray(pointer(K.resolver), 1, REDUCED)[0])


@entry
def measures(address: int, memory: int) -> int:
    """sigma_min, manipulability and condition of the last tick's reduced Jacobian, into the memory."""
    measure(carray(pointer(address), 1, DTYPE)[0], carray(pointer(memory), 1, REDUCED)[0])
    return 0


@entry
def resolve_reduced(memory: int) -> int:
    """x of a reduced problem alone, by its method."""
    P = carray(pointer(memory), 1, REDUCED)[0]
    if P.method == APPROXIMATE:
        approximate_inverse(P)
    else:
        gather(P, P.A, P.b, 1.0)
        closed_form(P)
    return 0


@entry
def damping(memory: int) -> int:
    """kappa of a reduced problem by its rule, whether or not the undamped rates break the limit."""
    P = carray(pointer(memory), 1, REDUCED)[0]
    gather(P, P.A, P.b, 1.0)
    svd(P)
    P.kappa = damping_factor(P)
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
