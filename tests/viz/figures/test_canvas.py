"""Curves thinned without losing peaks, and a legend that hides nothing."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures import canvas


@given(st.integers(1, 5000), st.integers(1, 700), st.integers(0, 99))
def test_thinned_curve_keeps_ends_and_every_extreme_of_a_bin(count, bins, seed):
    y = np.random.default_rng(seed).standard_normal(count)
    kept = canvas.thinned(y, bins=bins)
    assert (np.diff(kept) > 0).all() and kept[0] == 0 and kept[-1] == count - 1
    assert len(kept) <= 2 * bins + 2 + count // bins
    assert y[kept].max() == y.max() and y[kept].min() == y.min()


def test_gap_stays_a_gap():
    y = np.sin(np.arange(10_000.0))
    y[3000:6000] = np.nan
    kept = canvas.thinned(y, bins=100)
    inside = kept[(kept >= 3000) & (kept < 6000)]
    assert len(inside) > 10 and np.isnan(y[inside]).all()
    assert not np.isnan(y[kept[(kept < 3000) | (kept >= 6000)]]).any()


@pytest.mark.parametrize("count", [0, 1, 9])
def test_the_legend_stands_below_the_panels(count):
    figure = canvas.paper(10.0, 6.0, "a title")
    figure.subplots(2, 3)
    canvas.legend_below(figure, [canvas.Line2D([], [], label=f"curve number {k}") for k in range(count)])
    figure.canvas.draw()
    assert len(figure.legends) == (count > 0)
    if count:
        lowest = min(axes.get_tightbbox().y0 for axes in figure.axes)
        assert 0.0 < figure.legends[0].get_window_extent().y1 <= lowest
