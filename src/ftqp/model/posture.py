"""What one posture is worth: distance from singularities and torques against gravity, for set-up."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.rows import COMPONENTS
from ftqp.model.chain import Chain, configuration_of
from ftqp.model.followers import coupled_columns, coupled_places, coupled_square
from ftqp.model.limits import JointLimits
from ftqp.model.shape import random_postures

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
    """The task's Jacobian, its angular rows times the characteristic length, (m, nv) [m].

    The frames are placed in ``data``, and ``length`` is the characteristic length [m]. Angular rows go along
    W, or along ``tool_axes``, a rotation (3, 3) from the tip's frame.
    """
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
