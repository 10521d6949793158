"""What counts as a rotation in compiled code is what counts as one for poses."""

import numpy as np
import pytest

from ftqp.core import pose
from ftqp.kernel.maths.rotation import is_rotation


def packed(rotation):
    result = np.eye(4)
    result[:3, :3] = rotation
    return result.ravel()


def test_rotations_are_rotations():
    rng = np.random.default_rng(0)
    for _ in range(100):
        assert is_rotation(packed(pose.rotation_exp(rng.uniform(-4.0, 4.0, 3))))


@pytest.mark.parametrize("scale", [0.0, 0.5, 1.0 - 1e-6, 1.0 + 1e-6, -1.0, 1e3])
def test_scaled_and_mirrored_rotations_are_none(scale):
    assert not is_rotation(packed(scale * pose.rotation_exp(np.array([0.3, -1.0, 0.2]))))


@pytest.mark.parametrize("entry", range(9))
def test_one_wrong_entry_spoils_a_rotation(entry):
    rotation = pose.rotation_exp(np.array([0.3, -1.0, 0.2]))
    rotation.flat[entry] += 1e-4
    assert not is_rotation(packed(rotation))


def test_a_mirror_image_is_no_rotation():
    assert not is_rotation(packed(np.diag([1.0, 1.0, -1.0])))
