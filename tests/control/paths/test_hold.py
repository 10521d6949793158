import numpy as np
import pytest

from ftqp.control.paths import Hold
from ftqp.core.errors import InputError


def test_hold_stays_at_its_start(start):
    sample = Hold(start, duration=2.0).sample([0.0, 1.0, 5.0])
    np.testing.assert_array_equal(sample.pose, np.tile(start, (3, 1, 1)))
    assert not sample.twist.any() and not sample.acceleration.any()


def test_hold_needs_a_duration(start):
    with pytest.raises(InputError, match="duration of the path is 0"):
        Hold(start, duration=0.0)
