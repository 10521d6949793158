"""What holds for every kind of path, and for each."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import ftqp
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
from ftqp.control.paths.path import Backwards, Repeated, is_closed
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_exp, transform

T = 3.0


@pytest.fixture
def start():
    return transform(rotation_exp(np.array([2.9, 0.3, -0.4])), np.array([0.4171, -0.113, 0.5337]))


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
    "line": lambda start, law="quintic", T=T: Line(start, [0.1, -0.2, 0.05], duration=T, law=law),
    "square": lambda start, law="quintic", T=T: Square(start, 0.2, duration=T, law=law, axes=("x", "-z")),
    "circle": lambda start, law="quintic", T=T: Circle(
        start, 0.1, duration=T, law=law, axes=("y", [1, 0, 1]), turns=1.5
    ),
    "lissajous": lambda start, law="quintic", T=T: Lissajous(
        start, (0.1, 0.05), duration=T, cycles=(2, 3), phase=0.4, law=law
    ),
    "point_to_point": lambda start, law="quintic", T=T: PointToPoint(start, goal(start), duration=T, law=law),
    "waypoints": lambda start, law: waypoints(start),
    "hold": lambda start, law="", T=T: Hold(start, duration=T),
}
LAWLESS = ("waypoints", "hold")
CASES = [(kind, law) for kind in MAKERS for law in laws.names() if kind not in LAWLESS or law == "quintic"]


@pytest.fixture(params=CASES, ids=lambda case: "-".join(case))
def path(request, start):
    kind, law = request.param
    return MAKERS[kind](start, law)


def test_every_kind_is_tested_here():
    assert set(MAKERS) == set(KINDS)


def test_path_starts_bitwise_at_its_start_pose_and_has_not_moved_before(path, start):
    for t in (0.0, -1.0):
        np.testing.assert_array_equal(path.sample(t).pose[0], start)
    np.testing.assert_array_equal(path.sample(-0.1).twist, 0.0)
    np.testing.assert_array_equal(path.sample(-0.1).acceleration, 0.0)


def test_path_rests_at_its_end(path):
    sample = path.sample([T - 1e-12, T, T + 0.5, 1e6])
    np.testing.assert_array_equal(sample.pose, np.tile(sample.pose[0], (4, 1, 1)))
    np.testing.assert_array_equal(sample.twist, 0.0)
    np.testing.assert_array_equal(sample.acceleration, 0.0)


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


def test_mean_acceleration_held_for_dt_reaches_the_next_twist(path):
    t, dt = np.arange(0.0, T, 0.01), 0.01
    reached = path.sample(t).twist + dt * mean_acceleration(path, t, dt)
    np.testing.assert_allclose(reached, path.sample(t + dt).twist, atol=1e-12)


SHORT = MAKERS | {"waypoints": lambda start, T: Waypoints(start, start[None, :3, 3] + 0.1, duration=T)}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("duration", [1e-300, 1e-160, 1e-9])
def test_path_that_takes_no_time_is_refused(start, kind, duration):
    with pytest.raises(InputError, match=r"duration of the path is .*, expected more than"):
        SHORT[kind](start, T=duration)
    shortest = SHORT[kind](start, T=1e-8)
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
    (lambda s: Square(s, 0.0, duration=1.0), "side of the square is"),
    (lambda s: Square(s, 0.1, duration=1.0, axes=("x", "x")), "cosine 1, expected perpendicular"),
    (lambda s: Square(s, 0.1, duration=1.0, axes=("x", "w")), "'w' is not a direction of the second axis"),
    (lambda s: Square(s, 0.1, duration=1.0, axes="xy"), "axes is 'xy', expected two directions"),
    (lambda s: Square(s, 0.1, duration=1.0, axes=("x", [0, 0, 0])), "second axis is the zero vector"),
    (lambda s: Lissajous(s, (0, 0), duration=1.0), "amplitudes of the Lissajous figure are"),
    (lambda s: Lissajous(s, (1, 1), duration=1.0, cycles=(0, 1)), "cycles of the Lissajous figure are"),
    (lambda s: PointToPoint(s, s, duration=1.0), "goal pose equals the start pose"),
]  # fmt: skip


@pytest.mark.parametrize(("made", "sentence"), WRONG)
def test_path_that_makes_no_sense_is_refused_with_one_sentence(start, made, sentence):
    with pytest.raises(InputError, match=sentence):
        made(start)


def test_line_is_straight_and_ends_at_its_displacement(start):
    way = Line(start, [0.1, 0.2, -0.3], duration=2.0).sample([0.6, 2.0]).pose[:, :3, 3] - start[:3, 3]
    np.testing.assert_allclose(np.cross(way[0], way[1]), 0.0, atol=1e-15)
    np.testing.assert_allclose(way[1], [0.1, 0.2, -0.3], atol=1e-15)


@pytest.mark.parametrize("law", ["sine_squared", "quintic"])
def test_circle_keeps_its_radius_and_closes(start, law):
    position = Circle(start, 0.1, duration=20.0, law=law).sample(np.linspace(0, 20, 200)).pose[:, :3, 3]
    radius = np.linalg.norm(position - (start[:3, 3] - [0.1, 0, 0]), axis=1)
    np.testing.assert_allclose(radius, 0.1, atol=1e-15)
    np.testing.assert_allclose(position[-1], start[:3, 3], atol=1e-15)


def test_sine_squared_phase_is_that_of_the_source(start):
    t, duration, radius = 3.7, 20.0, 0.1
    phase = 2 * np.pi * np.sin(np.pi * t / (2 * duration)) ** 2
    expected = start[:3, 3] - [radius, 0, 0] + radius * np.array([np.cos(phase), np.sin(phase), 0])
    pose = Circle(start, radius, duration=duration, law="sine_squared").sample(t).pose[0]
    np.testing.assert_allclose(pose[:3, 3], expected, atol=1e-15)


def test_square_visits_its_corners_in_order_rests_there_and_closes(start):
    side = 0.039
    sample = Square(start, side, duration=20.0).sample([0, 5, 10, 15, 20])
    corners = [[0, 0, 0], [side, 0, 0], [side, side, 0], [0, side, 0], [0, 0, 0]]
    np.testing.assert_allclose(sample.pose[:, :3, 3] - start[:3, 3], corners, atol=1e-15)
    np.testing.assert_allclose(sample.twist, 0.0, atol=1e-15)
    np.testing.assert_allclose(sample.acceleration, 0.0, atol=1e-12)


def test_path_ends_at_the_goal(start):
    goal = transform(rotation_exp(np.array([0.1, 2.0, 0.3])), np.array([0.0, 0.3, 0.7]))
    np.testing.assert_allclose(PointToPoint(start, goal, duration=2.0).sample(2.0).pose[0], goal, atol=1e-14)


def test_rotation_is_about_one_fixed_axis(start):
    goal = start @ transform(rotation_exp(np.array([0.3, 0.5, -0.2])), np.zeros(3))
    w = PointToPoint(start, goal, duration=2.0).sample(np.linspace(0.1, 1.9, 7)).twist[:, 3:]
    axes = w / np.linalg.norm(w, axis=1, keepdims=True)
    np.testing.assert_allclose(axes, np.tile(axes[0], (7, 1)), atol=1e-12)


def test_half_a_turn_has_a_finite_path(start):
    goal = start @ transform(rotation_exp(np.array([np.pi, 0.0, 0.0])), np.zeros(3))
    sample = PointToPoint(start, goal, duration=1.0).sample(np.linspace(0, 1, 9))
    assert np.isfinite(sample.twist).all()
    np.testing.assert_allclose(sample.pose[-1], goal, atol=1e-12)


WAY = np.array([[0.1, 0.0, 0.0], [0.1, 0.1, 0.0], [0.0, 0.1, 0.1]])


def quaternions(start, count=3):
    turns = Rotation.from_rotvec(np.array([0.2, -0.1, 0.4]) * np.arange(1, count + 1)[:, None])
    return (Rotation.from_matrix(start[:3, :3]) * turns).as_quat()


def test_path_passes_every_waypoint_at_its_time(start):
    times = [0.5, 1.1, 2.0]
    q = quaternions(start)
    pose = Waypoints(start, start[:3, 3] + WAY, orientations=q, times=times).sample(times).pose
    np.testing.assert_allclose(pose[:, :3, 3], start[:3, 3] + WAY, atol=1e-14)
    np.testing.assert_allclose(pose[:, :3, :3], Rotation.from_quat(q).as_matrix(), atol=1e-14)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_path_is_at_rest_at_both_ends_and_smooth_at_every_waypoint(start, count):
    times = np.array([0.5, 1.1, 2.0])[:count]
    path = Waypoints(start, WAY[:count], orientations=quaternions(start, count), times=times, relative=True)
    ends = path.sample([0.0, times[-1] - 2e-9])
    np.testing.assert_allclose(ends.twist, 0.0, atol=2e-7)
    for name in ("twist", "acceleration"):
        jump = getattr(path.sample(times[:-1] + 1e-8), name) - getattr(path.sample(times[:-1] - 1e-8), name)
        np.testing.assert_allclose(jump, 0.0, atol=1e-5)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({}, "waypoints got neither of times and duration"),
        ({"times": [1, 2, 3], "duration": 3.0}, "waypoints got both of times and duration"),
        ({"times": [1, 3, 2]}, r"times of the waypoints do not rise after 3 s \(next is 2 s\); sort them"),
        ({"times": [1, 1, 2]}, "times of the waypoints do not rise after 1 s"),
        ({"times": [-1, 1, 2]}, "times of the waypoints start at -1 s"),
        ({"times": [0, 1, 2]}, r"the first waypoint has time 0 but is 0.1 m and 0 rad from the start pose"),
        ({"times": [1, 2]}, r"times of the waypoints has shape \(2,\), expected \(N,\) = \(3,\)"),
        ({"times": [1, 2, np.nan]}, "times of the waypoints contains NaN"),
        ({"duration": 1.0, "positions": []}, "positions of the waypoints are"),
        ({"duration": 1.0, "positions": [[0, 0, 0]]}, "the only waypoint is the start pose"),
        ({"duration": 1.0, "orientations": [[0, 0, 0, 2]] * 3}, "quaternion 0 of the waypoints has"),
    ],
)
def test_wrong_waypoints_are_one_clear_sentence(start, keywords, message):
    with pytest.raises(InputError, match=message):
        Waypoints(start, relative=True, **{"positions": WAY, **keywords})


ALL = [*laws.names(), {"name": "trapezoid", "ramp": 0.5}, {"name": "trapezoid", "ramp": 0.03}]


@pytest.mark.parametrize("law", ALL, ids=str)
def test_law_goes_from_zero_to_one_without_turning_back(law):
    u = np.linspace(0.0, 1.0, 501)
    s, ds, _ = laws.by_name(law).sample(u)
    assert s[0] == 0.0
    assert s[-1] == 1.0
    assert (np.diff(s) > 0.0).all()
    assert (ds >= 0.0).all()


@pytest.mark.parametrize("law", ALL, ids=str)
def test_derivatives_are_those_of_s(law):
    u = np.linspace(0.0123, 0.9871, 40)
    step = 1e-5
    law = laws.by_name(law)
    before, here, after = law.sample(u - step), law.sample(u), law.sample(u + step)
    np.testing.assert_allclose(here.ds, (after.s - before.s) / (2 * step), atol=1e-8)
    np.testing.assert_allclose(here.dds, (after.ds - before.ds) / (2 * step), atol=1e-7)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ("quintc", r"'quintc' is not a law of motion of ftqp \(did you mean 'quintic'\?\); it has quintic"),
        ({"name": "trapezoid", "ramp": 0.6}, r"ramp of the trapezoid law is 0.6, expected a fraction in"),
    ],
)
def test_wrong_law_is_one_clear_sentence(law, message):
    with pytest.raises(InputError, match=message):
        laws.by_name(law)


START = np.eye(4)
CIRCLE = ftqp.paths.Circle(START, 0.1, duration=4.0)
LINE = ftqp.paths.Line(START, (0.3, 0.0, 0.1), duration=2.0)


@pytest.mark.parametrize("path", [CIRCLE, LINE])
def test_first_lap_is_the_path_bit_by_bit(path):
    t = np.arange(0.0, path.duration, 0.01)
    one, other = path.sample(t), Repeated(path, 3).sample(t)
    for name in ("pose", "twist", "acceleration"):
        np.testing.assert_array_equal(getattr(other, name), getattr(one, name))


def test_closed_path_goes_round_and_an_open_one_there_and_back():
    assert is_closed(CIRCLE) and not is_closed(LINE)
    assert (Repeated(CIRCLE, 2).lap, Repeated(LINE, 2).lap) == (4.0, 4.0)
    np.testing.assert_allclose(Repeated(CIRCLE, 9).sample(9.3).pose, CIRCLE.sample(1.3).pose, atol=1e-12)
    there_and_back = Repeated(LINE, 9)
    np.testing.assert_allclose(there_and_back.sample(11.3).pose, LINE.sample(0.7).pose, atol=1e-12)
    np.testing.assert_allclose(there_and_back.sample(8.0).pose[0], START, atol=1e-12)


@pytest.mark.parametrize("path", [Repeated(CIRCLE, 3), Repeated(LINE, 3), Backwards(LINE)])
def test_twist_and_acceleration_are_derivatives_of_the_pose(path):
    h, t = 1e-5, np.linspace(0.11, path.duration - 0.11, 37)
    before, now, after = (path.sample(t + s) for s in (-h, 0.0, h))
    np.testing.assert_allclose((after.pose - before.pose)[:, :3, 3] / (2 * h), now.twist[:, :3], atol=1e-6)
    np.testing.assert_allclose((after.twist - before.twist) / (2 * h), now.acceleration, atol=1e-4)


def test_backwards_begins_where_the_path_ends():
    back = Backwards(LINE)
    np.testing.assert_array_equal(back.start, LINE.sample(2.0).pose[0])
    np.testing.assert_allclose(back.sample(2.0).pose[0], LINE.start, atol=1e-12)
