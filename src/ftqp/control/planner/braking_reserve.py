"""How much deceleration the motors certainly have: what viability may count on under torque limits."""

from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.kernel.entry import entries as entry

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
        record: one record with chain and healthy limits loaded; restored on return.
        n: number of joints.
    """

    def __init__(self, record: Any, n: int) -> None:
        K = record.copy()
        address = K.ctypes.data
        generator = np.random.default_rng(SEED)
        low = np.where(np.isfinite(K["q_min"][0, :n]), K["q_min"][0, :n], -np.pi)
        high = np.where(np.isfinite(K["q_max"][0, :n]), K["q_max"][0, :n], np.pi)
        v_max = np.minimum(K["v_max"][0, :n], 10.0) * SPEED_SHARE
        self._bias = np.empty((SAMPLES, n))
        self._inertia = np.empty((SAMPLES, n, n))
        for k in range(SAMPLES):
            entry.inverse_dynamics(address, generator.uniform(low, high), generator.uniform(-v_max, v_max))
            self._bias[k] = np.abs(K["h"][0, :n])
            self._inertia[k] = np.abs(K["M"][0, :n, :n])

    def share(self, a_max: FloatArray, tau_max: FloatArray) -> float:
        """kappa in [LEAST_SHARE, 1].

        Args:
            a_max: acceleration limits believed now, (n,) [rad/s2].
            tau_max: torque limits believed now, (n,) [N m]; inf is no limit.
        """
        return float(np.clip(self._kappa(a_max, tau_max, 1.0), LEAST_SHARE, 1.0))

    def guard(self, a_max: FloatArray, tau_max: FloatArray) -> float:
        """Share of a_max up to which torque limits hold, MARGIN on top of the samples; 0: there is none."""
        return float(np.clip(self._kappa(a_max, tau_max, MARGIN), 0.0, 1.0))

    def _kappa(self, a_max: FloatArray, tau_max: FloatArray, margin: float) -> float:
        left = tau_max - margin * self._bias
        with np.errstate(invalid="ignore"):
            return float(np.where(np.isfinite(left), left / (margin * (self._inertia @ a_max)), np.inf).min())
