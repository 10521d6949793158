"""The path of the tip, desired and actual, and its error over time."""

from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.sim.log.log_arrays import Log
from ftqp.viz.figures import events
from ftqp.viz.figures.canvas import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Axes,
    Figure,
    arrange,
    curve,
    paper,
    plain_decades,
    save,
    tidy,
    trace,
)

FLAT = 0.02
"""A path is drawn in its plane when it is thinner than this share of its size."""
MILLIMETRES = 1e3
SMALLEST_ERROR = 1e-9
"""Errors below this are drawn at it: a logarithmic axis has no zero [mm or deg]."""


def draw(log: Log, path: str | Path) -> Path:
    """Draw the path and its error to a PNG file.

    Args:
        log: a loaded log.
        path: the file to write.
    """
    figure = paper(12.0, 6.2, f"Path of the tip: {events.heading(log)}", search=False)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.15))
    flat = _draw_path(figure, grid[:, 0], log)
    turns = bool((log["rotation_error"] > 0.0).any())
    position = figure.add_subplot(grid[0, 1] if turns else grid[:, 1])
    emergency = log.metadata.get("emergency") or {}
    _draw_error(position, log, "position_error", "mm", emergency.get("position"))
    if turns:
        rotation = figure.add_subplot(grid[1, 1], sharex=position)
        _draw_error(rotation, log, "rotation_error", "deg", emergency.get("rotation"))
    else:
        position.set_xlabel("time [s]")
    arrange(figure, events.handles(log), gap=(0.8 if flat else 1.4, 0.5))
    return save(figure, path)


def _draw_error(axes: Axes, log: Log, signal: str, unit: str, threshold: float | None) -> None:
    factor, what = (MILLIMETRES, "Distance from") if unit == "mm" else (180.0 / np.pi, "Angle to")
    error = factor * log[signal]
    worst = int(np.argmax(error))
    at, largest = float(log["t"][worst]), float(error[worst])
    plain_decades(axes)
    curve(axes, log["t"], np.maximum(error, SMALLEST_ERROR), color=BLUE, linewidth=1.2)
    axes.plot(at, max(largest, SMALLEST_ERROR), "o", color=BLUE, markersize=5)
    title = f"{what} the target: largest {largest:.3g} {unit}, at {at:.4g} s"
    tidy(axes, "time [s]" if unit == "deg" else "", f"error [{unit}]", title)
    if threshold is not None:
        axes.axhline(factor * threshold, color=RED, linewidth=0.9, linestyle="--")
        axes.annotate(
            "emergency stop above this, if rising", (0.01, factor * threshold), xytext=(0, 3),
            xycoords=("axes fraction", "data"), textcoords="offset points", fontsize=8, color=RED,
        )  # fmt: skip
    usual = np.percentile(np.maximum(error, SMALLEST_ERROR), 1.0)
    top = max(largest, factor * (threshold or 0.0), SMALLEST_ERROR)
    axes.set_ylim(0.3 * usual, 5.0 * top)
    axes.set_xlim(*events.time_span(log))
    events.mark(axes, log)


def _draw_path(figure: Figure, place: Any, log: Log) -> bool:
    """In the plane of what was asked and done where that is flat, else in space [mm]; whether it is flat."""
    origin = log["target"][0, :3]
    desired = MILLIMETRES * (log["target"][:, :3] - origin)
    actual = MILLIMETRES * (log["tip"][:, :3] - origin)
    spread = np.ptp(np.vstack([desired, actual]), axis=0)
    order = np.argsort(-spread, kind="stable")
    flat = bool(spread[order[2]] <= FLAT * spread[order[0]])
    if flat:
        _draw_flat(figure.add_subplot(place), log, desired, actual, sorted(int(i) for i in order[:2]))
    else:
        space = figure.add_subplot(place, projection="3d")
        _draw_in_space(space, log, desired, actual)
    return flat


def _draw_flat(axes: Axes, log: Log, desired: FloatArray, actual: FloatArray, plane: list[int]) -> None:
    first, second = plane
    wide = {"color": GREY, "linewidth": 5.0, "alpha": 0.35, "label": "desired"}
    trace(axes, desired[:, first], desired[:, second], **wide)
    trace(axes, actual[:, first], actual[:, second], color=BLUE, linewidth=1.4, label="actual")
    for at, colour, label, marker, size in _points(log):
        x, y = actual[at, first], actual[at, second]
        axes.plot(x, y, marker, color=colour, markersize=size, label=label, zorder=3)
    tidy(
        axes,
        f"{'xyz'[first]} from the start [mm]",
        f"{'xyz'[second]} from the start [mm]",
        f"Path in the {'xyz'[first]}-{'xyz'[second]} plane",
    )
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.legend(loc="best", fontsize=9, framealpha=0.9)


def _draw_in_space(axes: Any, log: Log, desired: FloatArray, actual: FloatArray) -> None:
    trace(axes, *desired.T, color=GREY, linewidth=5.0, alpha=0.35, label="desired")
    trace(axes, *actual.T, color=BLUE, linewidth=1.4, label="actual")
    for at, colour, label, marker, size in _points(log):
        axes.plot(*actual[at : at + 1].T, marker, color=colour, markersize=size, label=label)
    axes.set_xlabel("x from the start [mm]")
    axes.set_ylabel("y from the start [mm]")
    axes.set_zlabel("z from the start [mm]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("Path", fontsize=10)
    for axis in "xyz":
        axes.locator_params(axis=axis, nbins=4)
    axes.legend(loc="upper left", fontsize=9)


def _points(log: Log) -> list[tuple[int, str, str, str, float]]:
    """What is marked on the path: row, colour, label, marker and its size."""
    result = [(0, GREEN, "start", "o", 13.0), (len(log) - 1, ORANGE, "end", "s", 7.0)]
    for at in sorted({fault["at"] for fault in events.faults(log)}):
        row = min(int(np.searchsorted(log["t"], at - events.TOLD_LATER)), len(log) - 1)
        who = [fault["joint"] for fault in events.faults(log) if fault["at"] == at]
        label = f"{who[0]} fails" if len(who) == 1 else f"{len(who)} joints fail"
        result.append((row, RED, f"{label} ({at:g} s)", "X", 9.0))
    stop = events.stop_time(log)
    if stop is not None:
        row = int(np.searchsorted(log["t"], stop - events.TOLD_LATER))
        result.append((row, "black", "emergency stop", "P", 9.0))
    return result
