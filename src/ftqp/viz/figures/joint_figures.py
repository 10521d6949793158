"""Positions, velocities, torques, distances from what was sent: a panel a joint, a bar for its limits."""

from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import Locked, kind_of
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.metrics import is_sensed
from ftqp.sim.log.signals import HEALTHY
from ftqp.viz.figures import events
from ftqp.viz.figures.canvas import (
    BLUE,
    FORBIDDEN,
    GREY,
    LIMIT,
    MILLIMETRES,
    ORANGE,
    RED,
    TINT,
    WINE,
    Axes,
    Figure,
    Line2D,
    Patch,
    curve,
    few_ticks,
    legend_below,
    paper,
    save,
    tidy,
)  # fmt: skip

TINY = 5e-5
"""Following errors that stay below this [rad or m] are drawn in millionths."""
MOTOR_OF_FAILED = "motor of a failed joint"
COLUMNS = 4
"""Most joints side by side."""
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
Ends = tuple[float | None, float | None]
"""Lower and upper limit; None is none."""
Later = tuple[float, float | None, float | None]
"""An instant with the limits that hold from then on."""


def draw_positions(log: Log, path: str | Path) -> Path:
    """Draw the position of every joint to a PNG file, scaled to its motion, with the limits."""
    figure, grid = panels(log, f"Joint positions: {events.heading(log)}")
    limits = log.metadata["limits"]
    for i, axes in enumerate(grid):
        factor, unit = _unit(log, i, "")
        q = factor * log["q"][:, i]
        shown = [q]
        if is_sensed(log):
            shown.append(factor * log["q_command"][:, i])
            curve(axes, log["t"], factor * log["q_measured"][:, i], color=ORANGE, linewidth=0.8)
            curve(axes, log["t"], shown[1], color="black", linewidth=0.8)
        draw_values(axes, log, i, q)
        later = [
            (fault["at"], _scaled(fault.get("q_min"), factor), _scaled(fault.get("q_max"), factor))
            for fault in degradations(log, i)
        ]
        ends = (_scaled(limits["q_min"][i], factor), _scaled(limits["q_max"][i], factor))
        finish_panel(axes, log, i, shown, limits=ends, later=later, unit=unit)
    handles = _handles(log, "working joint", "after it failed", "its range", "q_max")
    if is_sensed(log):
        handles.insert(1, Line2D([], [], color="black", linewidth=0.8, label="sent to the arm"))
        handles.insert(2, Line2D([], [], color=ORANGE, linewidth=0.8, label="measured"))
    return finish_figure(figure, log, path, _label(log, "position", ""), handles)


def draw_velocities(log: Log, path: str | Path) -> Path:
    """Draw the velocity of every joint to a PNG file, scaled to its motion, with the limits."""
    figure, grid = panels(log, f"Joint velocities: {events.heading(log)}")
    for i, axes in enumerate(grid):
        factor, unit = _unit(log, i, "/s")
        v = factor * log["v"][:, i]
        draw_values(axes, log, i, v)
        limit = _scaled(log.metadata["limits"]["v_max"][i], factor)
        finish_panel(
            axes, log, i, [v], limits=_either_way(limit), later=_left(log, i, "v_max", limit), zero=True,
            unit=unit,
        )  # fmt: skip
    handles = _handles(log, "working joint", "after it failed", "its speed limit", "v_max")
    return finish_figure(figure, log, path, _label(log, "velocity", "/s"), handles)


def draw_torques(log: Log, path: str | Path) -> Path:
    """Draw the torque of every motor with its limits, and of every brake, to a PNG file."""
    figure, grid = panels(log, f"Joint torques: {events.heading(log)}")
    braked = log["belief"] == Locked.number
    failed = log["truth"] != HEALTHY
    for i, axes in enumerate(grid):
        slides = log.metadata["prismatic"][i]
        unit = "N" if slides else "N m"
        idle = braked[:, i] & failed[:, i]
        tau = np.where(idle, np.nan, log["tau"][:, i])
        carried = np.where(idle, log["tau_brake"][:, i], np.nan)
        draw_values(axes, log, i, tau)
        remark = ""
        if np.isfinite(carried).any():
            curve(axes, log["t"], carried, color=WINE, linewidth=2.2, zorder=3)
            remark = f"brake carries {np.nanmax(np.abs(carried)):.3g} {unit}"
        limit = log.metadata["limits"]["tau_max"][i]
        finish_panel(
            axes, log, i, [tau, carried], limits=_either_way(limit), later=_left(log, i, "tau_max", limit),
            zero=True, unit=unit if any(log.metadata["prismatic"]) else "", remark=remark,
        )  # fmt: skip
    handles = _handles(log, "motor torque of the command", MOTOR_OF_FAILED, "the motor's limit", "tau_max")
    if (braked & failed).any():
        carried_by = "carried by the brake of a locked joint, by the arm's model"
        handles.insert(1, Line2D([], [], color=WINE, linewidth=2.2, label=carried_by))
    if not (failed & ~braked).any():
        handles = [handle for handle in handles if handle.get_label() != MOTOR_OF_FAILED]
    slides = any(log.metadata["prismatic"])
    return finish_figure(figure, log, path, "torque or force" if slides else "torque [N m]", handles)


