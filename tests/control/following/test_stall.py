"""The settings of an escape."""

import numpy as np
import pytest

import ftqp
from ftqp.control.following.stall import PATTERNS
from ftqp.core.errors import InputError

FREE = np.array([False, True, True, False, True])


@pytest.mark.parametrize("pattern", PATTERNS)
def test_pattern_has_no_symmetry_and_unit_size(pattern):
    drive = ftqp.StallEscape().drive(pattern, FREE)
    assert np.abs(drive).max() == pytest.approx(1.0)
    assert drive.any() and not np.allclose(drive, drive[0])


def test_random_pattern_is_that_of_the_seed():
    first, again = (ftqp.StallEscape(seed=3).drive("random", FREE) for _ in range(2))
    other = ftqp.StallEscape(seed=4).drive("random", FREE)
    assert (first == again).all() and not (first == other).all()


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"below": 0.0}, "below"),
        ({"below": 0.6}, "expected rates with below < until < 1"),
        ({"until": 1.0}, "expected rates with below < until < 1"),
        ({"patience": -1.0}, "patience"),
        ({"patterns": ("alternate",)}, "did you mean 'alternating'"),
        ({"patterns": ()}, "expected at least one of"),
        ({"seed": -1}, "expected a whole number >= 0"),
    ],
)
def test_wrong_setting_is_one_sentence(settings, sentence):
    with pytest.raises(InputError, match=sentence):
        ftqp.StallEscape(**settings)
