"""Figures within a page carry no outside address and lose no number that a reader sees."""

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures.canvas import curve, paper, save, tidy
from ftqp.viz.report.run_report import cleaned


@pytest.fixture
def svg(tmp_path):
    figure = paper(4.0, 3.0, "error 0.00085 <mm>")
    axes = figure.add_subplot()
    t = np.linspace(0.0, 1.0, 50_000)
    y = np.zeros(len(t))
    y[31_415] = 1.0
    curve(axes, t, y)
    tidy(axes, "time [s]", "")
    return save(figure, tmp_path / "a.svg").read_text(encoding="utf-8")


def test_texts_are_text_with_all_their_digits(svg):
    assert "error 0.00085 &lt;mm&gt;" in cleaned(svg)


def test_no_outside_address_is_left(svg):
    text = cleaned(svg)
    assert "http" in svg and "http" not in text
    assert "xlink" not in text
    assert text.startswith("<svg") and text.rstrip().endswith("</svg>")