def draw_following(log: Log, path: str | Path) -> Path:
    """Draw how far every joint is, in truth and as measured, from what was sent to it, to a PNG file."""
    figure, grid = panels(log, f"Position of every joint minus that sent to it: {events.heading(log)}")
    sent = np.vstack([log["q"][:1], log["q_command"][:-1]])
    tiny = float(np.abs(log["q"] - sent).max()) < TINY
    factor, prefix = (1e6, "µ") if tiny else (1e3, "m")
    mixed = any(log.metadata["prismatic"])
    for i, axes in enumerate(grid):
        unit = f"{prefix}m" if log.metadata["prismatic"][i] else f"{prefix}rad"
        true, measured = (factor * (log[name][:, i] - sent[:, i]) for name in ("q", "q_measured"))
        curve(axes, log["t"], measured, color=ORANGE, linewidth=0.8)
        draw_values(axes, log, i, true)
        finish_panel(axes, log, i, [true, _usual(measured)], limits=(None, None), unit=unit if mixed else "")
    handles: list[Any] = [
        Line2D([], [], color=BLUE, label="true position, working joint"),
        Line2D([], [], color=ORANGE, linewidth=0.8, label="measured position"),
    ]
    if (log["truth"] != HEALTHY).any():
        handles.insert(1, Line2D([], [], color=RED, linewidth=2.2, label="after it failed"))
    label = "distance" if mixed else f"distance [{prefix}rad]"
    return finish_figure(figure, log, path, label, handles)


def _usual(measured: FloatArray) -> FloatArray:
    """Ends of the usual part of what was measured: a rare glitch does not squeeze the rest."""
    seen = measured[np.isfinite(measured)]
    return np.percentile(seen, [1.0, 99.0]) if len(seen) else seen


def _handles(log: Log, working: str, failed: str, share: str, limit: str) -> list[Line2D | Patch]:
    """What the curves mean and, where a joint has such a limit, the shades and the bars."""
    lines: list[Line2D | Patch] = [Line2D([], [], color=BLUE, label=working)]
    if (log["truth"] != HEALTHY).any():
        lines.append(Line2D([], [], color=RED, linewidth=2.2, label=failed))
    if all(end is None for end in log.metadata["limits"][limit]):
        return lines
    return [*lines, Patch(color=FORBIDDEN, label="beyond the limit"), bar_handle(share)]


def _unit(log: Log, i: int, rate: str) -> tuple[float, str]:
    """Factor of joint i, and its unit where joints differ in it."""
    slides = log.metadata["prismatic"][i]
    mixed = any(log.metadata["prismatic"])
    return (MILLIMETRES, f"mm{rate}") if slides else (1.0, f"rad{rate}" if mixed else "")


def _label(log: Log, what: str, rate: str) -> str:
    return what if any(log.metadata["prismatic"]) else f"{what} [rad{rate}]"


def _either_way(limit: float | None) -> Ends:
    return (None, None) if limit is None else (-limit, limit)


def _left(log: Log, i: int, name: str, limit: float | None) -> list[Later]:
    """What degradations leave of a limit that holds either way, and since when."""
    found = []
    for fault in degradations(log, i):
        share = kind_of(fault["kind"]).shares.get(name)
        if share is not None and limit is not None:
            found.append((fault["at"], *_either_way(fault[share] * limit)))
    return found


def _scaled(limit: float | None, factor: float) -> float | None:
    return None if limit is None else factor * limit


