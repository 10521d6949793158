"""Bases: poses by homogeneous transforms, twists that carry one pose into the next, sensors."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ftqp.core.errors import InputError
from ftqp.core.pose import transform
from ftqp.sim.base.carriers import BaseMotion, FreeBase, Platform, PoseSensor
from ftqp.sim.base.disturbances import Sinusoid, Step


def test_platform_is_track_rotation_and_tilt_in_that_order():
    track, turn, tilt = 0.4, 0.7, -0.3
    expected = (
        transform(np.eye(3), np.array([track, 0.0, 0.0]))
        @ transform(Rotation.from_euler("z", turn).as_matrix(), np.zeros(3))
        @ transform(Rotation.from_euler("y", tilt).as_matrix(), np.array([0.0, 0.0, 0.30]))
        @ transform(np.eye(3), np.array([0.20, 0.0, 0.45]))
    )
    np.testing.assert_allclose(Platform().pose(np.array([[track, turn, tilt]]))[0], expected, atol=1e-15)


def test_free_base_is_a_position_and_a_rotation_vector():
    eta = np.array([[1.0, 2.0, 3.0, 0.1, -0.2, 0.3]])
    found = FreeBase().pose(eta)[0]
    np.testing.assert_array_equal(found[:3, 3], eta[0, :3])
    np.testing.assert_allclose(Rotation.from_matrix(found[:3, :3]).as_rotvec(), eta[0, 3:], atol=1e-15)


@pytest.mark.parametrize(("base", "name"), [(Platform(), "rotation"), (FreeBase(), "ry")])
def test_mean_twist_carries_every_pose_into_the_next(base, name):
    dt = 0.05
    motion = BaseMotion(base, [Sinusoid(name, 0.5, frequency=0.4), Step(name, 0.2, at=0.3, rate=1.0)], dt, 40)
    assert motion.pose.shape == (40, 4, 4) and motion.eta.shape == (40, len(base.coordinates))
    for k in range(39):
        turn = Rotation.from_rotvec(dt * motion.twist[k, 3:]).as_matrix()
        np.testing.assert_allclose(turn @ motion.pose[k, :3, :3], motion.pose[k + 1, :3, :3], atol=1e-12)
        moved = motion.pose[k, :3, 3] + dt * motion.twist[k, :3]
        np.testing.assert_allclose(moved, motion.pose[k + 1, :3, 3], atol=1e-14)


def test_deviations_of_one_coordinate_add_up():
    motion = BaseMotion(Platform(), [Step("track", 0.1), Step("track", 0.2)], 0.1, 2)
    np.testing.assert_allclose(motion.eta[:, 0], 0.3)


def test_unknown_coordinate_names_the_valid_ones():
    with pytest.raises(
        InputError, match=r"'rol' is not a coordinate of the base.*; it has track, rotation, tilt"
    ):
        BaseMotion(Platform(), [Step("rol", 0.1)], 0.1, 2)


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
