import numpy as np
import pytest

from ftqp.control.paths import Lissajous
from ftqp.core.errors import InputError


def test_whole_cycles_close_the_figure(start):
    end = Lissajous(start, (0.1, 0.07), duration=5.0, cycles=(3, 2), phase=0.7).sample(5.0).pose[0]
    np.testing.assert_allclose(end, start, atol=1e-15)


def test_figure_stays_inside_its_amplitudes(start):
    pose = Lissajous(start, (0.1, 0.05), duration=5.0).sample(np.linspace(0, 5, 999)).pose
    way = pose[:, :3, 3] - start[:3, 3]
    np.testing.assert_allclose(np.abs(way).max(axis=0), [0.1, 0.05, 0.0], atol=1e-5)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"amplitudes": (0, 0)}, "amplitudes of the Lissajous figure are"),
        ({"amplitudes": (-1, 1)}, "amplitudes of the Lissajous figure are"),
        ({"amplitudes": 1.0}, r"amplitudes of the Lissajous figure has shape \(\)"),
        ({"amplitudes": (1, 1), "cycles": (0, 1)}, "cycles of the Lissajous figure are"),
        ({"amplitudes": (1, 1), "phase": np.nan}, "phase of the Lissajous figure contains NaN"),
    ],
)
def test_wrong_parameters_are_one_clear_sentence(start, keywords, message):
    with pytest.raises(InputError, match=message):
        Lissajous(start, duration=1.0, **keywords)
