"""The motion that identifies an arm keeps limits, begins and ends at rest, and is clear where it must be."""

from typing import Any

import numpy as np
import pytest

import ftqp


def test_it_begins_and_ends_at_rest_where_it_is_told(panda: ftqp.Robot, motion: Any) -> None:
    for end in (0, -1):
        np.testing.assert_allclose(motion.q[end], panda.neutral, atol=1e-12)
        np.testing.assert_allclose(motion.v[end], 0.0, atol=1e-12)
        np.testing.assert_allclose(motion.a[end], 0.0, atol=1e-12)


def test_it_keeps_limits(panda: ftqp.Robot, motion: Any) -> None:
    limits = panda.limits
    assert (motion.q > limits.q_min).all() and (motion.q < limits.q_max).all()
    assert (np.abs(motion.v) <= 0.61 * limits.v_max).all()
    assert (np.abs(motion.a) <= 0.61 * limits.a_max).all()
    tau = [panda.mass_matrix(q) @ a + panda.bias(q, v) for q, v, a in
           zip(motion.q[::50], motion.v[::50], motion.a[::50], strict=True)]  # fmt: skip
    assert (np.abs(tau) <= 0.75 * limits.tau_max).all()


def test_it_is_made_smaller_until_it_is_clear(panda: ftqp.Robot) -> None:
    def near(q: Any) -> bool:
        return bool(np.abs(q - panda.neutral).max() < 0.3)

    motion = ftqp.exciting_motion(panda, duration=6.0, dt=0.01, clear=near)
    assert near(motion.q)


@pytest.mark.slow
def test_where_no_size_is_clear_there_is_no_motion(panda: ftqp.Robot) -> None:
    with pytest.raises(ftqp.InputError, match="no motion of panda from this posture is clear"):
        ftqp.exciting_motion(panda, duration=6.0, dt=0.01, clear=lambda q: False)


def test_too_short_a_motion_is_refused(panda: ftqp.Robot) -> None:
    with pytest.raises(ftqp.InputError, match="duration is 3 s, expected 6 s or more"):
        ftqp.exciting_motion(panda, duration=3.0)
