"""A motion of the joints in the place of the task: the QP is as near to it as box and torque rows allow.

    1/2 |x - d|^2 over the joints that work,   d = x_r + kv (v_r - v) + kp (q_r - q)

x_r is the mean acceleration of the motion until the next tick, or at the velocity level its mean velocity,
with kv = 0. Source: docs/theory/ways-to-a-goal.md.
"""

from typing import Any

from ftqp.kernel.arm.kinematics import forward_kinematics, mimic_places
from ftqp.kernel.jit import jit
from ftqp.kernel.latches.settling import forget_settling
from ftqp.kernel.layout.enums import (
    FREE,
    HEALTHY,
    TARGET_ACCELERATION,
    TARGET_HAS_ROTATION,
    TARGET_POSE,
    TARGET_TWIST,
)
from ftqp.kernel.rows.joint_intervals import draw

FREE_WEIGHT = 1e-6
"""Weight of a free-swinging joint, which others are not to hold still; H stays positive definite. Six digits
below the others' weight, 1, so that it costs them nothing that shows."""


@jit
def aim_at_reference(K: Any, joints: Any) -> None:
    """The target of the tip: where it would be if every joint that works were on the motion.

    The kinematics of the tick's own state are there again afterwards.
    """
    chain, state, supposed, kinematics, target = K.chain, K.state, K.supposed, K.kinematics, K.task.target
    for i in range(chain.n):
        supposed.q[i] = joints.q[i] if K.faults.code[i] == HEALTHY else state.q[i]
    if chain.mimics:
        mimic_places(chain, supposed.q)
    forward_kinematics(K, supposed)
    for r in range(3):
        for c in range(3):
            target[TARGET_POSE + 4 * r + c] = kinematics.R_tip[3 * r + c]
        target[TARGET_POSE + 4 * r + 3] = kinematics.o_tip[r]
    for k in range(TARGET_TWIST, TARGET_ACCELERATION + 6):
        target[k] = 0.0
    target[TARGET_HAS_ROTATION] = 1.0
    forward_kinematics(K, state)


@jit
def joint_objective(K: Any, joints: Any) -> None:
    """H and g of the joints, no rows of the task; nothing is held that the task had held."""
    chain, faults, state, task, qp = K.chain, K.faults, K.state, K.task, K.qp
    forget_settling(K.calm)
    K.calm.entered = 0
    for i in range(chain.n):
        demand = joints.x[i] + joints.kv * (joints.v[i] - state.v[i]) + joints.kp * (joints.q[i] - state.q[i])
        joints.demand[i] = demand if faults.code[i] == HEALTHY else 0.0
        draw(qp, i, FREE_WEIGHT if faults.code[i] == FREE else 1.0, joints.demand[i])
    for k in range(task.m):
        task.slack[k] = task.asked[k] = 0.0
    qp.nx, qp.meq, qp.dense, qp.warm = chain.n, 0, 0, 0
    qp.soft[0] = 1.0
    task.beyond = 0.0
