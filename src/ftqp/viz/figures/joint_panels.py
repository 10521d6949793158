"""One panel a joint, scaled to what moves; a bar beside it shows how much of its limits that takes."""

from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import kind_of
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.signals import HEALTHY
from ftqp.viz.figures import events
from ftqp.viz.figures.canvas import (
    Axes,
    Figure,
    Line2D,
    LineCollection,
    Patch,
    arrange,
    curve,
    head,
    paper,
    save,
)
from ftqp.viz.figures.palette import BLUE, FORBIDDEN, GREY, LIMIT, RED, TINT
from ftqp.viz.figures.plain_axes import plain_axes

COLUMNS = 4
"""Most joints side by side."""
GAP = (1.0, 0.42)
"""Between panels, beside and above each other [inches]."""
LEAST = 0.03
"""A panel shows at least this share of a joint's limits, so that rounding does not fill it."""
NEAR = 0.5
"""A limit nearer to the motion than this share of its extent is shown."""
ROOM = 0.1
"""Free room above and below, as a share of what is shown."""
BAR, BAR_WIDTH = 1.045, 4.5
"""Where the bar of the limits stands, in widths of the panel, and how wide it is [points]."""
LABEL = 7.5
"""Of the limits beside the bar [points]."""


def panels(log: Log, title: str) -> tuple[Figure, list[Axes]]:
    """An empty figure with a panel for each joint."""
    count = len(log.metadata["joints"])
    columns = _columns(count)
    rows = ceil(count / columns)
    figure = paper(3.4 * columns, 2.05 * rows + 1.5, title, search=False)
    grid: Any = figure.add_gridspec(rows, columns)
    return figure, [figure.add_subplot(grid[i // columns, i % columns]) for i in range(count)]


def _columns(count: int) -> int:
    """Panels side by side: at most four, and rows as full as can be."""
    return min(count, 3 if count in (3, 5, 6, 9) else COLUMNS)


def draw_values(axes: Axes, log: Log, i: int, values: FloatArray, colour: str = BLUE) -> None:
    """The signal of joint i, in red from its failure on."""
    failed = log["truth"][:, i] != HEALTHY
    curve(axes, log["t"], np.where(failed, np.nan, values), color=colour, linewidth=1.4, zorder=3)
    if failed.any():
        curve(axes, log["t"], np.where(failed, values, np.nan), color=RED, linewidth=2.2, zorder=3)
        axes.set_facecolor(TINT)


def finish_panel(
    axes: Axes, log: Log, i: int, values: Sequence[FloatArray], *, limits: tuple[float | None, float | None],
    later: Sequence[tuple[float, float | None, float | None]] = (), zero: bool = False, unit: str = "",
    remark: str = "",
) -> None:  # fmt: skip
    """Choose what a panel shows, and draw its limits, the bar beside it, title and instants.

    Args:
        axes: The panel.
        log: The run.
        i: The joint.
        values: What is drawn, each (K,); NaN is a gap.
        limits: Lower and upper; None is none.
        later: Instants with the narrower limits that hold from then on.
        zero: Whether zero is to be seen.
        unit: Said in the title where joints differ in it.
        remark: Said in the title of a joint that failed, in place of when.
    """
    finite = np.concatenate([signal[np.isfinite(signal)] for signal in values] or [np.zeros(0)])
    least, largest = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    axes.set_ylim(*_shown(least, largest, limits, later, zero=zero))
    axes.set_xlim(*events.time_span(log))
    _shade(axes, limits, later)
    _bar(axes, least, largest, limits, failed=bool((log["truth"][:, i] != HEALTHY).any()))
    events.mark(axes, log)
    count = len(log.metadata["joints"])
    plain_axes(axes, count=(4, 4), bottom=i + _columns(count) >= count)
    own = [fault for fault in events.faults(log) if fault["index"] == i]
    name = log.metadata["joints"][i] + (f" [{unit}]" if unit else "")
    if own:
        said = remark or f"{own[-1]['kind'].replace('_', '-')} from {own[-1]['at']:g} s"
        head(axes, f"{name}: {said}", color=RED, fontweight="bold", loc="left")
    else:
        head(axes, name, loc="left")


def _shown(
    least: float, largest: float, limits: tuple[float | None, float | None],
    later: Sequence[tuple[float, float | None, float | None]], *, zero: bool,
) -> tuple[float, float]:  # fmt: skip
    """The range of a panel: the motion, with the limits that are near."""
    low, high = (min(least, 0.0), max(largest, 0.0)) if zero else (least, largest)
    first, last = limits
    whole = last - first if first is not None and last is not None else 0.0
    smallest = LEAST * whole or 1e-6
    if high - low < smallest:
        low, high = 0.5 * (low + high - smallest), 0.5 * (low + high + smallest)
    extent = high - low
    lower, upper = [first, *(end for _, end, _ in later)], [last, *(end for _, _, end in later)]
    near_low = [x for x in lower if x is not None and abs(x - low) < NEAR * extent]
    near_high = [x for x in upper if x is not None and abs(x - high) < NEAR * extent]
    low, high = min([low, *near_low]), max([high, *near_high])
    margin = ROOM * (high - low)
    return low - margin, high + margin


def _shade(
    axes: Axes, limits: tuple[float | None, float | None],
    later: Sequence[tuple[float, float | None, float | None]],
) -> None:  # fmt: skip
    """What lies beyond the limits, as far as it is in view."""
    bottom, top = axes.get_ylim()
    start, end = axes.get_xlim()
    for since, low, high in [(start, *limits), *later]:
        for limit, outer in ((low, bottom), (high, top)):
            if limit is not None and bottom < limit < top:
                axes.fill_between([since, end], limit, outer, color=FORBIDDEN, linewidth=0.0, zorder=0)
                axes.plot([since, end], [limit, limit], color=LIMIT, linewidth=1.2)


def _bar(
    axes: Axes, least: float, largest: float, limits: tuple[float | None, float | None], *, failed: bool
) -> None:
    """The whole of the limits, and how much of it is used; nothing without limits."""
    low, high = limits
    if low is None or high is None or not high > low:
        return
    ends = [float(np.clip((x - low) / (high - low), 0.0, 1.0)) for x in (least, largest)]
    middle = 0.5 * sum(ends)
    used = [min(ends[0], middle - 0.01), max(ends[1], middle + 0.01)]
    axes.add_collection(
        LineCollection(
            [[(BAR, 0.0), (BAR, 1.0)], [(BAR, used[0]), (BAR, used[1])]],
            colors=["#DDDDDD", RED if failed else BLUE], linewidths=BAR_WIDTH, transform=axes.transAxes,
            clip_on=False,
        ),
        autolim=False,
    )  # fmt: skip
    for place, value in ((0.0, low), (1.0, high)):
        axes.text(
            BAR + 0.02, place, f"{value:.3g}".replace("-", "\N{MINUS SIGN}"), transform=axes.transAxes,
            fontsize=LABEL, color=GREY, va="bottom" if place == 0.0 else "top", clip_on=False,
        )  # fmt: skip


def degradations(log: Log, i: int) -> list[dict[str, Any]]:
    """The faults after which joint i still works, perhaps with less of its limits."""
    return [fault for fault in events.faults(log) if kind_of(fault["kind"]).works and fault["index"] == i]


def bar_handle(what: str) -> Patch:
    """What the bars beside the panels mean, for a legend."""
    label = f"bar beside: share of {what} in use"
    return Patch(facecolor=BLUE, edgecolor="#DDDDDD", linewidth=2.0, label=label)


def finish_figure(
    figure: Figure, log: Log, path: str | Path, label: str, handles: Sequence[Line2D | Patch]
) -> Path:
    """Legend, names of the axes, and the file."""
    arrange(figure, [*handles, *events.handles(log)], left=0.85, right=0.55, top=0.8, bottom=0.6, gap=GAP)
    width, height = figure.get_size_inches()
    box = figure.axes[-1].get_position()
    lowest = min(axes.get_position().y0 for axes in figure.axes)
    figure.text(0.2 / width, 0.5 * (1.0 + lowest), label, rotation=90.0, va="center", ha="center")
    figure.text(0.5 * (box.x0 + box.x1), lowest - 0.33 / height, "time [s]", va="center", ha="center")
    return save(figure, path)
