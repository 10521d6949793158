"""Curves thinned without losing peaks, and margins that hold what stands in them."""

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
def test_margins_are_as_wide_as_said_and_the_legend_stands_below(count):
    figure = canvas.paper(10.0, 6.0, "a title", search=False)
    figure.subplots(2, 3)
    handles = [canvas.Line2D([], [], label=f"curve number {k}") for k in range(count)]
    canvas.arrange(figure, handles, left=1.0, right=0.5, top=0.8, bottom=0.6, gap=(0.7, 0.4))
    first, last = figure.axes[0].get_position(), figure.axes[-1].get_position()
    assert 10.0 * first.x0 == pytest.approx(1.0) and 10.0 * (1.0 - last.x1) == pytest.approx(0.5)
    assert 6.0 * (1.0 - first.y1) == pytest.approx(0.8)
    assert 10.0 * (figure.axes[1].get_position().x0 - first.x1) == pytest.approx(0.7)
    assert 6.0 * (first.y0 - last.y1) == pytest.approx(0.4)
    assert len(figure.legends) == (count > 0)
    if count:
        figure.canvas.draw()
        top = figure.legends[0].get_window_extent().y1 / canvas.DOTS_PER_INCH
        assert top <= 6.0 * last.y0 - 0.5
