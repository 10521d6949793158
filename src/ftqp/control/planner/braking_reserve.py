"""How much deceleration the motors certainly have: what viability may count on under torque limits."""

from weakref import WeakKeyDictionary

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.orders import Load, ReserveSamples
from ftqp.model.followers import coupled_places
from ftqp.model.robot import Robot

SAMPLES = 400
"""Random configurations that are looked at."""
SPEED_SHARE = 0.5
"""Velocities are sampled up to this share of the limits."""
SEED = 20170511
"""Of the samples: so that an arm always has the same reserve."""


class BrakingReserve:
    """Samples of what braking takes: |h_i| and sum_j |M_ij| a_max_j over random configurations.

    If every joint brakes with kappa a_max, whatever the directions, joint i needs at most
    |h_i| + kappa sum_j |M_ij| a_max_j. ``share`` is the largest kappa that all torque limits allow on all
    samples: sound up to the sampling.

    Args:
        robot: The healthy arm without its load.
        load: What it carries; None is nothing.

    Attributes:
        samples: The samples.
    """

    def __init__(self, robot: Robot, load: Load | None = None) -> None:
        n, limits = robot.nv, robot.limits
        generator = np.random.default_rng(SEED)
        low = np.where(np.isfinite(limits.q_min), limits.q_min, -np.pi)
        high = np.where(np.isfinite(limits.q_max), limits.q_max, np.pi)
        v_max = np.minimum(limits.v_max, 10.0) * SPEED_SHARE
        q, v = np.empty((SAMPLES, n)), np.empty((SAMPLES, n))
        for k in range(SAMPLES):
            q[k], v[k] = generator.uniform(low, high), generator.uniform(-v_max, v_max)
        if robot.chain.has_followers:
            v = coupled_places(robot.chain, v) - coupled_places(robot.chain, np.zeros(n))
            q = coupled_places(robot.chain, q)
        self.samples = ReserveSamples(robot.chain.constants(), q, v, load)

    def share(self, a_max: FloatArray, tau_max: FloatArray) -> float:
        """The largest share of a_max with which every joint can brake at once, LEAST_SHARE to 1."""
        return self.samples.shares(a_max, tau_max)[0]

    def guard(self, a_max: FloatArray, tau_max: FloatArray) -> float:
        """The share of a_max up to which torque limits hold, MARGIN over the samples; 0 if there is none."""
        return self.samples.shares(a_max, tau_max)[1]


_RESERVES: WeakKeyDictionary[Robot, BrakingReserve] = WeakKeyDictionary()


def braking_reserve(robot: Robot, load: Load | None = None) -> BrakingReserve:
    """The samples of a robot; without a load taken once and shared by all its planners."""
    if load is not None:
        return BrakingReserve(robot, load)
    if robot not in _RESERVES:
        _RESERVES[robot] = BrakingReserve(robot)
    return _RESERVES[robot]
