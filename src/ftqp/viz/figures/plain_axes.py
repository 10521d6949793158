"""Axes whose grid and numbers are drawn in one go: several times faster than an axis of matplotlib."""

from collections.abc import Sequence
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.viz.figures.canvas import Artist, Axes, LineCollection, MaxNLocator, Text, decade

GRID, LINE, INK = "#E4E4E4", "#555555", "#222222"
SIZE = 8.5
"""Of the numbers [points]."""
AWAY = 4.0
"""From an axis to its numbers [points]."""
MINUS = str.maketrans("-", "\N{MINUS SIGN}")
EXACT = 1e-3
"""A number is written so that it is wrong by less than this share of the step."""
DECIMALS = 9
"""A number has at most so many."""


def plain_axes(axes: Axes, *, count: tuple[int, int] = (5, 4), bottom: bool = True) -> None:
    """Replace both axes of a panel by a grid, two lines and plain numbers.

    ``count`` is the most intervals, across and up; where the upward scale is logarithmic, every power of ten
    counts. ``bottom`` says whether the numbers below the panel are written.
    """
    axes.xaxis.set_visible(False)
    axes.yaxis.set_visible(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.add_artist(_Ruler(count, bottom))


def written(ticks: FloatArray) -> list[str]:
    """Numbers with as many decimals as they need."""
    step = float(np.min(np.diff(ticks))) if len(ticks) > 1 else max(abs(float(ticks[0])), 1.0)
    for decimals in range(DECIMALS):
        if (np.abs(np.round(ticks, decimals) - ticks) < EXACT * step).all():
            break
    else:
        return [f"{tick:.3g}".translate(MINUS) for tick in ticks]
    return [f"{tick + 0.0:.{decimals}f}".translate(MINUS) for tick in np.round(ticks, decimals)]


@final
class _Ruler(Artist):
    """Grid, lines and numbers of a panel, found when it is drawn and its range is known."""

    def __init__(self, count: tuple[int, int], bottom: bool) -> None:
        super().__init__()
        self._count, self._below = count, bottom
        self.set_zorder(0.5)

    def draw(self, renderer: Any) -> None:
        """Draw them."""
        axes: Any = self.axes
        box = axes.bbox
        away = AWAY / 72.0 * axes.figure.dpi
        across = _ticks(axes.get_xlim(), self._count[0])
        decades = axes.get_yscale() == "log"
        up = (_decades if decades else _ticks)(axes.get_ylim(), self._count[1])
        corner = axes.get_xlim()[0], axes.get_ylim()[0]
        x = axes.transData.transform([(value, corner[1]) for value in across])[:, 0]
        y = axes.transData.transform([(corner[0], value) for value in up])[:, 1]
        grid = [[(at, box.y0), (at, box.y1)] for at in x] + [[(box.x0, at), (box.x1, at)] for at in y]
        frame = [[(box.x0, box.y1), (box.x0, box.y0), (box.x1, box.y0)]]
        _lines(axes, renderer, grid, GRID, 0.6)
        _lines(axes, renderer, frame, LINE, 0.8)
        if self._below:
            for at, label in zip(x, written(across), strict=True):
                _text(axes, renderer, at, box.y0 - away, label, "center", "top")
        numbers = [decade(value) for value in up] if decades else written(up)
        for at, label in zip(y, numbers, strict=True):
            _text(axes, renderer, box.x0 - away, at, label, "right", "center")


def _ticks(ends: tuple[float, float], count: int) -> FloatArray:
    """Round numbers within a range."""
    low, high = sorted(ends)
    ticks = np.asarray(MaxNLocator(count).tick_values(low, high))
    slack = 1e-9 * (high - low)
    inside: FloatArray = ticks[(ticks >= low - slack) & (ticks <= high + slack)]
    return inside if len(inside) else np.array([0.5 * (low + high)])


def _decades(ends: tuple[float, float], count: int) -> FloatArray:
    """Powers of ten within a range, every one or every so many."""
    first, last = (float(np.log10(end)) for end in ends)
    exponents = np.arange(np.ceil(first - 1e-9), np.floor(last + 1e-9) + 1.0)
    powers: FloatArray = 10.0 ** exponents[:: max(1, -(-len(exponents) // (2 * count)))]
    return powers if len(powers) else np.array([ends[1]])


def _lines(axes: Any, renderer: Any, segments: Sequence[Any], colour: str, width: float) -> None:
    lines = LineCollection(segments, colors=colour, linewidths=width)
    lines.set_figure(axes.figure)
    lines.draw(renderer)


def _text(axes: Any, renderer: Any, x: float, y: float, text: str, across: str, up: str) -> None:
    label = Text(x, y, text, fontsize=SIZE, color=INK, ha=across, va=up)
    label.set_figure(axes.figure)
    label.draw(renderer)
