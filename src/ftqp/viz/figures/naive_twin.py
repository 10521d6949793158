"""An arm whose planner knows of a failure beside the uninformed baseline: what ftqp is for."""

from pathlib import Path

import numpy as np

from ftqp.sim.log.log_arrays import Log
from ftqp.viz.figures import arm_views, events
from ftqp.viz.figures.canvas import Axes, Line2D, arrange, curve, head, label_below, paper, save, trace
from ftqp.viz.figures.curves import length
from ftqp.viz.figures.palette import BLUE, GREY, MILLIMETRES, PURPLE, RED
from ftqp.viz.figures.plain_axes import plain_axes

TOLD, NEVER = BLUE, PURPLE
INSTANTS = 3
"""So often each arm is drawn, from the failure on."""


def draw_contrast(told: Log, never: Log, path: str | Path, title: str) -> Path:
    """Draw both arms, the paths of both tips and both errors to a PNG file."""
    figure = paper(16.0, 6.6, title, search=False)
    grid = figure.add_gridspec(2, 3, width_ratios=(1.0, 1.0, 1.1))
    arms = [arm_views.postures(log, _instants(log)) for log in (never, told)]
    baseline, arm = arms
    handles = [
        Line2D([], [], color=TOLD, linewidth=3.0, label="planner told at once"),
        Line2D([], [], color=NEVER, linewidth=3.0, label="same planner, never told"),
        Line2D([], [], color=GREY, linewidth=5.0, alpha=0.35, label="where the tip should go"),
    ]
    if baseline is not None and arm is not None:
        colours, targets = [TOLD, NEVER], told["target"][:, :3]
        arm_views.draw_views(figure, grid, [arm, baseline], targets=targets, colours=colours, ways=colours)
        handles += arm_views.arm_handles(arm, GREY)
    _draw_tips(figure.add_subplot(grid[:, 1]), told, never)
    errors = figure.add_subplot(grid[:, 2])
    _draw_errors(errors, told, never)
    arrange(figure, [*handles, *events.fault_handles(told)], left=0.6, gap=(0.75, 0.5))
    label_below(errors, "time [s]")
    return save(figure, path)


def _instants(log: Log) -> list[int]:
    """Rows from the first failure, or the start, to the end."""
    t = log["t"]
    begin = min([fault["at"] for fault in events.faults(log)], default=float(t[0]))
    times = np.linspace(begin, float(t[-1]), INSTANTS)
    return [min(int(np.searchsorted(t, at - events.TOLD_LATER)), len(t) - 1) for at in times]


def _draw_tips(axes: Axes, told: Log, never: Log) -> None:
    """The ways of both tips, in the plane in which they extend farthest."""
    origin = told["target"][0, :3]
    ways = [MILLIMETRES * (log["tip"][:, :3] - origin) for log in (told, never)]
    wanted = MILLIMETRES * (told["target"][:, :3] - origin)
    spread = np.ptp(np.vstack([wanted, *ways]), axis=0)
    first, second = sorted(int(i) for i in np.argsort(-spread, kind="stable")[:2])
    trace(axes, wanted[:, first], wanted[:, second], color=GREY, linewidth=7.0, alpha=0.35)
    for way, colour in zip(reversed(ways), (NEVER, TOLD), strict=True):
        trace(axes, way[:, first], way[:, second], color=colour, linewidth=2.0)
        end = way[-1, [first, second]]
        axes.plot(*end, "o", color=colour, markersize=8.0, zorder=4)
        middle = 0.5 * (wanted[:, first].min() + wanted[:, first].max())
        inward = (10, "left") if end[0] < middle else (-10, "right")
        said = "ends here" if colour == TOLD else "never told: ends here"
        axes.annotate(
            said, end, xytext=(inward[0], -3), textcoords="offset points", ha=inward[1], color=colour
        )
    for fault in events.faults(told):
        row = min(int(np.searchsorted(told["t"], fault["at"])), len(told) - 1)
        axes.plot(*ways[0][row, [first, second]], "X", color=RED, markersize=11.0, zorder=5)
    names = "xyz"[first], "xyz"[second]
    head(axes, f"Where the tips went: {names[0]} and {names[1]} from the start [mm]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    plain_axes(axes, count=(5, 7))


def _draw_errors(axes: Axes, told: Log, never: Log) -> None:
    """Both distances from the target on one axis."""
    top = 0.0
    for log, colour in ((never, NEVER), (told, TOLD)):
        error = log["position_error"]
        top = max(top, MILLIMETRES * float(error.max()))
        curve(axes, log["t"], MILLIMETRES * error, color=colour, linewidth=2.2)
    axes.set_ylim(-0.03 * top, 1.12 * top or 1.0)
    axes.set_xlim(*events.time_span(told))
    events.mark_faults(axes, told)
    stop = events.stop_time(never)
    if stop is not None:
        axes.axvline(stop, color=NEVER, linewidth=1.2, linestyle="--")
        axes.text(stop, 1.1 * top, f" never told: stops at {stop:.4g} s", color=NEVER, va="top", fontsize=9)
    largest = [length(float(log["position_error"].max())) for log in (told, never)]
    head(axes, f"Distance from the target [mm]: told {largest[0]}, never told {largest[1]}")
    plain_axes(axes, count=(5, 6))
