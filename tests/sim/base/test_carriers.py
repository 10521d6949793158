"""Bases: poses by homogeneous transforms."""

import numpy as np
from scipy.spatial.transform import Rotation

from ftqp.core.pose import transform
from ftqp.sim.base.moving_world import FreeBase, Platform


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
