"""Positions and torques of every joint with their limits, and how far it is from what was sent to it."""

from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import KINDS
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.metrics import is_sensed
from ftqp.sim.log.signals import HEALTHY
from ftqp.viz.figures import events
from ftqp.viz.figures.canvas import (
    BLUE,
    FORBIDDEN,
    GREY,
    ORANGE,
    RED,
    TINT,
    Axes,
    Figure,
    Line2D,
    Patch,
    arrange,
    curve,
    few_ticks,
    head,
    paper,
    save,
    shade_beyond,
    shade_later,
    tidy,
)

COLUMNS = 4
"""Most joints side by side."""
TINY = 5e-5
"""Following errors that stay below this [rad or m] are drawn in millionths."""
GAP = (0.65, 0.4)
"""Between panels, beside and above each other [inches]."""


def draw_positions(log: Log, path: str | Path) -> Path:
    """Draw the position of every joint within its limits to a PNG file.

    Args:
        log: a loaded log.
        path: the file to write.
    """
    figure, panels = _panels(log, f"Joint positions and their limits: {events.heading(log)}")
    limits = log.metadata["limits"]
    for i, axes in enumerate(panels):
        slides = log.metadata["prismatic"][i]
        factor = 1e3 if slides else 180.0 / np.pi
        q = factor * log["q"][:, i]
        if is_sensed(log):
            curve(axes, log["t"], factor * log["q_measured"][:, i], color=ORANGE, linewidth=0.8)
            curve(axes, log["t"], factor * log["q_command"][:, i], color="black", linewidth=0.8)
        _curve(axes, log, i, q, BLUE)
        shade_beyond(axes, _scaled(limits["q_min"][i], factor), _scaled(limits["q_max"][i], factor), q)
        for fault in _degradations(log, i):
            shade_later(axes, fault["at"], *(_scaled(fault.get(end), factor) for end in ("q_min", "q_max")))
        _finish(axes, log, i, "position [mm]" if slides else "position [deg]")
    handles = [
        Line2D([], [], color=BLUE, label="working joint"),
        Line2D([], [], color=RED, linewidth=2.2, label="after it failed"),
        Patch(color=FORBIDDEN, label="beyond the limit"),
    ]
    if is_sensed(log):
        handles.insert(2, Line2D([], [], color="black", linewidth=0.8, label="sent to the arm"))
        handles.insert(3, Line2D([], [], color=ORANGE, linewidth=0.8, label="measured"))
    arrange(figure, [*handles, *events.handles(log)], left=0.95, top=0.85, gap=GAP)
    return save(figure, path)


def draw_following(log: Log, path: str | Path) -> Path:
    """Draw how far every joint is, in truth and as measured, from what was sent to it, to a PNG file.

    Args:
        log: a loaded log that keeps what was sent and what was measured.
        path: the file to write.
    """
    figure, panels = _panels(log, f"Position of every joint minus that sent to it: {events.heading(log)}")
    sent = np.vstack([log["q"][:1], log["q_command"][:-1]])
    tiny = float(np.abs(log["q"] - sent).max()) < TINY
    factor, unit = (1e6, "µ") if tiny else (1e3, "m")
    for i, axes in enumerate(panels):
        slides = log.metadata["prismatic"][i]
        true, measured = (factor * (log[name][:, i] - sent[:, i]) for name in ("q", "q_measured"))
        curve(axes, log["t"], measured, color=ORANGE, linewidth=0.8)
        _curve(axes, log, i, true, BLUE)
        axes.set_ylim(*_room(true, measured))
        _finish(axes, log, i, f"distance [{unit}m]" if slides else f"distance [{unit}rad]")
    handles: list[Any] = [
        Line2D([], [], color=BLUE, label="true position, working joint"),
        Line2D([], [], color=ORANGE, linewidth=0.8, label="measured position"),
    ]
    if (log["truth"] != HEALTHY).any():
        handles.insert(1, Line2D([], [], color=RED, linewidth=2.2, label="after it failed"))
    arrange(figure, [*handles, *events.handles(log)], left=0.95, top=0.85, gap=GAP)
    return save(figure, path)


def _room(true: FloatArray, measured: FloatArray) -> tuple[float, float]:
    """Ends of an axis that shows all of the truth and the usual part of what was measured of it."""
    seen = measured[np.isfinite(measured)]
    shown = np.concatenate([true, np.percentile(seen, [1.0, 99.0])]) if len(seen) else true
    low, high = float(shown.min()), float(shown.max())
    room = max(0.15 * (high - low), 1e-3)  # in the unit of the axis
    return low - room, high + room


