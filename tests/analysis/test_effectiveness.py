import numpy as np
import pytest

from ftqp.analysis.learned_law import DOUBT, Effectiveness
from ftqp.core.errors import InputError


def moved(count: int, theta: list[float], noise: float = 0.0, seed: int = 0) -> Effectiveness:
    """What was learned from random motions of joints with this effectiveness."""
    generator = np.random.default_rng(seed)
    learned = Effectiveness(len(theta), 0.01, noise=noise)
    for _ in range(count):
        J, dq = generator.normal(size=(2, len(theta))), 0.01 * generator.normal(size=len(theta))
        seen = noise * np.sqrt(2.0) * generator.normal(size=2)
        learned.learn(J, dq, J @ (np.array(theta) * dq) + seen)
    return learned


@pytest.mark.parametrize("theta", [[1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [0.4, 1.0, 0.0]])
def test_what_each_joint_does_is_learned_from_the_motion_of_the_tip(theta: list[float]) -> None:
    np.testing.assert_allclose(moved(40, theta).theta, theta, atol=2e-3)


def test_with_noise_it_is_learned_as_well_as_the_deviation_says() -> None:
    found = [moved(200, [1.0, 0.5, 1.0], noise=1e-3, seed=seed) for seed in range(40)]
    off = np.array([(one._theta - [1.0, 0.5, 1.0]) / one.deviation for one in found])
    assert 0.7 < np.sqrt(np.mean(off**2)) < 1.3


def test_of_a_joint_that_was_never_asked_to_move_nothing_is_learned() -> None:
    learned = Effectiveness(2, 0.01)
    for _ in range(100):
        learned.learn([[1.0, 1.0]], [0.01, 0.0], [0.005])
    assert learned.theta[0] == pytest.approx(0.5, abs=1e-3)
    assert learned.theta[1] == 1.0
    assert learned.deviation[1] >= DOUBT


def test_a_fault_after_a_long_healthy_motion_is_learned() -> None:
    generator = np.random.default_rng(1)
    learned = Effectiveness(3, 0.01)
    for k in range(20_000):
        J, dq = generator.normal(size=(2, 3)), 0.01 * generator.normal(size=3)
        learned.learn(J, dq, J @ (np.array([1.0, 1.0, 0.0 if k > 19_900 else 1.0]) * dq))
    assert learned.theta[2] < 0.05


def test_an_arm_at_rest_for_long_keeps_a_bounded_doubt() -> None:
    learned = Effectiveness(4, 1.0)
    for _ in range(10_000):
        learned.learn(np.ones((2, 4)), np.zeros(4), np.zeros(2))
    assert (learned.deviation <= 1.0 + 1e-3).all()
    assert np.linalg.eigvalsh(learned._P).min() > 0.0
    assert (learned.theta == 1.0).all()


def test_what_does_not_fit_is_bad_input() -> None:
    learned = Effectiveness(3, 0.01)
    with pytest.raises(InputError, match=r"dq has shape \(2,\), expected \(nv,\) = \(3,\)"):
        learned.learn(np.ones((2, 3)), np.ones(2), np.ones(2))
    with pytest.raises(InputError, match="J has shape"):
        learned.learn(np.ones((3, 3)), np.ones(3), np.ones(2))
    with pytest.raises(InputError, match="dx contains NaN"):
        learned.learn(np.ones((2, 3)), np.ones(3), [np.nan, 0.0])
    for settings in (
        {"joints": 0, "dt": 0.01},
        {"joints": 2, "dt": 0.0},
        {"joints": 2, "dt": 0.1, "noise": -1.0},
    ):
        with pytest.raises(InputError):
            Effectiveness(**settings)
