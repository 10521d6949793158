"""How much deceleration the motors certainly have: what viability may count on under torque limits."""

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry.session import ArmSession
from ftqp.model.robot import Robot

SAMPLES = 400
SPEED_SHARE = 0.5
"""Velocities are sampled up to this share of the limits."""
MARGIN = 1.3
"""Bias and inertia beyond what was sampled that ``guard`` allows for."""
LEAST_SHARE = 0.05
SEED = 20170511


class BrakingReserve:
    """Samples of what braking takes: |h_i| and sum_j |M_ij| a_max_j over random configurations.

    If every joint brakes with kappa a_max, whatever the directions, joint i needs at most
    |h_i| + kappa sum_j |M_ij| a_max_j. ``share`` is the largest kappa that all torque limits allow on all
    samples: sound up to the sampling.

    Args:
        robot: the healthy arm.
    """

    def __init__(self, robot: Robot) -> None:
        n, limits = robot.nv, robot.limits
        arm = ArmSession(robot.chain.constants())
        kinematics = arm.K.kinematics
        M, h = kinematics.M[:n, :n], kinematics.h[:n]
        generator = np.random.default_rng(SEED)
        low = np.where(np.isfinite(limits.q_min), limits.q_min, -np.pi)
        high = np.where(np.isfinite(limits.q_max), limits.q_max, np.pi)
        v_max = np.minimum(limits.v_max, 10.0) * SPEED_SHARE
        self._bias = np.empty((SAMPLES, n))
        self._inertia = np.empty((SAMPLES, n, n))
        for k in range(SAMPLES):
            arm.dynamics(generator.uniform(low, high), generator.uniform(-v_max, v_max))
            self._bias[k] = np.abs(h)
            self._inertia[k] = np.abs(M)

    def share(self, a_max: FloatArray, tau_max: FloatArray) -> float:
        """The largest share of a_max with which every joint can brake at once, LEAST_SHARE to 1.

        Args:
            a_max: Acceleration limits believed now, (n,) [rad/s2].
            tau_max: Torque limits believed now, (n,) [N m]; inf is no limit.
        """
        return float(np.clip(self._kappa(a_max, tau_max, 1.0), LEAST_SHARE, 1.0))

    def guard(self, a_max: FloatArray, tau_max: FloatArray) -> float:
        """The share of a_max up to which torque limits hold, MARGIN over the samples; 0 if there is none."""
        return float(np.clip(self._kappa(a_max, tau_max, MARGIN), 0.0, 1.0))

    def _kappa(self, a_max: FloatArray, tau_max: FloatArray, margin: float) -> float:
        left = tau_max - margin * self._bias
        with np.errstate(invalid="ignore"):
            return float(np.where(np.isfinite(left), left / (margin * (self._inertia @ a_max)), np.inf).min())


_RESERVES: WeakKeyDictionary[Robot, BrakingReserve] = WeakKeyDictionary()


def braking_reserve(robot: Robot) -> BrakingReserve:
    """The samples of a robot, taken once and shared by all its planners."""
    if robot not in _RESERVES:
        _RESERVES[robot] = BrakingReserve(robot)
    return _RESERVES[robot]


def count_on(reserve: BrakingReserve | None, limits: Any, n: int, *, level: str, on_demand: bool) -> None:
    """Write the deceleration that viability counts on, and when torque limits are looked at.

    Args:
        reserve: Of the robot; None where torque is not limited.
        limits: The room of the record, whose limits are those believed now.
        n: The number of joints.
        level: ``acceleration``, where torque limits are looked at every tick, or ``velocity``.
        on_demand: Whether torque rows are there only where a command breaks a torque limit without them.
    """
    a_max, tau_max = limits.a_max[:n], limits.tau_max[:n]
    limits.a_brake[:n] = a_max if reserve is None else reserve.share(a_max, tau_max) * a_max
    limits.on_demand = int(reserve is not None and on_demand)
    guarded = reserve is not None and on_demand and level == "velocity"
    limits.guard = reserve.guard(a_max, tau_max) if reserve is not None and guarded else 0.0
