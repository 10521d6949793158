"""Plain axes write round numbers with as many decimals as they need."""

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures.plain_axes import written


@pytest.mark.parametrize(
    ("ticks", "expected"),
    [
        ([0.0, 5.0, 10.0], ["0", "5", "10"]),
        ([-0.25, 0.0, 0.25], ["−0.25", "0.00", "0.25"]),
        ([-1e-12, 1.5, 3.0], ["0.0", "1.5", "3.0"]),
        ([0.0, 1e-11, 2e-11], ["0", "1e−11", "2e−11"]),
        ([4.0], ["4"]),
    ],
)
def test_numbers_have_the_decimals_they_need(ticks, expected):
    assert written(np.array(ticks)) == expected
