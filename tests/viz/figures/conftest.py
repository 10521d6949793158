"""Figures that are saved, to look inside."""

from pathlib import Path

import pytest

pytest.importorskip("matplotlib", reason='needs the extra "viz": pip install -e ".[viz]"')

from ftqp.viz.figures import canvas


@pytest.fixture
def drawn(monkeypatch):
    """The figures that would have been written, in their order; empty files stand for them."""
    figures = []

    def keep(figure, file, **_):
        figures.append(figure)
        Path(file).touch()

    monkeypatch.setattr(canvas.Figure, "savefig", keep)
    return figures


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def words(figure):
    """All words of a figure."""
    found = [figure.get_suptitle(), *(text.get_text() for text in figure.texts)]
    found += [text.get_text() for one in figure.legends for text in one.get_texts()]
    for axes in figure.axes:
        found += [axes.get_title(loc) for loc in ("left", "center", "right")]
        found += [axes.get_xlabel(), axes.get_ylabel()]
        found += [text.get_text() for text in axes.texts]
        found += [label.get_text() for label in axes.get_yticklabels()]
        if axes.get_legend():
            found += [text.get_text() for text in axes.get_legend().get_texts()]
    return "\n".join(found)
