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


def test_start_pose_of_a_path_cannot_be_changed(path):
    with pytest.raises(ValueError, match="read-only"):
        path.start[0, 3] = 1.0


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


TURNED = np.diag([1.0, 1.0, -1.0, 1.0])
WRONG = [
    *((lambda s, d=d: Line(s, [1, 0, 0], duration=d), "duration of the path is")
      for d in (0.0, -1.0, np.nan, np.inf, "long")),
    (lambda s: Hold(s, duration=0.0), "duration of the path is 0"),
    (lambda s: Line(TURNED, [1, 0, 0], duration=1.0), "start pose of the path has a rotation part"),
    (lambda s: Line(s, [1, 0, 0], duration=1.0).sample([0.0, np.nan]), "expected finite times"),
    (lambda s: Line(s, [0, 0, 0], duration=1.0), "displacement of the line is zero"),
    (lambda s: Line(s, [1, 0], duration=1.0), r"displacement of the line has shape \(2,\)"),
    (lambda s: Line(s, [1, 0, np.inf], duration=1.0), "displacement of the line is infinite"),
    (lambda s: Circle(s, -0.1, duration=1.0), "radius of the circle is -0.1, expected a finite number > 0 m"),
    (lambda s: Square(s, 0.0, duration=1.0), "side of the square is"),
    (lambda s: Square(s, 0.1, duration=1.0, axes=("x", "x")), "cosine 1, expected perpendicular"),
    (lambda s: Square(s, 0.1, duration=1.0, axes=("x", "w")), "'w' is not a direction of the second axis"),
    (lambda s: Square(s, 0.1, duration=1.0, axes="xy"), "axes is 'xy', expected two directions"),
    (lambda s: Square(s, 0.1, duration=1.0, axes=("x", [0, 0, 0])), "second axis is the zero vector"),
    (lambda s: Lissajous(s, (0, 0), duration=1.0), "amplitudes of the Lissajous figure are"),
    (lambda s: Lissajous(s, (1, 1), duration=1.0, cycles=(0, 1)), "cycles of the Lissajous figure are"),
    (lambda s: Lissajous(s, (1, 1), duration=1.0, phase=np.nan), "phase of the Lissajous figure"),
    (lambda s: PointToPoint(s, s, duration=1.0), "goal pose equals the start pose"),
    (lambda s: PointToPoint(s, np.eye(3), duration=1.0), "goal pose has shape"),
]  # fmt: skip


@pytest.mark.parametrize(("made", "sentence"), WRONG)
def test_path_that_makes_no_sense_is_refused_with_one_sentence(start, made, sentence):
    with pytest.raises(InputError, match=sentence):
        made(start)
