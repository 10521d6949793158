"""Pose maths by the axioms of the group and of the exponential."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ftqp.core.errors import InputError
from ftqp.core.pose import (
    pose,
    quaternions,
    rotated,
    rotation_exp,
    rotation_vectors,
    rotation_x,
    rotation_z,
    skew,
    transform,
)

vectors = st.lists(st.floats(-4.0, 4.0), min_size=3, max_size=3).map(np.array)


@given(vectors)
def test_derivative_of_the_exponential_at_zero_is_skew(w):
    h = 1e-6
    slope = (rotation_exp(h * w) - rotation_exp(-h * w)) / (2.0 * h)
    np.testing.assert_allclose(slope, skew(w), atol=1e-8)


@pytest.mark.parametrize("angle", [0.0, 1e-13, 1e-11, 1e-3, np.pi / 2, np.pi, 7.0])
def test_rotations_about_an_axis_have_cosine_and_sine_in_place(angle):
    c, s = np.cos(angle), np.sin(angle)
    np.testing.assert_allclose(rotation_z(angle), [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], atol=1e-15)
    np.testing.assert_allclose(rotation_x(angle), [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]], atol=1e-15)


def test_pose_of_another_library_is_taken_by_its_homogeneous_matrix():
    T = transform(rotation_x(0.3), np.array([0.1, 0.2, 0.3]))
    np.testing.assert_array_equal(pose(SimpleNamespace(homogeneous=T)), T)


@pytest.mark.parametrize("rotation", [2.0 * np.eye(3), np.diag([1.0, 1.0, -1.0]), np.zeros((3, 3))])
def test_matrix_that_is_not_a_rotation_is_refused(rotation):
    with pytest.raises(InputError, match=r"target has a rotation part that is not a rotation"):
        pose(transform(rotation, np.zeros(3)), "target")


@pytest.mark.parametrize("value", [np.eye(3), np.zeros((4, 4)) * np.nan, "here"])
def test_pose_of_a_wrong_shape_or_type_is_refused(value):
    with pytest.raises(InputError, match=r"pose (has shape|contains NaN|is not an array)"):
        pose(value)


def test_rotation_rounded_to_seven_digits_still_counts():
    assert pose(transform(np.round(rotation_x(1.0), 7), np.zeros(3))).shape == (4, 4)


def test_quaternions_and_rotation_vectors_are_those_of_scipy():
    turns = [Rotation.random(200, random_state=3).as_matrix(), np.eye(3)[None]]
    axes = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0.6, -0.8, 0], [0, -0.6, 0.8]])
    turns += [
        Rotation.from_rotvec(angle * axes).as_matrix() for angle in (1e-9, 1e-3, 3.0, np.pi - 1e-7, np.pi)
    ]
    R = np.concatenate(turns)
    expected = Rotation.from_matrix(R)
    np.testing.assert_allclose(np.abs(quaternions(R)), np.abs(expected.as_quat()), atol=1e-14)
    assert (quaternions(R)[:, 3] >= 0.0).all()
    np.testing.assert_allclose(Rotation.from_quat(quaternions(R)).as_matrix(), R, atol=1e-14)
    np.testing.assert_allclose(Rotation.from_rotvec(rotation_vectors(R)).as_matrix(), R, atol=1e-14)
    assert (np.linalg.norm(rotation_vectors(R), axis=1) <= np.pi + 1e-12).all()


def test_rotated_vectors_are_those_of_the_matrix():
    rng = np.random.default_rng(5)
    matrices = np.array([rotation_exp(w) for w in rng.uniform(-3.0, 3.0, (20, 3))])
    vectors = rng.normal(size=(20, 4, 3))
    expected = np.einsum("kij,knj->kni", matrices, vectors)
    np.testing.assert_allclose(rotated(quaternions(matrices), vectors), expected, atol=1e-14)
