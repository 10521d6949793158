"""The error of the tip along every inertial axis, with the disturbance of the base below it."""

from pathlib import Path
from typing import Any

import numpy as np

from ftqp.control.moving_base.inertial_task import BaseStatus
from ftqp.core.checks import FloatArray
from ftqp.sim.log.log_arrays import Log
from ftqp.viz.figures import events
from ftqp.viz.figures.canvas import Axes, Line2D, Patch, curve, equal_runs, legend_below, paper, save, tidy
from ftqp.viz.figures.palette import BLUE, DEGREES, GREEN, GREY, ORANGE, PURPLE, RED, SKY, YELLOW

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


def draw(log: Log, path: str | Path) -> Path:
    """Draw position and rotation errors per axis over the coordinates of the base to a PNG file."""
    t, error, moved = log["t"], log["inertial_error"], log["disturbance"]
    names = [name.split(".", 1)[1] for name in log.names if name.startswith("disturbance.")]
    slides = [log.units[f"disturbance.{name}"] == "m" for name in names]
    columns = (error[:, :3], DEGREES * error[:, 3:])
    unit, factor = _unit(columns[0])
    figure = paper(11.0, 9.0, f"Tip held in inertial space: {events.heading(log)}")
    grid: Any = figure.subplots(4, 2, sharex=True)
    for side, (values, scale, axis_unit) in enumerate(((columns[0], factor, unit), (columns[1], 1.0, "deg"))):
        ends = _ends(scale * values)
        for k in range(3):
            axes: Axes = grid[k, side]
            signal = scale * values[:, k]
            _shade(axes, log)
            axes.axhline(0.0, color="black", linewidth=0.6)
            curve(axes, t, signal, color=BLUE, linewidth=1.3)
            what = f"{'XYZ'[k]} error" if side == 0 else f"rotation error about {'XYZ'[k]}"
            tidy(axes, "", f"[{axis_unit}]", f"{what}: {_extremes(signal)} {axis_unit}")
            axes.set_ylim(*ends)
            events.mark(axes, log)
    for side, sliding in enumerate((True, False)):
        axes = grid[3, side]
        chosen = [k for k in range(len(names)) if slides[k] == sliding and moved[:, k].any()]
        place_unit, place = _unit(moved[:, chosen]) if sliding else ("deg", DEGREES)
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


def _unit(values: FloatArray) -> tuple[str, float]:
    """The unit of length in which the largest value has at least one digit before the point."""
    largest = float(np.abs(values).max()) if values.size else 0.0
    return next(((unit, factor) for unit, factor in UNITS if factor * largest >= 1.0), UNITS[-1])


def _ends(values: FloatArray) -> tuple[float, float]:
    """One range for the three axes, so that they compare."""
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    margin = 0.08 * (high - low) or 1.0
    return low - margin, high + margin


def _extremes(signal: FloatArray) -> str:
    return f"{signal.min():+.3g} to {signal.max():+.3g}"


def _spans(log: Log, status: BaseStatus) -> list[tuple[float, float]]:
    """When the inertial task had this status [s]."""
    code = list(BaseStatus).index(status)
    edges = np.append(log["t"], log["t"][-1] + float(log.metadata.get("dt", 0.0)))
    spells = equal_runs(log["base_status"])
    return [(float(edges[first]), float(edges[last])) for first, last, which in spells if which == code]


def _shade(axes: Axes, log: Log) -> None:
    for status, colour in SHADES.items():
        for begin, end in _spans(log, status):
            axes.axvspan(begin, end, color=colour, alpha=0.45, linewidth=0.0, zorder=0)


def _shades_used(log: Log) -> list[Patch | Line2D]:
    return [
        Patch(color=colour, alpha=0.45, label=status.name.lower().replace("_", " "))
        for status, colour in SHADES.items()
        if _spans(log, status)
    ]
