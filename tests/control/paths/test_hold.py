import numpy as np

from ftqp.control.paths import Hold


def test_hold_stays_at_its_start(start):
    sample = Hold(start, duration=2.0).sample([0.0, 1.0, 5.0])
    np.testing.assert_array_equal(sample.pose, np.tile(start, (3, 1, 1)))
    assert not sample.twist.any() and not sample.acceleration.any()
