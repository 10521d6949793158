"""A run beside rivals that lead the same arm through the same failure."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.model.chain import Skeleton
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.rival import strayed
from ftqp.viz.figures import arm_views, events
from ftqp.viz.figures.canvas import (
    BLUE,
    GREEN,
    GREY,
    MILLIMETRES,
    PURPLE,
    RED,
    Axes,
    Line2D,
    curve,
    few_ticks,
    legend_below,
    paper,
    save,
    tidy,
    trace,
)  # fmt: skip

COLOURS = (PURPLE, GREEN)
"""Of the rivals, in their order."""
INSTANTS = 3
"""So often each arm is drawn, from the failure on."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rival:
    """A controller beside that of a run, on the same arm and path, at the instants of the run.

    Its joints are q, (K, nv) [rad or m], its tip (K, 3) [m], and off its target by the error, (K,) [m].
    """

    name: str
    q: FloatArray
    tip: FloatArray
    error: FloatArray


def draw_rivals(log: Log, own: str, rivals: Sequence[Rival], path: str | Path, title: str) -> Path:
    """Draw the arms of a run and of its first rival, the paths of all tips and all errors to a PNG file."""
    figure = paper(16.0, 6.8, title)
    grid = figure.add_gridspec(2, 3, width_ratios=(1.0, 1.0, 1.15))
    first, t = rivals[0], log["t"]
    rows = _instants(log)
    skeleton = Skeleton.from_facts(log.metadata["skeleton"])
    failed = log["truth"][rows] != 0
    arms = [
        arm_views.postures_of(skeleton, t[rows], q[rows], failed=failed, way=way)
        for q, way in ((log["q"], log["tip"][:, :3]), (first.q, first.tip))
    ]
    colours = [BLUE, COLOURS[0]]
    arm_views.draw_views(figure, grid, arms, targets=log["target"][:, :3], colours=colours, ways=colours)
    curves = [(own, log["tip"][:, :3], strayed(log), BLUE)]
    curves += [(one.name, one.tip, one.error, colour) for one, colour in zip(rivals, COLOURS, strict=False)]
    _draw_tips(figure.add_subplot(grid[:, 1]), log, curves)
    _draw_errors(figure.add_subplot(grid[:, 2]), log, curves)
    handles = [
        Line2D([], [], color=colour, linewidth=3.0, label=_told(name, error, log))
        for name, _, error, colour in curves
    ]
    handles += [Line2D([], [], color=GREY, linewidth=5.0, alpha=0.35, label="where the tip should go")]
    handles += [*arm_views.arm_handles(arms[0], GREY), *events.fault_handles(log), *events.found_handles(log)]
    legend_below(figure, handles)
    return save(figure, path)


def _told(name: str, error: FloatArray, log: Log) -> str:
    """A controller with the largest error from the failure on and the last one, which the plot shows."""
    since = error[_row(log) :]
    most, last = events.length(float(since.max())), events.length(float(error[-1]))
    return f"{name}: at most {most} off, {last} at the end"


def _row(log: Log) -> int:
    """The row of the first failure, or the first."""
    at = min([fault["at"] for fault in events.faults(log)], default=float(log["t"][0]))
    return min(int(np.searchsorted(log["t"], at - events.TOLD_LATER)), len(log) - 1)


def _instants(log: Log) -> list[int]:
    """Rows from the first failure, or the start, to the end."""
    return [int(row) for row in np.linspace(_row(log), len(log) - 1, INSTANTS)]


def _draw_tips(axes: Axes, log: Log, curves: Sequence[tuple[str, FloatArray, FloatArray, str]]) -> None:
    """The ways of all tips, in the plane in which the path extends farthest."""
    wanted = MILLIMETRES * (log["target"][:, :3] - log["target"][0, :3])
    spread = np.ptp(wanted, axis=0)
    first, second = sorted(int(i) for i in np.argsort(-spread, kind="stable")[:2])
    trace(axes, wanted[:, first], wanted[:, second], color=GREY, linewidth=7.0, alpha=0.35)
    for _, tip, _, colour in reversed(curves):
        way = MILLIMETRES * (tip - log["target"][0, :3])
        trace(axes, way[:, first], way[:, second], color=colour, linewidth=2.0)
        axes.plot(*way[-1, [first, second]], "o", color=colour, markersize=7.0, zorder=4)
    at = MILLIMETRES * (log["tip"][_row(log), :3] - log["target"][0, :3])
    axes.plot(*at[[first, second]], "X", color=RED, markersize=11.0, zorder=5)
    tidy(axes, "", "", f"Where the tips went: {'xyz'[first]} and {'xyz'[second]} from the start [mm]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    few_ticks(axes, 5, 7)


def _draw_errors(axes: Axes, log: Log, curves: Sequence[tuple[str, FloatArray, FloatArray, str]]) -> None:
    """All distances from the target on one axis."""
    top = MILLIMETRES * max(float(error.max()) for _, _, error, _ in curves)
    for _, _, error, colour in reversed(curves):
        curve(axes, log["t"], MILLIMETRES * error, color=colour, linewidth=2.2)
    axes.set_ylim(-0.03 * top, 1.08 * top or 1.0)
    axes.set_xlim(*events.time_span(log))
    events.mark_faults(axes, log)
    events.mark_found(axes, log)
    tidy(axes, "time [s]", "", "Distance of the tip from its target [mm]")
