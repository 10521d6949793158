"""Sensors: what they see late and how noisy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ftqp.core.pose import transform
from ftqp.sim.base.moving_world import PoseSensor


def test_sensor_is_late_by_whole_samples_and_begins_with_its_first():
    sensor = PoseSensor(late=2)
    seen = [sensor.measure(transform(np.eye(3), np.array([float(k), 0.0, 0.0])))[0, 3] for k in range(5)]
    assert seen == [0.0, 0.0, 0.0, 1.0, 2.0]
    sensor.reset()
    assert sensor.measure(transform(np.eye(3), np.array([9.0, 0.0, 0.0])))[0, 3] == 9.0


def test_noise_of_a_sensor_has_its_deviation_and_gives_rotations():
    sensor = PoseSensor(position=1e-3, rotation=2e-3, generator=np.random.default_rng(1))
    seen = np.array([sensor.measure(np.eye(4)) for _ in range(4000)])
    assert seen[:, :3, 3].std() == pytest.approx(1e-3, rel=0.03)
    assert Rotation.from_matrix(seen[:, :3, :3]).as_rotvec().std() == pytest.approx(2e-3, rel=0.03)
