"""Several runs, or several joints, as curves that can be told apart even where they coincide."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.sim.log.log_arrays import Log
from ftqp.viz.figures import events
from ftqp.viz.figures.canvas import Axes, Line2D, decades
from ftqp.viz.figures.canvas import curve as draw
from ftqp.viz.figures.palette import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, WINE

COLOURS = (BLUE, ORANGE, GREEN, "black", SKY, PURPLE, GREY, WINE)
"""Colours of runs and of joints; they come again, dashed, after the last. Red marks faults."""
THIN, STEP, WIDE = 1.3, 2.2, 12.0
"""Width of a curve, what is added for each later run that hides it, and what is added at most [points]."""
ALIKE, MOSTLY = 0.05, 0.95
"""Two curves hide each other when they differ by less than a share for most of the time."""
USUAL, RARE = 99.5, 3.0
"""The frame ends beyond this percentile where the peak is so many times higher."""
SPIKES = " (rare spikes go beyond the frame)"
"""What a title says then."""
STYLES = ("-", "--", ":", "-.")


def draw_runs(axes: Axes, logs: Mapping[str, Log], curves: Sequence[FloatArray]) -> None:
    """One curve a run; those that later ones hide are so much wider that all are seen."""
    nested, step = False, min(STEP, WIDE / max(len(curves) - 1, 1))
    for index, (log, curve) in enumerate(zip(logs.values(), curves, strict=True)):
        colour, style = look(index)
        hidden = sum(_alike(curve, other) for other in curves[index + 1 :])
        nested |= hidden > 0
        draw(axes, log["t"], curve, color=colour, linestyle=style, linewidth=THIN + step * hidden)
        stop = events.stop_time(log)
        if stop is not None:
            at = int(np.searchsorted(log["t"], stop - events.TOLD_LATER))
            axes.plot(stop, curve[at], "o", color=colour, markersize=6.0 + 2.0 * step * hidden, zorder=3)
    axes.set_xlim(*time_span(logs))
    if nested:
        axes.set_title("curves that coincide are drawn one inside the other", loc="right", fontsize=8.5)


def _alike(first: FloatArray, second: FloatArray) -> bool:
    """Whether one curve hides the other: nearly equal nearly everywhere."""
    count = min(len(first), len(second))
    a, b = np.abs(first[:count]), np.abs(second[:count])
    return bool(np.mean(np.abs(a - b) <= ALIKE * np.maximum(a, b)) > MOSTLY)


def frame(curves: Sequence[FloatArray]) -> float:
    """Where the frame ends: above the peak, or above what is usual when the peak is a rare spike."""
    top = peak(curves)
    usual = float(np.nanpercentile(np.abs(np.concatenate([curve.ravel() for curve in curves])), USUAL))
    return 1.3 * usual if top > RARE * usual > 0.0 else 1.08 * top or 1.0


def peak(curves: Sequence[FloatArray]) -> float:
    """The largest absolute value of all; 0 where there is none."""
    return max(float(np.nanmax(np.abs(curve))) if np.isfinite(curve).any() else 0.0 for curve in curves)


def length(metres: float) -> str:
    """A length for a legend."""
    return f"{1e3 * metres:.3g} mm" if metres >= 1e-4 else f"{1e6 * metres:.3g} µm"


def look(index: int) -> tuple[str, Any]:
    """Colour and line style of the run or joint of that index."""
    return COLOURS[index % len(COLOURS)], STYLES[index // len(COLOURS) % len(STYLES)]


def handle(index: int, label: str) -> Line2D:
    """The run or joint of that index, for a legend."""
    colour, style = look(index)
    return Line2D([], [], color=colour, linestyle=style, linewidth=2.0, label=label)


def run_handles(logs: Mapping[str, Log], remarks: Sequence[str]) -> list[Line2D]:
    """What the colours of the runs mean, with a remark on each."""
    handles = []
    for index, ((label, log), remark) in enumerate(zip(logs.items(), remarks, strict=True)):
        stop = events.stop_time(log)
        parts = [label, remark, "" if stop is None else f"stopped at {stop:.4g} s"]
        handles.append(handle(index, ", ".join(part for part in parts if part)))
    return handles


def logarithmic(axes: Axes, curves: Sequence[FloatArray]) -> None:
    """A logarithmic axis over what is usual and all that is above it; the start from zero is cut off."""
    decades(axes)
    usual = min(float(np.percentile(curve, 1.0)) for curve in curves)
    axes.set_ylim(0.3 * usual, 5.0 * max(float(curve.max()) for curve in curves))


def time_span(logs: Mapping[str, Log]) -> tuple[float, float]:
    """First and last time of all logs [s]."""
    spans = [events.time_span(log) for log in logs.values()]
    return min(start for start, _ in spans), max(end for _, end in spans)


def longest(logs: Mapping[str, Log]) -> Log:
    """The log that went on longest: all faults of the scenario that happened in any run."""
    return max(logs.values(), key=lambda log: float(log["t"][-1]))
