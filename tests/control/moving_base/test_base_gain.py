"""Gain rule, frequency response and noise of the inertial loop, against the loop itself."""

import numpy as np
import pytest

from ftqp.control.moving_base.base_gain import (
    Observer,
    best_gain,
    best_lowpass,
    checked_gain,
    gain_limit,
    sensitivity,
)
from ftqp.core.errors import InputError

DT = 0.01


def loop(moved, gain, lowpass=None, noise=0.0, seed=1):
    """e_k+1 = e_k - k_c (e_k + n_k) + dv_k - d_k+1 with the observer of measured increments, one axis."""
    n = noise * np.random.default_rng(seed).standard_normal(len(moved))
    e, shift, last, u = 0.0, 0.0, None, 0.0
    out = np.empty(len(moved))
    for k, d in enumerate(moved):
        e -= u + d
        seen = e + n[k]
        if lowpass is not None and last is not None:
            shift += lowpass * (-(seen - last) - u - shift)
        last, u = seen, gain * seen - shift
        out[k] = e
    return out


@pytest.mark.parametrize(
    ("degrees", "limit"), [(0, 2.0), (10, 1.9696), (30, 1.7321), (60, 1.0), (90, 0.0), (150, 0.0)]
)
def test_gain_limit_is_twice_the_best_gain(degrees, limit):
    alpha = np.deg2rad(degrees)
    assert gain_limit(alpha) == pytest.approx(limit, abs=1e-4)
    assert gain_limit(-alpha) == 2.0 * best_gain(alpha)


@pytest.mark.parametrize("alpha", [4.0, np.nan])
def test_angle_beyond_half_a_turn_is_refused(alpha):
    with pytest.raises(InputError, match="expected an angle of at most pi"):
        best_gain(alpha)


@pytest.mark.parametrize("gain", [0.0, -1.0, 2.0, 3.0, np.nan])
def test_gain_outside_its_range_is_one_clear_sentence(gain):
    with pytest.raises(InputError, match="gain is"):
        checked_gain(gain)


@pytest.mark.parametrize("gain", [0.4, 1.0, 1.6])
@pytest.mark.parametrize("lowpass", [None, 0.3, 1.0])
def test_sensitivity_is_that_of_the_loop(gain, lowpass):
    observer = None if lowpass is None else Observer(lowpass=lowpass)
    for omega in (1.0, 20.0, 150.0):
        t = DT * np.arange(4000)
        found = loop(np.diff(np.sin(omega * t), prepend=0.0), gain, lowpass)[2000:]
        basis = np.stack([np.sin(omega * t[2000:]), np.cos(omega * t[2000:])], axis=1)
        amplitude = np.linalg.norm(np.linalg.lstsq(basis, found, rcond=None)[0])
        assert amplitude == pytest.approx(float(sensitivity(omega, DT, gain, observer)), rel=1e-6)


@pytest.mark.parametrize("noise", [2e-5, 1e-4, 1e-3])
def test_best_lowpass_at_gain_one_solves_the_equation_of_the_docstring(noise):
    a = best_lowpass(noise, 0.3, DT)
    assert a**1.5 == pytest.approx((1.0 - 0.5 * a) * 0.3 * DT**2 / noise, rel=1e-5)
    assert Observer(noise=noise, acceleration=0.3).factor(DT) == a


@pytest.mark.parametrize("gain", [0.5, 1.0])
def test_best_lowpass_beats_others_in_the_loop(gain):
    noise, acceleration = 1e-4, 0.3
    moved = acceleration * DT**2 * np.arange(20_000)

    def mean_square(a):
        return np.mean(loop(moved, gain, a, noise)[500:] ** 2)

    a = best_lowpass(noise, acceleration, DT, gain)
    assert mean_square(a) < min(mean_square(0.7 * a), mean_square(min(1.0, 1.4 * a)))


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"lowpass": 0.0}, "lowpass is 0, expected a finite number > 0"),
        ({"lowpass": 1.5}, r"lowpass is 1.5, expected a factor in \(0, 1\]"),
        ({"noise": 1e-4}, "one of noise and acceleration; the low-pass factor needs both"),
        ({"acceleration": 1.0}, "one of noise and acceleration"),
        ({"lowpass": 0.3, "noise": 1e-4, "acceleration": 1.0}, "has lowpass and noise; give one of them"),
        ({"noise": -1.0, "acceleration": 1.0}, "noise is -1, expected a finite number > 0 m"),
    ],
)
def test_wrong_observer_is_one_clear_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        Observer(**given)
