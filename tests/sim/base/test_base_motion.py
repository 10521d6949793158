"""The motion of a base: twists that carry one pose into the next."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ftqp.core.errors import InputError
from ftqp.sim.base.disturbances import Sinusoid, Step
from ftqp.sim.base.moving_world import BaseMotion, FreeBase, Platform


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
