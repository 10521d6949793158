"""The observers are the filter F of docs/theory/detection.md, with the noise that it says."""

import numpy as np
import pytest
from scipy import signal
from tests.shaken import DT, SIGMA, Shaken, watch

import ftqp
from ftqp.faults.detection.residual_thresholds import noise_of_acceleration

BANDWIDTHS = (60.0, 200.0)


def observed(robot, samples, sigma=0.0):
    """d of both observers at every tick, (2, K, nv), of an arm whose reference rests at zero."""
    n = robot.nv
    detector = ftqp.Detector(robot=robot, dt=DT, bandwidths=BANDWIDTHS, noise=ftqp.Noise(q=sigma))
    d = np.zeros((2, len(samples), n))
    rest = ftqp.Commanded(*np.zeros((3, n)))
    for k, sample in enumerate(samples):
        detector.update(sample, None, None, rest)
        d[:, k] = detector._session.D.d[:, :n]
    return d


@pytest.fixture(scope="module")
def robot():
    return ftqp.robots.load("panda")


@pytest.mark.parametrize("bank", [0, 1])
def test_step_of_acceleration_comes_out_as_three_poles_make_it(robot, bank):
    ticks = 250
    t = DT * np.arange(ticks)
    d = observed(robot, np.outer(0.5 * t * t, np.ones(7)))[bank]
    p = np.exp(-BANDWIDTHS[bank] * DT)
    steps = np.ones(ticks)
    steps[0] = 0.0  # the acceleration of the tick that ends with each sample
    b, a = (1.0 - p) ** 3 * np.array([0.5, 0.5]), np.poly([p, p, p])
    expected = signal.lfilter(b, a, steps)
    np.testing.assert_allclose(d[2:], np.tile(expected[2:, None], 7), atol=1e-9)
    continuous = signal.step(signal.lti([], [-BANDWIDTHS[bank]] * 3, BANDWIDTHS[bank] ** 3), T=t)[1]
    np.testing.assert_allclose(d[:, 0], continuous, atol=0.08)


@pytest.mark.parametrize("bank", [0, 1])
def test_noise_of_an_observed_acceleration_is_as_derived(robot, bank):
    noise = SIGMA * np.random.default_rng(0).standard_normal((20_000, 7))
    d = observed(robot, noise, SIGMA)[bank, 300:]
    assert d.std() == pytest.approx(noise_of_acceleration(SIGMA, BANDWIDTHS[bank], DT), rel=0.06)


@pytest.mark.parametrize("delay", [0, 3])
def test_reference_that_is_followed_late_by_the_delay_leaves_no_acceleration(robot, delay):
    motion = Shaken(robot, 600)
    detector = ftqp.Detector(robot=robot, dt=DT, delay=delay * DT)
    late = np.concatenate([np.tile(motion.true[0], (delay, 1)), motion.true])[: len(motion.true)]
    watch(detector, motion, late)
    assert np.abs(detector._session.D.d[:, :7]).max() < 1e-6
