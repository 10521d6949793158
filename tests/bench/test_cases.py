"""The recorded targets are smooth, closed, reachable, and the same in every program."""

from collections.abc import Callable

import numpy as np
import pytest
from bench import cases
from bench.urdf import TIP, Array

import ftqp


@pytest.fixture(scope="module")
def path() -> cases.Path:
    """Targets of the chain."""

    def load(urdf: str, a_max: Array) -> Callable[[Array], Array]:
        return ftqp.Robot.from_urdf(urdf, tip=TIP, acceleration=a_max).pose

    return cases.path("chain30", cases.chain30(), load)


def test_targets_start_at_rest_where_the_robot_is(path: cases.Path) -> None:
    np.testing.assert_allclose(path.poses[0], path.pose(path.arm.neutral), atol=1e-12)
    np.testing.assert_allclose(path.twists[0], 0.0, atol=1e-9)


def test_twists_are_the_velocity_of_the_poses(path: cases.Path) -> None:
    k = 700
    ahead = path.poses[k, :3, :3] @ (
        np.eye(3) + _skew(path.poses[k, :3, :3].T @ path.twists[k, 3:]) * cases.DT
    )
    np.testing.assert_allclose(ahead, path.poses[k + 1, :3, :3], atol=1e-7)
    ahead = path.poses[k, :3, 3] + path.twists[k, :3] * cases.DT
    np.testing.assert_allclose(ahead, path.poses[k + 1, :3, 3], atol=1e-6)


def _skew(w: Array) -> Array:
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
