"""The paper that figures are drawn on: the only file that imports matplotlib; no window, no global state."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, MissingPackage
from ftqp.core.extras import remedy_for_extra
from ftqp.core.picture import Picture
from ftqp.core.whole_file import whole_file

try:
    from matplotlib import rc_context
    from matplotlib.axes import Axes as Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine
    from matplotlib.lines import Line2D as Line2D
    from matplotlib.patches import Patch as Patch
    from matplotlib.ticker import MaxNLocator, NullLocator
except ImportError as error:
    raise MissingPackage("drawing figures", "matplotlib", remedy_for_extra("viz")) from error

BLUE, ORANGE, GREEN, RED, PURPLE, SKY, YELLOW = (
    "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442",
)  # fmt: skip
"""Colours that colour-blind readers can tell apart (Okabe and Ito)."""
GREY, WINE = "#7F7F7F", "#882255"
LIMIT = "#C9917D"
FORBIDDEN = "#F4E3DC"
"""Shade of what lies beyond a limit."""
TINT = "#FFF6EC"
"""Background of a joint that fails."""
DEGREES, MILLIMETRES = 180.0 / pi, 1e3
"""In a radian, in a metre."""
DOTS_PER_INCH = 110
NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))
"""Of SVG files: what would name a day and an outside address."""
COMPRESSION = 1
"""Of PNG files, 1 to 9: a third of the time of the usual 6, files a fifth larger."""
PAD = 0.08
"""Around everything [inches]."""
LETTER, SAMPLE = 0.085, 0.7
"""Width of a letter of a legend, and of the sample of a line with its gaps [inches]."""


def paper(width: float, height: float, title: str) -> Figure:
    """An empty figure of a size in inches, under a title; matplotlib finds the margins."""
    figure = Figure(
        figsize=(width, height), dpi=DOTS_PER_INCH, layout=ConstrainedLayoutEngine(h_pad=PAD, w_pad=PAD)
    )
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=13, fontweight="bold")
    return figure


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
    """Draw a signal over time, with about two points a pixel."""
    kept = thinned(y, bins=_pixels(axes))
    axes.plot(t[kept], y[kept], **style)


def trace(axes: Any, *coordinates: FloatArray, **style: Any) -> None:
    """Draw a curve in the plane or in space, with a few points a pixel."""
    kept = thinned(*coordinates, bins=_pixels(axes))
    axes.plot(*(coordinate[kept] for coordinate in coordinates), **style)


def _pixels(axes: Axes) -> int:
    """How wide the panel is."""
    return max(1, int(axes.get_window_extent().width))


def decades(axes: Axes) -> None:
    """A logarithmic y axis whose numbers are plain text, drawn many times faster than mathematics."""
    axes.set_yscale("log")
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter("{x:g}")


def few_ticks(axes: Axes, x: int = 6, y: int = 5) -> None:
    """At most so many intervals on the axes of a small panel."""
    axes.xaxis.set_major_locator(MaxNLocator(x))
    if axes.get_yscale() == "linear":
        axes.yaxis.set_major_locator(MaxNLocator(y))


def save(figure: Figure, path: str | Path) -> Path:
    """Write the figure to a file, PNG or by its name SVG, whole or not at all, and return its path."""
    file = Path(path)
    vector = file.suffix == ".svg"
    options: Any = {"metadata": NO_METADATA} if vector else {"pil_kwargs": {"compress_level": COMPRESSION}}
    try:
        with whole_file(file) as part, rc_context({"svg.fonttype": "none", "svg.hashsalt": "ftqp"}):
            figure.savefig(part, format="svg" if vector else "png", **options)
    except OSError as error:
        raise InputError(f"figure {path} cannot be written: {error.strerror}") from error
    return file


def picture_of(draw: Callable[[Path], Path], title: str) -> Picture:
    """What is drawn to a file, in memory."""
    with TemporaryDirectory(prefix="ftqp-") as folder:
        return Picture(draw(Path(folder) / "picture.png").read_bytes(), title)


def tidy(axes: Axes, x_label: str, y_label: str, title: str = "") -> None:
    """Labels, a light grid and no box."""
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    if title:
        axes.set_title(title, fontsize=10)
    axes.grid(True, color="#E4E4E4", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def shade_beyond(axes: Axes, low: float | None, high: float | None, values: Any) -> None:
    """Shade what lies beyond the limits and choose the range so that they are seen."""
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
    """One legend for a figure, with as many columns as the longest label lets fit, at most five."""
    if handles:
        longest = max(len(handle.get_label()) for handle in handles)
        fitting = int(figure.get_figwidth() / (LETTER * longest + SAMPLE))
        columns = min(5, len(handles), max(1, fitting))
        figure.legend(handles=list(handles), loc="outside lower center", ncols=columns, frameon=False)


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
