"""What postures are worth: distance from singularities, torques against gravity, and what locks leave."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.chain import Chain, configuration_of
from ftqp.model.followers import coupled_columns, coupled_places, coupled_square
from ftqp.model.limits import JointLimits
from ftqp.model.shape import random_postures

LOOKED_AT = 400
"""Postures that are looked at: enough that one in a hundred is met with a probability of 0.98."""

NO_RANK = 1e-7
"""Where sigma_min over the characteristic length stays below this, a direction is lost by structure."""

LOCK_SEED = 20170511
SAMPLES, SEED = 100, 20260301
"""Postures that are looked at for what motors can give, the same every time."""
NEAR_SINGULAR = 0.02
"""A posture is near a singularity where sigma_min is below this share of the characteristic length."""


def scaled_jacobian(
    model: Any,
    data: Any,
    tip: int,
    configuration: FloatArray,
    rows: Sequence[str],
    length: float,
    tool_axes: FloatArray | None = None,
) -> FloatArray:
    """J (m, nv) [m], angular rows times the length, along W or ``tool_axes`` (3, 3) of the tip."""
    J = pin.computeFrameJacobian(model, data, configuration, tip, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    J = J.reshape(6, -1)  # pinocchio gives one joint's as a vector
    if tool_axes is not None:
        pin.updateFramePlacement(model, data, tip)
        J[3:] = (data.oMf[tip].rotation @ tool_axes).T @ J[3:]
    J[3:] *= length
    return np.array(J[[COMPONENTS.index(row) for row in rows]])


def least_singular_value(J: FloatArray) -> float:
    """The smallest of the min(m, n) singular values of J, (m, n); 0 where J is not finite."""
    if not (J.size and np.isfinite(J).all()):
        return 0.0
    return float(np.linalg.svd(J, compute_uv=False)[-1])


def gravity_torques(model: Any, data: Any, configuration: FloatArray) -> FloatArray:
    """The torques that hold an arm at rest, (nv,) [N m or N]; zeros without masses."""
    return np.array(pin.computeGeneralizedGravity(model, data, configuration))


def places(model: Any, tip: int, configuration: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where the joints and the tip are in the base, (nv + 1, 3) [m], and the axes of the joints, (nv, 3)."""
    data = model.createData()
    pin.computeJointJacobians(model, data, configuration)
    frame = model.frames[tip]
    end = data.oMi[frame.parentJoint] * frame.placement
    origins = [data.oMi[i].translation for i in range(1, model.njoints)]
    twists = data.J.reshape(6, -1)
    axes = np.where(np.abs(twists[3:]).any(axis=0), twists[3:], twists[:3]).T
    return np.array([*origins, end.translation]), axes


def acceleration_by_torque(model: Any, chain: Chain, limits: JointLimits) -> FloatArray:
    """The acceleration that each motor can give while the other joints rest, (nv,) [rad/s2 or m/s2].

    It is the least of max(0, tau_max_i - |g_i(q)|) / M_ii(q) over postures q inside the limits, the same
    ones every time. Infinite without a torque limit.
    """
    data = model.createData()
    least = np.full(len(limits), np.inf)
    for q in random_postures(limits, chain.prismatic, SAMPLES, np.random.default_rng(SEED)):
        configuration = configuration_of(model, chain.continuous, coupled_places(chain, q))
        M = np.array(pin.crba(model, data, configuration))
        inertia = np.diag(coupled_square(chain, np.triu(M) + np.triu(M, 1).T))
        holding = coupled_columns(chain, gravity_torques(model, data, configuration))
        left = np.maximum(limits.tau_max - np.abs(holding), 0.0)
        moved = inertia > 0.0  # a joint that follows another has no motor
        least[moved] = np.minimum(least, left / np.where(moved, inertia, 1.0))[moved]
    return least


@dataclass(frozen=True, slots=True, kw_only=True)
class Locks:
    """What a lock of each joint leaves of a task."""

    possible: bool  # Whether the healthy arm has the rank that the task needs anywhere
    # Share of the sampled postures at which the other joints still have it, by joint, 0 to 1
    left: dict[str, float]
    fatal: tuple[str, ...]  # The joints whose lock no sampled posture survives, by structure


def locks(robot: Any, rows: Sequence[str]) -> Locks:
    """What a lock of each joint leaves of the rows of a task, over postures inside the limits.

    A posture survives the lock of joint i where the Jacobian without column i has sigma_min >=
    ``NEAR_SINGULAR`` times the characteristic length. A lock is fatal by structure where sigma_min is zero to
    rounding at every posture: then the joint's angle alone decides what the task gets, as the elbow of an arm
    with spherical shoulder and wrist decides the distance of the hand. The samples are the same every time.
    """
    m, at = len(rows), [COMPONENTS.index(row) for row in rows]
    generator = np.random.default_rng(LOCK_SEED)
    drawn = random_postures(robot.limits, robot.chain.prismatic, LOOKED_AT, generator)
    J = np.array([robot.jacobian(q) for q in coupled_places(robot.chain, drawn)])
    J = (J * np.repeat([1.0, robot.length], 3)[:, None])[:, at]
    healthy = _sigma(J, m) / robot.length
    left, fatal = {}, []
    for i, joint in enumerate(robot.joints):
        rest = _sigma(np.delete(J, i, axis=2), m) / robot.length
        left[joint] = float(np.mean(rest >= NEAR_SINGULAR))
        if rest.max() < NO_RANK:
            fatal.append(joint)
    return Locks(possible=bool(healthy.max() >= NO_RANK), left=left, fatal=tuple(fatal))


def _sigma(J: FloatArray, m: int) -> FloatArray:
    """The m-th singular value of each, (S,); zeros where there are fewer columns."""
    if J.shape[2] < m:
        return np.zeros(len(J))
    return np.asarray(np.linalg.svd(J, compute_uv=False)[:, m - 1], dtype=np.float64)
