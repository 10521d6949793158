"""A push at the tip and a motor that fails are told apart by the torques that are unusual."""

import numpy as np
import pytest
from records import empty_record

from ftqp.kernel.feedback import touch
from ftqp.kernel.layout.enums import DriveKind

N = 7
DT = 0.001


def record():
    """A torque arm of which nothing is unusual."""
    K, rng = empty_record(), np.random.default_rng(2)
    K.chain.n, K.state.dt, K.feedback.kind = N, DT, DriveKind.TORQUE
    K.limits.tau_max[:N] = [80.0, 80.0, 80.0, 80.0, 12.0, 12.0, 12.0]
    K.kinematics.J[:3, :N] = rng.uniform(-0.6, 0.6, (3, N))
    K.feedback.M[:N, :N] = np.eye(N)
    return K


def push(K, force):
    return K.kinematics.J[:3, :N].T @ np.array(force)


def looked_at(K, r, ticks):
    """After so many ticks with torques r that are unusual."""
    K.feedback.missing[:N] = r
    for _ in range(ticks):
        touch.feel_touch(K, 4.0)
    return K.feedback.touched


@pytest.mark.parametrize("force", [(30.0, 0.0, 0.0), (0.0, -8.0, 12.0)])
def test_a_push_is_named_with_its_force_after_ten_milliseconds(force):
    K = record()
    assert not looked_at(K, push(K, force), 9)
    assert looked_at(K, push(K, force), 1)
    np.testing.assert_allclose(K.feedback.push_at_tip, force, atol=1e-3 * np.linalg.norm(force))


@pytest.mark.parametrize("joint", range(N))
def test_a_motor_alone_is_no_push(joint):
    K = record()
    r = np.zeros(N)
    r[joint] = 0.4 * K.limits.tau_max[joint]
    assert not looked_at(K, r, 50)


def test_what_is_slight_or_noise_is_no_push():
    K = record()
    r = push(K, (30.0, 0.0, 0.0))
    assert not looked_at(K, 0.015 / np.abs(r / K.limits.tau_max[:N]).max() * r, 50)
    K.feedback.missing_noise = np.abs(r).max()
    assert not looked_at(K, r, 50)


def test_a_push_is_over_when_a_quarter_is_left_for_a_tenth_of_a_second_and_after_a_second_at_most():
    K = record()
    r = push(K, (30.0, 20.0, 0.0))
    assert looked_at(K, r, 20)
    assert looked_at(K, 0.2 * r, 99)
    assert not looked_at(K, 0.2 * r, 1)
    K = record()
    assert looked_at(K, r, 990)
    assert not looked_at(K, r, 400)
