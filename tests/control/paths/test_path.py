"""What holds for every kind of path."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ftqp.control.paths import (
    KINDS,
    Circle,
    Hold,
    Line,
    Lissajous,
    PointToPoint,
    Square,
    Waypoints,
    laws,
    mean_acceleration,
)
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_exp, transform

T = 3.0


def goal(start):
    return start @ transform(rotation_exp(np.array([0.4, -1.1, 0.7])), np.array([0.1, 0.05, -0.2]))


def waypoints(start):
    turns = Rotation.from_matrix(start[:3, :3]) * Rotation.from_rotvec(
        [[0.3, 0.1, 0.0], [0.5, -0.4, 0.2], [0.1, -0.9, 0.3]]
    )
    return Waypoints(
        start,
        start[:3, 3] + np.array([[0.1, 0, 0], [0.15, 0.1, -0.05], [0.0, 0.2, 0.1]]),
        orientations=turns.as_quat(),
        times=[0.7, 1.9, T],
    )


MAKERS = {
    "line": lambda start, law: Line(start, [0.1, -0.2, 0.05], duration=T, law=law),
    "square": lambda start, law: Square(start, 0.2, duration=T, law=law, axes=("x", "-z")),
    "circle": lambda start, law: Circle(start, 0.1, duration=T, law=law, axes=("y", [1, 0, 1]), turns=1.5),
    "lissajous": lambda start, law: Lissajous(
        start, (0.1, 0.05), duration=T, cycles=(2, 3), phase=0.4, law=law
    ),
    "point_to_point": lambda start, law: PointToPoint(start, goal(start), duration=T, law=law),
    "waypoints": lambda start, law: waypoints(start),
    "hold": lambda start, law: Hold(start, duration=T),
}
LAWLESS = ("waypoints", "hold")
CASES = [(kind, law) for kind in MAKERS for law in laws.names() if kind not in LAWLESS or law == "quintic"]


@pytest.fixture(params=CASES, ids=lambda case: "-".join(case))
def path(request, start):
    kind, law = request.param
    return MAKERS[kind](start, law)


def test_every_kind_is_tested_here():
    assert set(MAKERS) == set(KINDS)


def test_path_starts_bitwise_at_its_start_pose(path, start):
    np.testing.assert_array_equal(path.sample(0.0).pose[0], start)
    np.testing.assert_array_equal(path.sample(-1.0).pose[0], start)


def test_path_rests_at_its_end(path):
    sample = path.sample([T - 1e-12, T, T + 0.5, 1e6])
    np.testing.assert_array_equal(sample.pose, np.tile(sample.pose[0], (4, 1, 1)))
    np.testing.assert_array_equal(sample.twist, 0.0)
    np.testing.assert_array_equal(sample.acceleration, 0.0)


def test_path_has_not_moved_before_its_start(path):
    np.testing.assert_array_equal(path.sample(-0.1).twist, 0.0)
    np.testing.assert_array_equal(path.sample(-0.1).acceleration, 0.0)


def test_twist_is_the_derivative_of_the_pose(path):
    t, step = np.linspace(0.0217, T - 0.0151, 61), 1e-5
    before, here, after = path.sample(t - step).pose, path.sample(t), path.sample(t + step).pose
    np.testing.assert_allclose(here.twist[:, :3], (after - before)[:, :3, 3] / (2 * step), atol=2e-8)
    turn = Rotation.from_matrix(after[:, :3, :3]) * Rotation.from_matrix(before[:, :3, :3]).inv()
    np.testing.assert_allclose(here.twist[:, 3:], turn.as_rotvec() / (2 * step), atol=2e-8)


def test_acceleration_is_the_derivative_of_the_twist(path):
    t, step = np.linspace(0.0217, T - 0.0151, 61), 1e-6
    slope = (path.sample(t + step).twist - path.sample(t - step).twist) / (2 * step)
    np.testing.assert_allclose(path.sample(t).acceleration, slope, atol=2e-6)


def test_every_pose_is_a_rigid_transform(path):
    rotation = path.sample(np.linspace(0.0, T, 50)).pose[:, :3, :3]
    square = np.swapaxes(rotation, 1, 2) @ rotation
    np.testing.assert_allclose(square, np.tile(np.eye(3), (50, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-12)


def test_orientation_is_kept_unless_the_path_turns(start):
    for kind in ("line", "square", "circle", "lissajous"):
        poses = MAKERS[kind](start, "quintic").sample(np.linspace(0.0, T, 9)).pose
        np.testing.assert_array_equal(poses[:, :3, :3], np.tile(start[:3, :3], (9, 1, 1)))


def test_sampling_many_times_equals_sampling_each(path):
    t = np.linspace(0.0, T, 13)
    together = path.sample(t)
    for k, one in enumerate(t):
        np.testing.assert_allclose(path.sample(one).pose[0], together.pose[k], atol=1e-15)
        np.testing.assert_allclose(path.sample(one).acceleration[0], together.acceleration[k], atol=1e-12)


def test_mean_acceleration_held_for_dt_reaches_the_next_twist(path):
    t, dt = np.arange(0.0, T, 0.01), 0.01
    reached = path.sample(t).twist + dt * mean_acceleration(path, t, dt)
    np.testing.assert_allclose(reached, path.sample(t + dt).twist, atol=1e-12)


def test_mean_acceleration_tends_to_the_acceleration(start):
    path = MAKERS["circle"](start, "quintic")
    t = np.linspace(0.1, 2.9, 20)
    coarse = np.abs(mean_acceleration(path, t, 1e-2) - path.sample(t).acceleration).max()
    fine = np.abs(mean_acceleration(path, t, 1e-4) - path.sample(t).acceleration).max()
    assert fine < 0.02 * coarse


def test_start_pose_of_a_path_cannot_be_changed(path):
    with pytest.raises(ValueError, match="read-only"):
        path.start[0, 3] = 1.0


def test_samples_belong_to_the_caller(path, start):
    path.sample(0.0).pose[:] = 0.0
    np.testing.assert_array_equal(path.sample(0.0).pose[0], start)


@pytest.mark.parametrize("duration", [0.0, -1.0, np.nan, np.inf, "long"])
def test_duration_must_be_positive_and_finite(start, duration):
    with pytest.raises(InputError, match="duration of the path is"):
        Line(start, [1.0, 0, 0], duration=duration)


def test_times_must_be_finite(start):
    with pytest.raises(InputError, match="expected finite times"):
        Line(start, [1.0, 0, 0], duration=1.0).sample([0.0, np.nan])


def test_start_must_be_a_pose():
    with pytest.raises(InputError, match="start pose of the path has a rotation part"):
        Line(np.diag([1.0, 1.0, -1.0, 1.0]), [1.0, 0, 0], duration=1.0)


SHORT = {
    "line": lambda start, T: Line(start, [0.1, -0.2, 0.05], duration=T),
    "square": lambda start, T: Square(start, 0.2, duration=T),
    "circle": lambda start, T: Circle(start, 0.1, duration=T),
    "lissajous": lambda start, T: Lissajous(start, (0.1, 0.05), duration=T),
    "point_to_point": lambda start, T: PointToPoint(start, goal(start), duration=T),
    "waypoints": lambda start, T: Waypoints(start, start[None, :3, 3] + 0.1, duration=T),
    "hold": lambda start, T: Hold(start, duration=T),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("duration", [1e-300, 1e-160, 1e-9])
def test_path_that_takes_no_time_is_refused(start, kind, duration):
    with pytest.raises(InputError, match=r"duration of the path is .*, expected more than"):
        SHORT[kind](start, duration)
    shortest = SHORT[kind](start, 1e-8)
    assert np.isfinite(shortest.sample(5e-9).acceleration).all()
