"""A Panda with rotors, friction, load, gains and offsets that its model lacks, on an exciting motion."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

import ftqp
from ftqp.model.fitting.fitted_arm import torques
from ftqp.model.fitting.torque_log import Pieces

FloatArray = NDArray[np.float64]


class Truth(NamedTuple):
    """What is true of the arm and not in its model."""

    rotors: FloatArray
    coulomb: FloatArray
    viscous: FloatArray
    payload: ftqp.Payload
    gains: FloatArray
    offsets: FloatArray


@pytest.fixture(scope="session")
def motion(panda: ftqp.Robot) -> Any:
    """Ten seconds at 500 Hz."""
    return ftqp.exciting_motion(panda, duration=10.0, dt=0.002)


@pytest.fixture(scope="session")
def truth(panda: ftqp.Robot) -> Truth:
    """Drawn once."""
    rng, n = np.random.default_rng(3), panda.nv
    weak = panda.limits.tau_max / panda.limits.tau_max.max()
    return Truth(
        rng.uniform(0.05, 0.3, n), rng.uniform(0.5, 1.5, n) * weak, rng.uniform(0.5, 1.5, n) * weak,
        ftqp.Payload(1.5, (0.03, -0.02, 0.06)), rng.uniform(-0.08, 0.08, n), rng.uniform(-8e-3, 8e-3, n),
    )  # fmt: skip


@pytest.fixture(scope="session")
def log(panda: ftqp.Robot, motion: Any, truth: Truth) -> ftqp.TorqueLog:
    """What is recorded of the true arm on that motion, with noise."""
    return recorded(panda, motion, truth)


def recorded(robot: ftqp.Robot, motion: Any, truth: Truth) -> ftqp.TorqueLog:
    """Torques of the true arm by its dynamics."""
    true = robot.with_rotors(truth.rotors).with_payload(truth.payload)
    at = Pieces(motion.t, motion.q, motion.v, motion.a, np.zeros_like(motion.q), 0.0, 0.0)
    tau = torques(true, at) + truth.coulomb * np.sign(motion.v) + truth.viscous * motion.v
    rng = np.random.default_rng(5)
    return ftqp.TorqueLog(
        t=motion.t,
        q=motion.q - truth.offsets + 1e-5 * rng.standard_normal(motion.q.shape),
        tau=(1.0 + truth.gains) * tau + 0.05 * rng.standard_normal(motion.q.shape),
    )
