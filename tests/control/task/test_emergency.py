"""An emergency stop has thresholds and a number of samples that make sense."""

import dataclasses

import numpy as np
import pytest

from ftqp.control.task.emergency import EmergencyStop
from ftqp.core.errors import InputError


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"position": 0.0}, "position is 0, expected a finite number > 0 m"),
        ({"rotation": np.inf}, "rotation is inf, expected a finite number > 0 rad"),
        ({"samples": 0}, "samples is 0, expected a whole number >= 1"),
        ({"samples": 2.5}, "samples is 2.5, expected a whole number >= 1"),
    ],
)
def test_senseless_stop_is_refused_with_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        EmergencyStop(**given)


def test_one_noisy_sample_does_not_stop_by_default():
    assert EmergencyStop().samples == 3


def test_it_stops_by_default_beyond_five_centimetres_or_three_tenths_of_a_radian():
    stop = EmergencyStop()
    assert (stop.position, stop.rotation, stop.samples) == (0.05, 0.3, 3)
    assert EmergencyStop(samples=1).samples == 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        stop.position = 1.0
