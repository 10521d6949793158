"""The paper that figures are drawn on: the only file that imports matplotlib; no window, no global state."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.errors import InputError, MissingPackage

try:
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
except ImportError as error:
    raise MissingPackage("drawing figures", "matplotlib", 'pip install "ftqp[viz]"') from error

DOTS_PER_INCH = 110
BLUE, ORANGE, GREEN, RED, PURPLE, SKY, YELLOW = (
    "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442",
)  # fmt: skip
"""Colours that colour-blind readers can tell apart (Okabe and Ito)."""
GREY, WINE = "#7F7F7F", "#882255"
LIMIT = "#C9917D"
FORBIDDEN = "#F4E3DC"
"""Shade of what lies beyond a limit."""
LETTER, SAMPLE = 0.085, 0.7
"""Width of a letter of a legend, and of the sample of a line with its gaps [inches]."""
TINT = "#FFF6EC"
"""Background of a joint that fails."""


def paper(width: float, height: float, title: str) -> Figure:
    """An empty figure of a size in inches, under a title."""
    figure = Figure(figsize=(width, height), dpi=DOTS_PER_INCH, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=13, fontweight="bold")
    return figure


def save(figure: Figure, path: str | Path) -> Path:
    """Write the figure to a PNG file, whole or not at all, and return its path.

    Raises:
        InputError: the file cannot be written.
    """
    part = Path(path).with_suffix(".part")
    try:
        figure.savefig(part, format="png")
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
        axes.set_title(title, fontsize=10)
    axes.grid(True, color="#E4E4E4", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def shade_beyond(axes: Axes, low: float | None, high: float | None, values: Any) -> None:
    """Shade what lies beyond the limits and choose the range so that they are seen.

    Args:
        axes: where to draw.
        low: lower limit, or ``None``.
        high: upper limit, or ``None``.
        values: what is drawn, in the same unit.
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


def shade_later(axes: Axes, since: float, low: float | None, high: float | None) -> None:
    """Shade what lies beyond narrower limits from a time on; the range of `shade_beyond` stays."""
    bottom, top = axes.get_ylim()
    end = float(axes.get_xlim()[1])
    for limit, outer in ((low, bottom), (high, top)):
        if limit is not None:
            axes.fill_between([since, end], limit, outer, color=FORBIDDEN, linewidth=0.0, zorder=0)
            axes.plot([since, end], [limit, limit], color=LIMIT, linewidth=0.8)


def legend_below(figure: Figure, handles: Sequence[Any]) -> None:
    """One legend for the whole figure, under it, with as many columns as its longest label lets fit."""
    if handles:
        longest = max(len(handle.get_label()) for handle in handles)
        fitting = int(figure.get_figwidth() / (LETTER * longest + SAMPLE))
        figure.legend(
            handles=list(handles),
            loc="outside lower center",
            ncols=min(5, len(handles), max(1, fitting)),
            frameon=False,
        )


__all__ = [
    "BLUE",
    "FORBIDDEN",
    "GREEN",
    "GREY",
    "ORANGE",
    "PURPLE",
    "RED",
    "SKY",
    "TINT",
    "WINE",
    "YELLOW",
    "Axes",
    "Figure",
    "Line2D",
    "Patch",
    "legend_below",
    "paper",
    "save",
    "shade_beyond",
    "shade_later",
    "tidy",
]
