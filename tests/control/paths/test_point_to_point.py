import numpy as np

from ftqp.control.paths import PointToPoint
from ftqp.core.pose import rotation_exp, transform


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