def draw_torques(log: Log, path: str | Path) -> Path:
    """Draw the torque of every motor within its limits, and of every brake, to a PNG file.

    Args:
        log: a loaded log.
        path: the file to write.
    """
    figure, panels = _panels(log, f"Joint torques and their limits: {events.heading(log)}")
    brakes = np.nan_to_num(log["tau_brake"])
    for i, axes in enumerate(panels):
        tau = log["tau"][:, i]
        if brakes[:, i].any():
            carried = np.where(brakes[:, i] == 0.0, np.nan, brakes[:, i])
            curve(axes, log["t"], carried, color=GREY, linewidth=1.2)
        _curve(axes, log, i, tau, BLUE)
        limit = log.metadata["limits"]["tau_max"][i]
        shade_beyond(axes, None if limit is None else -limit, limit, np.concatenate([tau, brakes[:, i]]))
        for fault in _degradations(log, i):
            share = KINDS[fault["kind"]].shares.get("tau_max")
            left = None if limit is None or share is None else fault[share] * limit
            shade_later(axes, fault["at"], None if left is None else -left, left)
        _finish(axes, log, i, "force [N]" if log.metadata["prismatic"][i] else "torque [N m]")
    handles: list[Any] = [
        Line2D([], [], color=BLUE, label="motor torque of the command"),
        Line2D([], [], color=RED, linewidth=2.2, label="motor after the joint failed"),
    ]
    if brakes.any():
        handles.append(Line2D([], [], color=GREY, label="carried by the brake"))
    handles.append(Patch(color=FORBIDDEN, label="beyond the limit"))
    arrange(figure, [*handles, *events.handles(log)], left=0.95, top=0.85, gap=GAP)
    return save(figure, path)


def _degradations(log: Log, i: int) -> list[dict[str, Any]]:
    """The faults after which joint i still works, perhaps with less of its limits."""
    return [fault for fault in events.faults(log) if KINDS[fault["kind"]].works and fault["index"] == i]


def _scaled(limit: float | None, factor: float) -> float | None:
    return None if limit is None else factor * limit


def _panels(log: Log, title: str) -> tuple[Figure, list[Axes]]:
    """One panel a joint."""
    count = len(log.metadata["joints"])
    columns = _columns(count)
    rows = ceil(count / columns)
    figure = paper(3.3 * columns, 2.3 * rows + 1.2, title, search=False)
    grid: Any = figure.subplots(rows, columns, squeeze=False, sharex=True)
    panels = list(grid.flat)
    for unused in panels[count:]:
        unused.set_axis_off()
    for i in range(count):
        panels[i].xaxis.set_tick_params(labelbottom=i + columns >= count)
    return figure, panels[:count]


def _columns(count: int) -> int:
    """Panels side by side: at most four, and rows as full as can be."""
    return min(count, 3 if count in (3, 5, 6, 9) else COLUMNS)


def _curve(axes: Axes, log: Log, i: int, values: FloatArray, colour: str) -> None:
    """The signal of joint i, in another colour from its fault on."""
    failed = log["truth"][:, i] != HEALTHY
    curve(axes, log["t"], np.where(failed, np.nan, values), color=colour, linewidth=1.3)
    if failed.any():
        curve(axes, log["t"], np.where(failed, values, np.nan), color=RED, linewidth=2.2)
        axes.set_facecolor(TINT)


def _finish(axes: Axes, log: Log, i: int, label: str) -> None:
    """Title, labels and instants of one panel."""
    own = [fault for fault in events.faults(log) if fault["index"] == i]
    name = log.metadata["joints"][i]
    leftmost = i % _columns(len(log.metadata["joints"])) == 0
    tidy(axes, "", label if leftmost or any(log.metadata["prismatic"]) else "")
    few_ticks(axes, 4, 4)
    if own:
        last = own[-1]
        head(
            axes,
            f"{name}: {last['kind'].replace('_', '-')} from {last['at']:g} s",
            color=RED,
            fontweight="bold",
        )
    else:
        head(axes, name)
    count = len(log.metadata["joints"])
    if i + _columns(count) >= count:
        axes.set_xlabel("time [s]")
    axes.set_xlim(*events.time_span(log))
    events.mark(axes, log)
