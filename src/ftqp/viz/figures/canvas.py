"""The paper that figures are drawn on: the only file that imports matplotlib; no window, no global state."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, MissingPackage
from ftqp.core.extras import remedy_for_extra
from ftqp.viz.figures.palette import FORBIDDEN, LIMIT

try:
    from matplotlib import rc_context
    from matplotlib.artist import Artist as Artist
    from matplotlib.axes import Axes as Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection as LineCollection
    from matplotlib.figure import Figure as Figure
    from matplotlib.lines import Line2D as Line2D
    from matplotlib.patches import Patch as Patch
    from matplotlib.text import Text as Text
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
    from matplotlib.ticker import MaxNLocator as MaxNLocator
except ImportError as error:
    raise MissingPackage("drawing figures", "matplotlib", remedy_for_extra("viz")) from error

DOTS_PER_INCH = 110
NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))
"""Of SVG files: what would name a day and an outside address."""
COMPRESSION = 1
"""Of PNG files, 1 to 9: a third of the time of the usual 6, files a fifth larger."""
LETTER, SAMPLE = 0.085, 0.7
"""Width of a letter of a legend, and of the sample of a line with its gaps [inches]."""
TITLE_FROM_TOP, LEGEND_LINE = 0.12, 0.23
"""From the upper edge to the title, and height of a line of a legend [inches]."""
PLAIN = 3
"""Powers of ten up to this, and down to its negative, are written as numbers."""
RAISED = str.maketrans("-0123456789", "\N{SUPERSCRIPT MINUS}⁰¹²³⁴⁵⁶⁷⁸⁹")


def paper(width: float, height: float, title: str, *, search: bool = True) -> Figure:
    """An empty figure of a size in inches, under a title.

    Without ``search`` matplotlib does not look for margins, which takes as long as the drawing; `arrange`
    then says where the panels are.
    """
    figure = Figure(figsize=(width, height), dpi=DOTS_PER_INCH, layout="constrained" if search else None)
    FigureCanvasAgg(figure)
    place = {} if search else {"y": 1.0 - TITLE_FROM_TOP / height, "va": "top"}
    figure.suptitle(title, fontsize=13, fontweight="bold", **place)
    return figure


def arrange(
    figure: Figure,
    handles: Sequence[Any] = (),
    *,
    left: float = 0.75,
    right: float = 0.3,
    top: float = 0.75,
    bottom: float = 0.6,
    gap: tuple[float, float] = (0.7, 0.6),
) -> None:
    """Give the panels of a figure fixed margins, and a legend for all of them below.

    Margins go from the edge to the panels, with room for labels, above for the title and below for the legend
    of the handles, and ``gap`` is between panels, beside and above each other, all in inches. The panels
    share one grid.
    """
    width, height = figure.get_size_inches()
    grid: Any = figure.axes[0].get_gridspec()
    rows, columns = grid.get_geometry()
    if handles:
        bottom += LEGEND_LINE * _legend(figure, handles, "lower center", fontsize=10, borderaxespad=0.2)
    each_width = (width - left - right - (columns - 1) * gap[0]) / columns
    each_height = (height - top - bottom - (rows - 1) * gap[1]) / rows
    grid.update(
        left=left / width,
        right=1.0 - right / width,
        bottom=bottom / height,
        top=1.0 - top / height,
        wspace=gap[0] / each_width,
        hspace=gap[1] / each_height,
    )
    for axes in figure.axes:  # the grid tells pyplot's figures only
        place = axes.get_subplotspec()
        if place is not None:
            axes.set_subplotspec(place)


def label_width(labels: Iterable[str]) -> float:
    """Room for the longest of some labels of an axis [inches]."""
    return LETTER * max((len(label) for label in labels), default=0) + 0.25


def thinned(*signals: FloatArray, bins: int) -> NDArray[np.intp]:
    """Which samples draw the same curve: the least and the largest of every bin, the first and the last.

    A gap (NaN) that fills a bin stays a gap; peaks stay however narrow they are.

    Signals are (K,) each; with at most twice as many samples as bins, which are about one a pixel, all are
    kept. The indices rise.
    """
    count = len(signals[0])
    if count <= 2 * bins:
        return np.arange(count)
    size = -(-count // bins)
    whole = count // size * size
    kept = [np.arange(whole, count), np.array([0, count - 1])]
    starts = np.arange(0, whole, size)
    for signal in signals:
        parts = signal[:whole].reshape(-1, size)
        gaps = np.isnan(parts)
        kept += [starts + np.where(gaps, np.inf, parts).argmin(axis=1)]
        kept += [starts + np.where(gaps, -np.inf, parts).argmax(axis=1)]
    return np.unique(np.concatenate(kept))


def curve(axes: Axes, t: FloatArray, y: FloatArray, **style: Any) -> None:
    """Draw a signal over time, with about two points a pixel.

    Times (K,) rise; NaN in ``y``, (K,), is a gap.
    """
    kept = thinned(y, bins=_pixels(axes))
    axes.plot(t[kept], y[kept], **style)


def trace(axes: Any, *coordinates: FloatArray, **style: Any) -> None:
    """Draw a curve in the plane or in space, with a few points a pixel."""
    kept = thinned(*coordinates, bins=_pixels(axes))
    axes.plot(*(coordinate[kept] for coordinate in coordinates), **style)


def _pixels(axes: Axes) -> int:
    """How wide the panel is."""
    return max(1, int(axes.get_window_extent().width))


def plain_decades(axes: Axes) -> None:
    """A logarithmic y axis whose labels are plain text, which is drawn many times faster than mathematics."""
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(numticks=9))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: decade(value)))


def decade(value: float) -> str:
    """A power of ten in words."""
    exponent = round(float(np.log10(value))) if value > 0.0 else 0
    return f"{value:.4g}" if -PLAIN <= exponent <= PLAIN else "10" + str(exponent).translate(RAISED)


def few_ticks(axes: Axes, x: int = 6, y: int = 5) -> None:
    """At most so many intervals on the axes of a small panel."""
    axes.xaxis.set_major_locator(MaxNLocator(x))
    axes.yaxis.set_major_locator(MaxNLocator(y))


def save(figure: Figure, path: str | Path) -> Path:
    """Write the figure to a file, PNG or by its name SVG, whole or not at all, and return its path."""
    part = Path(path).with_suffix(".part")
    try:
        if Path(path).suffix == ".svg":
            with rc_context({"svg.fonttype": "none", "svg.hashsalt": "ftqp"}):
                figure.savefig(part, format="svg", metadata=NO_METADATA)
        else:
            figure.savefig(part, format="png", pil_kwargs={"compress_level": COMPRESSION})
        part.replace(path)
    except OSError as error:
        raise InputError(f"figure {path} cannot be written: {error.strerror}") from error
    finally:
        part.unlink(missing_ok=True)
    return Path(path)


def tidy(axes: Axes, x_label: str, y_label: str, title: str = "") -> None:
    """Labels, a light grid and no box."""
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    if title:
        head(axes, title)
    axes.grid(True, color="#E4E4E4", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def head(axes: Axes, title: str, **style: Any) -> None:
    """The title of a panel, at a fixed place: looking for a free one takes as long as drawing the panel."""
    axes.set_title(title, **{"fontsize": 10, "y": 1.0, **style})


def shade_beyond(axes: Axes, low: float | None, high: float | None, values: Any) -> None:
    """Shade what lies beyond the limits and choose the range so that they are seen.

    ``values`` is what is drawn, in the unit of the limits; None is no limit.
    """
    finite = np.asarray(values, dtype=np.float64)
    finite = finite[np.isfinite(finite)]
    ends = [
        *([finite.min(), finite.max()] if len(finite) else []),
        *(x for x in (low, high) if x is not None),
    ]
    bottom, top = (min(ends), max(ends)) if ends else (-1.0, 1.0)
    margin = 0.08 * (top - bottom) or 1.0
    axes.set_ylim(bottom - margin, top + margin)
    for limit, outer in ((low, bottom - margin), (high, top + margin)):
        if limit is not None:
            axes.axhspan(min(limit, outer), max(limit, outer), color=FORBIDDEN, zorder=0)
            axes.axhline(limit, color=LIMIT, linewidth=0.8)


def legend_below(figure: Figure, handles: Sequence[Any]) -> None:
    """One legend for a figure whose margins are searched, under it."""
    if handles:
        _legend(figure, handles, "outside lower center")


def _legend(figure: Figure, handles: Sequence[Any], place: Any, **style: Any) -> int:
    """A legend with as many columns as the longest label lets fit, at most five; how many lines it has."""
    longest = max(len(handle.get_label()) for handle in handles)
    fitting = int(figure.get_figwidth() / (LETTER * longest + SAMPLE))
    columns = min(5, len(handles), max(1, fitting))
    figure.legend(handles=list(handles), loc=place, ncols=columns, frameon=False, **style)
    return -(-len(handles) // columns)


def label_below(axes: Axes, text: str, away: float = 0.36) -> None:
    """The label of a panel's lower edge, so far below it [inches], where the panel has no axis of its own."""
    figure: Any = axes.figure
    box = axes.get_position()
    place = 0.5 * (box.x0 + box.x1), box.y0 - away / figure.get_figheight()
    figure.text(*place, text, ha="center", va="center")


def equal_runs(codes: NDArray[Any]) -> list[tuple[int, int, int]]:
    """Where a signal stays the same, (K,): first row, row behind the last, and value of each stretch."""
    ends = [0, *(np.flatnonzero(np.diff(codes)) + 1).tolist(), len(codes)]
    return [(first, last, int(codes[first])) for first, last in pairwise(ends)]


def made_folder(folder: str | Path) -> Path:
    """A folder for figures, made if it is missing."""
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"folder {folder} cannot be made: {error.strerror}") from error
    return Path(folder)
