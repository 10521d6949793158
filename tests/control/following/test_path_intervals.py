"""A table follows its path to 1e-9 and knows where the twist jumps."""

import numpy as np
import pytest

import ftqp
from ftqp.control.following.path_intervals import path_table
from ftqp.core.pose import transform
from ftqp.kernel.entry.session import PathMemory
from ftqp.kernel.jit import jit
from ftqp.kernel.layout import flat_arrays as layout
from ftqp.kernel.layout.enums import TARGET_SIZE
from ftqp.kernel.rows.path_rows import look_up

START = transform(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([0.4, 0.1, 0.5]))
TURNED = transform(np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]]), np.array([0.1, 0.3, 0.7]))
POINTS = np.array([[0.4, 0.1, 0.5], [0.5, 0.2, 0.5], [0.5, 0.3, 0.7], [0.3, 0.2, 0.6]])
PATHS = {
    "line": ftqp.paths.Line(START, (0.3, -1.0, 0.2), duration=20.0),
    "constant line": ftqp.paths.Line(START, (0.3, 0.0, 0.2), duration=7.3, law="constant"),
    "trapezoid": ftqp.paths.Line(
        START, (0.3, 0.0, 0.2), duration=3.0, law={"name": "trapezoid", "ramp": 0.17}
    ),
    "circle": ftqp.paths.Circle(START, 0.2, duration=4.0),
    "square": ftqp.paths.Square(START, 0.3, duration=5.0),
    "square at constant speed": ftqp.paths.Square(START, 0.3, duration=5.0, law="constant"),
    "lissajous": ftqp.paths.Lissajous(START, (0.2, 0.1), duration=3.0, law="cycloid"),
    "waypoints": ftqp.paths.Waypoints(START, POINTS, duration=3.7),
    "point to point": ftqp.paths.PointToPoint(START, TURNED, duration=1.9),
}


@jit
def looked_up(path, table, progress, targets):
    """The path's targets at each progress in turn, as the kernel reads them."""
    for k in range(len(progress)):
        path.progress = progress[k]
        look_up(path, table, len(table), targets[k])


def sampled(table, times):
    """The table's pose, twist and acceleration as the kernel reads them."""
    lead, targets = PathMemory(table), np.zeros((len(times), TARGET_SIZE))
    looked_up(lead.path, lead.table, np.asarray(times, dtype=float), targets)
    return targets[:, :16].reshape(-1, 4, 4), targets[:, 16:22], targets[:, 22:28]


@pytest.mark.parametrize("name", PATHS)
def test_pose_is_within_a_nanometre_everywhere(name):
    path = PATHS[name]
    times = np.concatenate(
        [np.linspace(0.0, path.duration, 1501), np.random.default_rng(0).uniform(0, path.duration, 500)]
    )
    exact = path.sample(times)
    pose, twist, acceleration = sampled(path_table(path), times)
    assert np.abs(pose - exact.pose).max() < 1e-9
    assert np.abs(twist - exact.twist).max() < 1e-7
    smooth = np.abs(acceleration - exact.acceleration).max(axis=1) < 1e-4
    assert smooth.mean() > 0.99, "right of a jump alone the acceleration may be that of its left"


def test_progress_may_be_looked_up_in_any_order():
    path = PATHS["circle"]
    times = np.random.default_rng(1).permutation(np.linspace(0.0, 4.0, 300))
    assert np.abs(sampled(path_table(path), times)[0] - path.sample(times).pose).max() < 1e-9


@pytest.mark.parametrize(
    ("name", "jumps"),
    [
        ("line", []),
        ("circle", []),
        ("constant line", [7.3]),
        ("square at constant speed", [1.25, 2.5, 3.75, 5.0]),
    ],
)
def test_jumps_of_the_twist_are_where_they_are(name, jumps):
    stops = path_table(PATHS[name])[:, layout.STOP]
    np.testing.assert_allclose(np.unique(stops[np.isfinite(stops)]), jumps, atol=1e-7)
