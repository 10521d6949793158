"""Errors over time: the tip's with the arm and its path, soft tasks and what is kept, a moving base."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ftqp.control.moving_base.inertial_task import BaseStatus
from ftqp.core.checks import FloatArray
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.signals import BODIES, PLANES, TASKS, names_in
from ftqp.viz.figures import arm_views, events
from ftqp.viz.figures.canvas import (
    BLUE,
    DEGREES,
    FORBIDDEN,
    GREEN,
    GREY,
    LIMIT,
    MILLIMETRES,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    YELLOW,
    Axes,
    Figure,
    Line2D,
    Patch,
    curve,
    decades,
    equal_runs,
    few_ticks,
    legend_below,
    paper,
    save,
    tidy,
    trace,
)  # fmt: skip

FLAT_PATH = 0.1
"""A path is drawn in its plane when it is thinner than this share of its size."""
SMALLEST_ERROR = 1e-9
"""Errors below this are drawn at it: a logarithmic axis has no zero [mm or deg]."""
SMALLEST_SHOWN = 1e-6
"""The axis begins at this, or above [mm or deg]: less is of no concern to anybody."""
HAIR = 0.1
"""A length that everybody knows [mm]."""


def draw_path(log: Log, path: str | Path) -> Path:
    """Draw the arm, its path and the error to a PNG file."""
    arm = arm_views.postures(log, arm_views.instants(log))
    title = f"The arm and the path of its end effector: {events.heading(log)}"
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
    said = f"{largest:.3g} deg" if turned else events.length(largest / MILLIMETRES)
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
        fontsize=8, color=colour, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
    )  # fmt: skip


def _draw_path(figure: Figure, place: Any, log: Log) -> Axes:
    """In the plane of what was asked and done where that is flat, else in space [mm]."""
    origin = log["target"][0, :3]
    desired = MILLIMETRES * (log["target"][:, :3] - origin)
    actual = MILLIMETRES * (log["tip"][:, :3] - origin)
    spread = np.ptp(np.vstack([desired, actual]), axis=0)
    order = np.argsort(-spread, kind="stable")
    flat = bool(spread[order[2]] <= FLAT_PATH * spread[order[0]])
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
        row = min(int(np.searchsorted(log["t"], at - events.REPORTED_LATER)), len(log) - 1)
        who = [fault["joint"] for fault in events.faults(log) if fault["at"] == at]
        label = f"{who[0]} fails" if len(who) == 1 else f"{len(who)} joints fail"
        result.append((row, RED, f"{label} ({at:g} s)", "X", 9.0))
    stop = events.stop_time(log)
    if stop is not None:
        row = int(np.searchsorted(log["t"], stop - events.REPORTED_LATER))
        result.append((row, "black", "emergency stop", "P", 9.0))
    return result


WIDTH, PANEL = 11.0, 2.5
"""Width of the figure, and height of a panel with its title [inches]."""
ROOM = 0.08
"""Above and below the curves, as a share of what they span."""

_DISTANCES = {"m": "Distances of points from their boundaries", "rad": "Angles of axes to their cones"}
"""The titles of what is kept, by its unit."""


class Panel(NamedTuple):
    """Signals of one group of the log and one unit; the factor leads from the log's unit to the panel's."""

    title: str
    group: str
    names: tuple[str, ...]
    factor: float
    unit: str


def further_panels(log: Log) -> list[Panel]:
    """What a figure of a log would have; nothing without soft tasks and kept points."""
    by_unit: dict[str, list[str]] = {}
    for name in names_in(log, log.metadata, TASKS):
        by_unit.setdefault(log.units[f"{TASKS}.{name}"], []).append(name)
    shown = {"m": (MILLIMETRES, "mm"), "rad": (DEGREES, "deg")}
    found = [
        Panel("Errors of soft tasks", TASKS, tuple(names), *shown.get(unit, (1.0, unit)))
        for unit, names in by_unit.items()
    ]
    for unit, title in _DISTANCES.items():
        kept = names_in(log, log.metadata, PLANES)
        kept = [name for name in kept if log.units[f"{PLANES}.{name}"] == unit]
        if kept:
            found.append(Panel(title, PLANES, tuple(kept), *shown[unit]))
    if near := names_in(log, log.metadata, BODIES):
        found.append(Panel("Clearances", BODIES, tuple(near), *shown["m"]))
    return found


def draw_further(log: Log, path: str | Path) -> Path:
    """Draw a panel for each unit of the errors, and one for the distances, to a PNG file."""
    drawn = further_panels(log)
    title = f"Soft tasks, kept points and clearances: {events.heading(log)}"
    figure = paper(WIDTH, 1.6 + PANEL * len(drawn), title)
    grid: Any = figure.add_gridspec(len(drawn), 1)
    handles: list[Line2D] = []
    for row, panel in enumerate(drawn):
        axes = figure.add_subplot(grid[row, 0])
        handles += _draw_panel(axes, log, panel, len(handles))
        axes.set_xlim(*events.time_span(log))
        events.mark(axes, log)
    figure.axes[-1].set_xlabel("time [s]")
    legend_below(figure, [*handles, *events.handles(log)])
    return save(figure, path)


def _draw_panel(axes: Axes, log: Log, panel: Panel, first: int) -> list[Line2D]:
    """The curves of a panel, and what they mean; ``first`` is the number of its first curve."""
    signals = [panel.factor * log[f"{panel.group}.{name}"] for name in panel.names]
    low, high = _span_of(signals)
    axes.set_ylim(low, high)
    if panel.group != TASKS:
        least = panel.factor * log.metadata.get("clearance", {}).get("keep", 0.0) * (panel.group == BODIES)
        axes.axhspan(low, least, color=FORBIDDEN, zorder=0)
        axes.axhline(least, color=LIMIT, linewidth=1.2)
    handles = []
    for k, (name, signal) in enumerate(zip(panel.names, signals, strict=True), first):
        colour, style = events.look(k)
        curve(axes, log["t"], signal, color=colour, linestyle=style, linewidth=1.5)
        handles.append(events.handle(k, name))
    tidy(axes, "", "", f"{panel.title} [{panel.unit}]: {_extreme(panel, signals)}")
    return handles


def _span_of(signals: list[FloatArray]) -> tuple[float, float]:
    """A range with 0 in it, also for panels that are to compare."""
    values = np.concatenate([signal[np.isfinite(signal)] for signal in signals])
    low, high = min(0.0, float(values.min(initial=0.0))), max(0.0, float(values.max(initial=0.0)))
    room = ROOM * (high - low) or 1.0
    return low - room, high + room


def _extreme(panel: Panel, signals: list[FloatArray]) -> str:
    """The largest error, or the smallest distance, and whose it is."""
    planes = panel.group != TASKS
    found = [
        float(np.nanmin(signal) if planes else np.nanmax(signal)) if np.isfinite(signal).any() else np.nan
        for signal in signals
    ]
    if np.isnan(found).all():
        return "none is known"
    at = int(np.nanargmin(found) if planes else np.nanargmax(found))
    return f"{'smallest' if planes else 'largest'} {found[at]:.3g} {panel.unit} ({panel.names[at]})"


LINES = (ORANGE, GREEN, PURPLE, SKY, BLUE, RED)
SHADES = {
    BaseStatus.SATURATED: YELLOW,
    BaseStatus.RANK_DEFICIENT: "#DDDDDD",
    BaseStatus.UNREACHABLE: "#F2C5B4",
    BaseStatus.STALE: "#C9C9F5",
    BaseStatus.HALTED: "#F5A9A9",
}
"""Background while the inertial task is in another status than TRACKING."""
UNITS = (("mm", 1e3), ("\N{MICRO SIGN}m", 1e6))


def draw_base(log: Log, path: str | Path) -> Path:
    """Draw position and rotation errors per axis over the coordinates of the base to a PNG file."""
    t, error, moved = log["t"], log["inertial_error"], log["disturbance"]
    names = [name.split(".", 1)[1] for name in log.names if name.startswith("disturbance.")]
    slides = [log.units[f"disturbance.{name}"] == "m" for name in names]
    columns = (error[:, :3], DEGREES * error[:, 3:])
    unit, factor = _length_unit(columns[0])
    figure = paper(11.0, 9.0, f"End effector held in inertial space: {events.heading(log)}")
    grid: Any = figure.subplots(4, 2, sharex=True)
    for side, (values, scale, axis_unit) in enumerate(((columns[0], factor, unit), (columns[1], 1.0, "deg"))):
        ends = _span_of([scale * values])
        for k in range(3):
            axes: Axes = grid[k, side]
            signal = scale * values[:, k]
            for status, shade in SHADES.items():
                for begin, end in _spans(log, status):
                    axes.axvspan(begin, end, color=shade, alpha=0.45, linewidth=0.0, zorder=0)
            axes.axhline(0.0, color="black", linewidth=0.6)
            curve(axes, t, signal, color=BLUE, linewidth=1.3)
            what = f"{'XYZ'[k]} error" if side == 0 else f"rotation error about {'XYZ'[k]}"
            extremes = f"{signal.min():+.3g} to {signal.max():+.3g}"
            tidy(axes, "", f"[{axis_unit}]", f"{what}: {extremes} {axis_unit}")
            axes.set_ylim(*ends)
            events.mark(axes, log)
    for side, sliding in enumerate((True, False)):
        axes = grid[3, side]
        chosen = [k for k in range(len(names)) if slides[k] == sliding and moved[:, k].any()]
        place_unit, place = _length_unit(moved[:, chosen]) if sliding else ("deg", DEGREES)
        for k in chosen:
            curve(axes, t, place * moved[:, k], color=LINES[k % len(LINES)], linewidth=1.3, label=names[k])
        if chosen:
            axes.legend(loc="best", fontsize=8, ncols=3, framealpha=0.9)
        else:
            axes.set_yticks([])
            axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center", color=GREY)
        title = "disturbance: base " + ("position" if sliding else "rotation")
        tidy(axes, "time [s]", f"[{place_unit}]" if chosen else "", title)
        axes.set_xlim(*events.time_span(log))
        events.mark(axes, log)
    legend_below(figure, [*_shades_used(log), *events.handles(log)])
    return save(figure, path)


def _length_unit(values: FloatArray) -> tuple[str, float]:
    """The unit of length in which the largest value has at least one digit before the point."""
    largest = float(np.abs(values).max()) if values.size else 0.0
    return next(((unit, factor) for unit, factor in UNITS if factor * largest >= 1.0), UNITS[-1])


def _spans(log: Log, status: BaseStatus) -> list[tuple[float, float]]:
    """When the inertial task had this status [s]."""
    code = list(BaseStatus).index(status)
    edges = np.append(log["t"], log["t"][-1] + float(log.metadata.get("dt", 0.0)))
    spells = equal_runs(log["base_status"])
    return [(float(edges[first]), float(edges[last])) for first, last, which in spells if which == code]


def _shades_used(log: Log) -> list[Patch | Line2D]:
    return [
        Patch(color=colour, alpha=0.45, label=status.name.lower().replace("_", " "))
        for status, colour in SHADES.items()
        if _spans(log, status)
    ]
