"""Signals that move a base: start at zero, do what they say, and come again for the same seed."""

import numpy as np
import pytest

from ftqp.core.errors import InputError
from ftqp.sim.base.disturbances import RandomMotion, Recorded, Sinusoid, Step


@pytest.fixture
def t():
    return 0.01 * np.arange(400)


def test_step_jumps_or_ramps_to_its_size(t):
    jump = Step("tilt", -0.3, at=1.0).sample(t)["tilt"]
    assert np.all(jump[t < 0.999] == 0.0) and np.all(jump[t > 0.999] == -0.3)
    ramp = Step("tilt", -0.3, at=1.0, rate=0.2).sample(t)["tilt"]
    assert ramp[100] == 0.0 and ramp[150] == pytest.approx(-0.1) and np.all(ramp[260:] == -0.3)


def test_sinusoid_starts_at_zero(t):
    wave = Sinusoid("x", 0.1, frequency=0.5, phase=0.7).sample(t)["x"]
    assert wave[0] == 0.0
    np.testing.assert_allclose(wave, 0.1 * (np.sin(np.pi * t + 0.7) - np.sin(0.7)), atol=1e-15)


def test_random_motion_has_its_rms_and_corner_and_repeats_for_its_seed():
    t = 0.02 * np.arange(200_000)
    first = RandomMotion("rz", 0.05, corner=0.5, generator=np.random.default_rng(3))
    value = first.sample(t)["rz"]
    assert value[0] == 0.0 and value[1000:].std() == pytest.approx(0.05, rel=0.05)
    np.testing.assert_array_equal(value, first.sample(t)["rz"])
    again = RandomMotion("rz", 0.05, corner=0.5, generator=np.random.default_rng(3))
    np.testing.assert_array_equal(value, again.sample(t)["rz"])
    lag = np.corrcoef(value[1000:-1], value[1001:])[0, 1]
    assert lag == pytest.approx(np.exp(-2 * np.pi * 0.5 * 0.02), rel=0.01)


def test_two_random_motions_of_one_generator_differ(t):
    generator = np.random.default_rng(3)
    a, b = (RandomMotion("x", 1.0, corner=1.0, generator=generator).sample(t)["x"] for _ in range(2))
    assert abs(np.corrcoef(a[1:], b[1:])[0, 1]) < 0.9 and not np.array_equal(a, b)


def test_recording_is_linear_between_samples_and_held_outside():
    found = Recorded([1.0, 2.0], {"x": [0.0, 0.4]}).sample(np.array([0.0, 1.5, 9.0]))["x"]
    np.testing.assert_allclose(found, [0.0, 0.2, 0.4])


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Step("x", np.nan), "size of the step is nan"),
        (lambda: Step("x", 1.0, rate=0.0), "rate of the step is 0"),
        (lambda: Step("x", 1.0, at=-1.0), "time of the step is -1"),
        (lambda: Sinusoid("x", 1.0, frequency=0.0), "frequency is 0"),
        (lambda: Sinusoid("x", "much", frequency=1.0), "amplitude is 'much'"),
        (lambda: RandomMotion("x", 1.0, corner=1.0, generator=7), "generator is int, expected numpy.random"),
        (lambda: Recorded([0.0, 0.0], {"x": [1.0, 2.0]}), "times of a recorded disturbance do not rise"),
        (lambda: Recorded([0.0, 1.0], {"x": [1.0, np.nan]}), r"x of a recorded disturbance has shape \(2,\)"),
    ],
)
def test_wrong_disturbance_is_one_clear_sentence(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()