def panels(log: Log, title: str) -> tuple[Figure, list[Axes]]:
    """An empty figure with a panel for each joint."""
    count = len(log.metadata["joints"])
    columns = _columns(count)
    rows = ceil(count / columns)
    figure = paper(3.4 * columns, 2.05 * rows + 1.5, title)
    grid: Any = figure.add_gridspec(rows, columns)
    return figure, [figure.add_subplot(grid[i // columns, i % columns]) for i in range(count)]


def _columns(count: int) -> int:
    """Panels side by side: at most four, and rows as full as can be."""
    return min(count, 3 if count in (3, 5, 6, 9) else COLUMNS)


def draw_values(axes: Axes, log: Log, i: int, values: FloatArray) -> None:
    """The signal of joint i, in red from its failure on."""
    failed = log["truth"][:, i] != HEALTHY
    curve(axes, log["t"], np.where(failed, np.nan, values), color=BLUE, linewidth=1.4, zorder=3)
    if failed.any():
        curve(axes, log["t"], np.where(failed, values, np.nan), color=RED, linewidth=2.2, zorder=3)
        axes.set_facecolor(TINT)


def finish_panel(
    axes: Axes, log: Log, i: int, values: Sequence[FloatArray], *, limits: Ends, later: Sequence[Later] = (),
    zero: bool = False, unit: str = "", remark: str = "",
) -> None:  # fmt: skip
    """Choose what a panel shows, and draw its limits, the bar beside it, title and instants.

    ``values`` is what is drawn, (K,) each, NaN is a gap; ``later`` are narrower limits that hold from an
    instant on. ``zero`` says whether zero is to be seen, ``unit`` stands in the title where joints differ in
    it, and ``remark`` in that of a joint that failed, in place of when.
    """
    finite = np.concatenate([signal[np.isfinite(signal)] for signal in values] or [np.zeros(0)])
    least, largest = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    axes.set_ylim(*_shown(least, largest, limits, later, zero=zero))
    axes.set_xlim(*events.time_span(log))
    _shade(axes, limits, later)
    _bar(axes, least, largest, limits, failed=bool((log["truth"][:, i] != HEALTHY).any()))
    events.mark(axes, log)
    count = len(log.metadata["joints"])
    tidy(axes, "", "")
    few_ticks(axes, 4, 4)
    axes.tick_params(labelbottom=i + _columns(count) >= count)
    own = [fault for fault in events.faults(log) if fault["index"] == i]
    name = log.metadata["joints"][i] + (f" [{unit}]" if unit else "")
    if own:
        said = remark or f"{own[-1]['kind'].replace('_', '-')} from {own[-1]['at']:g} s"
        axes.set_title(f"{name}: {said}", color=RED, fontweight="bold", fontsize=10, loc="left")
    else:
        axes.set_title(name, fontsize=10, loc="left")


def _shown(
    least: float, largest: float, limits: Ends, later: Sequence[Later], *, zero: bool
) -> tuple[float, float]:
    """The range of a panel: the motion, with the limits that are near."""
    low, high = (min(least, 0.0), max(largest, 0.0)) if zero else (least, largest)
    first, last = limits
    whole = last - first if first is not None and last is not None else 0.0
    smallest = LEAST * whole or 1e-6
    if high - low < smallest:
        low, high = 0.5 * (low + high - smallest), 0.5 * (low + high + smallest)
    near = NEAR * (high - low)
    lower, upper = [first, *(end for _, end, _ in later)], [last, *(end for _, _, end in later)]
    low = min([low, *(x for x in lower if x is not None and abs(x - low) < near)])
    high = max([high, *(x for x in upper if x is not None and abs(x - high) < near)])
    margin = ROOM * (high - low)
    return low - margin, high + margin


def _shade(axes: Axes, limits: Ends, later: Sequence[Later]) -> None:
    """What lies beyond the limits, as far as it is in view."""
    bottom, top = axes.get_ylim()
    start, end = axes.get_xlim()
    for since, low, high in [(start, *limits), *later]:
        for limit, outer in ((low, bottom), (high, top)):
            if limit is not None and bottom < limit < top:
                axes.fill_between([since, end], limit, outer, color=FORBIDDEN, linewidth=0.0, zorder=0)
                axes.plot([since, end], [limit, limit], color=LIMIT, linewidth=1.2)


def _bar(axes: Axes, least: float, largest: float, limits: Ends, *, failed: bool) -> None:
    """The whole of the limits, and how much of it is used; nothing without limits."""
    low, high = limits
    if low is None or high is None or not high > low:
        return
    ends = [float(np.clip((x - low) / (high - low), 0.0, 1.0)) for x in (least, largest)]
    middle = 0.5 * sum(ends)
    used = min(ends[0], middle - 0.01), max(ends[1], middle + 0.01)
    for (start, end), colour in (((0.0, 1.0), "#DDDDDD"), (used, RED if failed else BLUE)):
        axes.plot(
            [BAR, BAR], [start, end], color=colour, linewidth=BAR_WIDTH, solid_capstyle="butt",
            transform=axes.transAxes, clip_on=False,
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
    label = f"bar: share of {what} in use"
    return Patch(facecolor=BLUE, edgecolor="#DDDDDD", linewidth=2.0, label=label)


def finish_figure(
    figure: Figure, log: Log, path: str | Path, label: str, handles: Sequence[Line2D | Patch]
) -> Path:
    """Legend, names of the axes, and the file."""
    legend_below(figure, [*handles, *events.handles(log)])
    figure.supylabel(label, fontsize=10)
    figure.axes[-1].set_xlabel("time [s]")
    return save(figure, path)
