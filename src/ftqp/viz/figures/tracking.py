"""The arm at a few instants, the path of its tip, desired and actual, and the error over time."""

from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.sim.log.log_arrays import Log
from ftqp.viz.figures import arm_views, events
from ftqp.viz.figures.canvas import (
    Axes,
    Figure,
    curve,
    decades,
    few_ticks,
    legend_below,
    paper,
    save,
    tidy,
    trace,
)
from ftqp.viz.figures.curves import length
from ftqp.viz.figures.palette import BLUE, DEGREES, GREEN, GREY, MILLIMETRES, ORANGE, RED

FLAT = 0.1
"""A path is drawn in its plane when it is thinner than this share of its size."""
SMALLEST_ERROR = 1e-9
"""Errors below this are drawn at it: a logarithmic axis has no zero [mm or deg]."""
SMALLEST_SHOWN = 1e-6
"""The axis begins at this, or above [mm or deg]: less is of no concern to anybody."""
HAIR = 0.1
"""A length that everybody knows [mm]."""


def draw(log: Log, path: str | Path) -> Path:
    """Draw the arm, its path and the error to a PNG file.

    The arm is left out where the log does not say where its joints sit.
    """
    arm = arm_views.postures(log, arm_views.instants(log))
    title = f"The arm and the path of its tip: {events.heading(log)}"
    figure = paper(12.0 if arm is None else 16.0, 6.4, title)
    ratios = (1.0, 1.1) if arm is None else (1.0, 1.0, 1.1)
    grid = figure.add_gridspec(2, len(ratios), width_ratios=ratios)
    first = 0 if arm is None else 1
    way = _draw_path(figure, grid[:, first], log)
    turns = bool((log["rotation_error"] > 0.0).any())
    position = figure.add_subplot(grid[0, -1] if turns else grid[:, -1])
    emergency = log.metadata.get("emergency") or {}
    _draw_error(position, log, "position_error", emergency.get("position"))
    if turns:
        rotation = figure.add_subplot(grid[1, -1])
        _draw_error(rotation, log, "rotation_error", emergency.get("rotation"))
    handles: list[Any] = [*way.get_legend_handles_labels()[0], *events.handles(log)]
    figure.axes[-1].set_xlabel("time [s]")
    if arm is not None:
        arm_views.draw_views(figure, grid, [arm], targets=log["target"][:, :3])
        handles = [*arm_views.arm_handles(arm), *handles]
    legend_below(figure, handles)
    return save(figure, path)


def _draw_error(axes: Axes, log: Log, signal: str, threshold: float | None) -> None:
    """The distance from the target in millimetres, or the angle to it in degrees."""
    turned = signal == "rotation_error"
    factor, unit = (DEGREES, "deg") if turned else (MILLIMETRES, "mm")
    error = factor * log[signal]
    worst = int(np.argmax(error))
    at, largest = float(log["t"][worst]), float(error[worst])
    decades(axes)
    curve(axes, log["t"], np.maximum(error, SMALLEST_ERROR), color=BLUE, linewidth=1.4)
    axes.plot(at, max(largest, SMALLEST_ERROR), "o", color=BLUE, markersize=5)
    said = f"{largest:.3g} deg" if turned else length(largest / MILLIMETRES)
    what = "Angle to" if turned else "Distance from"
    title = f"{what} the target [{unit}]: largest {said}, at {at:.4g} s"
    tidy(axes, "", "", title)
    usual = max(float(np.percentile(error, 1.0)), SMALLEST_SHOWN)
    top = max(largest, factor * (threshold or 0.0), SMALLEST_SHOWN)
    axes.set_ylim(0.3 * usual, 5.0 * top)
    axes.set_xlim(*events.time_span(log))
    if threshold is not None:
        _level(axes, factor * threshold, "emergency stop above this, if rising", RED)
    if not turned:
        _level(axes, HAIR, "0.1 mm, as thick as a hair", GREY)
    events.mark(axes, log)
    few_ticks(axes)


def _level(axes: Axes, value: float, said: str, colour: str) -> None:
    """A horizontal line with words on it, where it is in view."""
    low, high = axes.get_ylim()
    if not low < value < high:
        return
    axes.axhline(value, color=colour, linewidth=0.9, linestyle="--")
    axes.annotate(
        said, (0.01, value), xytext=(0, 3), xycoords=("axes fraction", "data"), textcoords="offset points",
        fontsize=8, color=colour, bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5},
    )  # fmt: skip


def _draw_path(figure: Figure, place: Any, log: Log) -> Axes:
    """In the plane of what was asked and done where that is flat, else in space [mm]."""
    origin = log["target"][0, :3]
    desired = MILLIMETRES * (log["target"][:, :3] - origin)
    actual = MILLIMETRES * (log["tip"][:, :3] - origin)
    spread = np.ptp(np.vstack([desired, actual]), axis=0)
    order = np.argsort(-spread, kind="stable")
    flat = bool(spread[order[2]] <= FLAT * spread[order[0]])
    axes = figure.add_subplot(place, projection=None if flat else "3d")
    if flat:
        _draw_flat(axes, log, desired, actual, sorted(int(i) for i in order[:2]))
    else:
        _draw_in_space(axes, log, desired, actual)
    return axes


def _draw_flat(axes: Axes, log: Log, desired: FloatArray, actual: FloatArray, plane: list[int]) -> None:
    first, second = plane
    wide = {"color": GREY, "linewidth": 5.0, "alpha": 0.35, "label": "desired"}
    trace(axes, desired[:, first], desired[:, second], **wide)
    trace(axes, actual[:, first], actual[:, second], color=BLUE, linewidth=1.4, label="actual")
    for at, colour, label, marker, size in _points(log):
        x, y = actual[at, first], actual[at, second]
        axes.plot(x, y, marker, color=colour, markersize=size, label=label, zorder=3)
    names = "xyz"[first], "xyz"[second]
    title = f"Path in the {names[0]}-{names[1]} plane: {names[0]} and {names[1]} from the start [mm]"
    tidy(axes, "", "", title)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    few_ticks(axes, 5, 7)


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
