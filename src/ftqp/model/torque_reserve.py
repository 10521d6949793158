"""The acceleration that motors can give: what a guessed acceleration limit is to be judged by."""

from typing import Any

import numpy as np
import pinocchio as pin

from ftqp.core.checks import FloatArray
from ftqp.model.chain import Chain, configuration_of
from ftqp.model.followers import coupled_columns, coupled_places, coupled_square
from ftqp.model.limits import JointLimits
from ftqp.model.posture import gravity_torques
from ftqp.model.shape import random_postures

SAMPLES = 100
"""Postures that are looked at."""
SEED = 20260301


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
