"""Errors of soft tasks, distances of kept points and clearances over time."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.signals import BODIES, PLANES, TASKS, names_in
from ftqp.viz.figures import curves, events
from ftqp.viz.figures.canvas import Axes, Line2D, curve, legend_below, paper, save, tidy
from ftqp.viz.figures.palette import DEGREES, FORBIDDEN, LIMIT, MILLIMETRES

WIDTH, PANEL = 11.0, 2.5
"""Width of the figure, and height of a panel with its title [inches]."""
ROOM = 0.08
"""Above and below the curves, as a share of what they span."""

_DISTANCES = {"m": "Distances of points from their boundaries", "rad": "Angles of axes to their cones"}
"""The titles of what is kept, by its unit."""


class Panel(NamedTuple):
    """Signals of one unit.

    Attributes:
        title: What they are.
        group: The group of signals of the log that they are of.
        names: Theirs.
        factor: From the unit of the log to that of the panel.
        unit: Of the panel.
    """

    title: str
    group: str
    names: tuple[str, ...]
    factor: float
    unit: str


def panels(log: Log) -> list[Panel]:
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


def draw(log: Log, path: str | Path) -> Path:
    """Draw a panel for each unit of the errors, and one for the distances, to a PNG file."""
    drawn = panels(log)
    title = f"Soft tasks, kept points and clearances: {events.heading(log)}"
    figure = paper(WIDTH, 1.6 + PANEL * len(drawn), title)
    grid: Any = figure.add_gridspec(len(drawn), 1)
    handles: list[Line2D] = []
    for row, panel in enumerate(drawn):
        axes = figure.add_subplot(grid[row, 0])
        handles += _draw(axes, log, panel, len(handles))
        axes.set_xlim(*events.time_span(log))
        events.mark(axes, log)
    figure.axes[-1].set_xlabel("time [s]")
    legend_below(figure, [*handles, *events.handles(log)])
    return save(figure, path)


def _draw(axes: Axes, log: Log, panel: Panel, first: int) -> list[Line2D]:
    """The curves of a panel, and what they mean; ``first`` is the number of its first curve."""
    signals = [panel.factor * log[f"{panel.group}.{name}"] for name in panel.names]
    low, high = _ends(signals)
    axes.set_ylim(low, high)
    if panel.group != TASKS:
        least = panel.factor * log.metadata.get("clearance", {}).get("keep", 0.0) * (panel.group == BODIES)
        axes.axhspan(low, least, color=FORBIDDEN, zorder=0)
        axes.axhline(least, color=LIMIT, linewidth=1.2)
    handles = []
    for k, (name, signal) in enumerate(zip(panel.names, signals, strict=True), first):
        colour, style = curves.look(k)
        curve(axes, log["t"], signal, color=colour, linestyle=style, linewidth=1.5)
        handles.append(curves.handle(k, name))
    tidy(axes, "", "", f"{panel.title} [{panel.unit}]: {_extreme(panel, signals)}")
    return handles


def _ends(signals: list[FloatArray]) -> tuple[float, float]:
    """The range of a panel, which has 0 in it."""
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
