import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ftqp.control.paths import Waypoints
from ftqp.core.errors import InputError

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


def test_first_waypoint_at_the_start_is_the_start(start):
    way = np.vstack([np.zeros(3), WAY])
    path = Waypoints(start, way, duration=3.0, relative=True)
    np.testing.assert_allclose(path.sample([0.0, 1.0]).pose[:, :3, 3] - start[:3, 3], way[:2], atol=1e-14)
    np.testing.assert_array_equal(
        Waypoints(start, way, times=[0, 1, 2, 3], relative=True).sample(0.4).pose, path.sample(0.4).pose
    )


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
        ({"duration": 0.0}, "duration of the path is 0"),
        ({"duration": 1.0, "positions": []}, "positions of the waypoints are"),
        ({"duration": 1.0, "positions": [[0, 0]]}, r"positions of the waypoints has shape \(1, 2\)"),
        ({"duration": 1.0, "positions": [[0, 0, 0]]}, "the only waypoint is the start pose"),
        ({"duration": 1.0, "orientations": [[0, 0, 0, 1]]}, "orientations of the waypoints has shape"),
        ({"duration": 1.0, "orientations": [[0, 0, 0, 2]] * 3}, "quaternion 0 of the waypoints has"),
    ],
)
def test_wrong_waypoints_are_one_clear_sentence(start, keywords, message):
    with pytest.raises(InputError, match=message):
        Waypoints(start, relative=True, **{"positions": WAY, **keywords})
