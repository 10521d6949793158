"""The acceleration that motors can give: what a guessed acceleration limit is to be judged by."""

from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.model.chain import configuration_of
from ftqp.model.limits import JointLimits
from ftqp.model.posture import gravity_torques
from ftqp.model.shape import random_postures

SAMPLES = 100
"""Postures that are looked at."""
SEED = 20260301


def acceleration_by_torque(model: Any, continuous: BoolArray, limits: JointLimits) -> FloatArray:
    """The acceleration that each motor can give while the other joints rest, (nv,) [rad/s2 or m/s2].

    It is the least of max(0, tau_max_i - |g_i(q)|) / M_ii(q) over postures q inside the limits, the same
    ones every time. Infinite without a torque limit.
    """
    data = model.createData()
    prismatic = np.array(
        [model.joints[i].shortname().startswith("JointModelP") for i in range(1, model.njoints)]
    )
    least = np.full(len(limits), np.inf)
    for q in random_postures(limits, prismatic, SAMPLES, np.random.default_rng(SEED)):
        configuration = configuration_of(model, continuous, q)
        inertia = np.diag(pin.crba(model, data, configuration))
        left = np.maximum(limits.tau_max - np.abs(gravity_torques(model, data, configuration)), 0.0)
        least = np.minimum(least, left / inertia)
    return least
