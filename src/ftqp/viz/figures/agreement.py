"""How well runs of one scenario agree: difference to a reference, task error, step times."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, unknown
from ftqp.sim.log.log_arrays import Log
from ftqp.viz.figures import events
from ftqp.viz.figures.canvas import Axes, curve, decades, legend_below, paper, save, tidy
from ftqp.viz.figures.curves import draw_runs, logarithmic, longest, look, run_handles
from ftqp.viz.figures.palette import GREY, MILLIMETRES
from ftqp.viz.figures.tracking import SMALLEST_ERROR

LEAST = 1e-16
"""Differences below this are drawn at it: a logarithmic axis has no zero [rad or m]."""


def joint_difference(log: Log, reference: Log) -> FloatArray:
    """The largest difference of a joint's position to the reference at each tick that both have, (K,)."""
    if any(log.metadata[name] != reference.metadata[name] for name in ("joints", "dt")):
        raise InputError(
            f"logs {log.path} and {reference.path} have different joints or sampling periods, "
            "expected runs of the same scenario"
        )
    count = min(len(log), len(reference))
    largest: FloatArray = np.abs(log["q"][:count] - reference["q"][:count]).max(axis=1)
    return largest


def draw_agreement(
    logs: Mapping[str, Log], path: str | Path, *, reference: str, title: str, tolerance: float | None = None
) -> Path:
    """Draw task error, joint difference and step times of several runs to a PNG file.

    The others are compared to the run called ``reference``, by the largest difference of a joint; one up to
    ``tolerance`` [rad or m] counts as agreement and is drawn as a line, None is no line.
    """
    if reference not in logs:
        raise unknown("run", reference, "the figure", logs)
    figure = paper(13.0, 7.6, title)
    grid: Any = figure.add_gridspec(2, 2, width_ratios=(1.7, 1.0))
    error, difference = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[1, 0])
    errors = [np.maximum(MILLIMETRES * log["position_error"], SMALLEST_ERROR) for log in logs.values()]
    draw_runs(error, logs, errors)
    logarithmic(error, errors)
    tidy(error, "", "position error [mm]")
    _draw_differences(difference, logs, reference, tolerance)
    for axes in (error, difference):
        axes.set_xlim(*events.time_span(longest(logs)))
        events.mark_faults(axes, longest(logs))
    _draw_times(figure.add_subplot(grid[:, 1]), logs)
    handles = [*run_handles(logs, [""] * len(logs)), *events.fault_handles(longest(logs))]
    legend_below(figure, handles)
    return save(figure, path)


def _draw_differences(axes: Axes, logs: Mapping[str, Log], reference: str, tolerance: float | None) -> None:
    """Running maximum of the joint difference, one curve a run."""
    decades(axes)
    for index, (label, log) in enumerate(logs.items()):
        if label != reference:
            colour, style = look(index)
            worst = np.maximum.accumulate(np.maximum(joint_difference(log, logs[reference]), LEAST))
            curve(axes, log["t"][: len(worst)], worst, color=colour, linestyle=style, linewidth=1.5)
    slides = any(logs[reference].metadata["prismatic"])
    unit = "rad or m" if slides else "rad"
    tidy(axes, "time [s]", f"largest joint difference\nto {reference} so far [{unit}]")
    if tolerance is not None:
        axes.axhline(tolerance, color=GREY, linewidth=1.0, linestyle="--")
        axes.annotate(
            "agreement", (0.01, tolerance), xytext=(0, 3), xycoords=("axes fraction", "data"),
            textcoords="offset points", fontsize=8, color=GREY,
        )  # fmt: skip


def _draw_times(axes: Axes, logs: Mapping[str, Log]) -> None:
    """Step time of each run: a bar to the median, a line to the 99th percentile, a dot at the largest."""
    for index, log in enumerate(logs.values()):
        p50, p99, largest = np.percentile(log["step_time"], (50.0, 99.0, 100.0))
        colour, _ = look(index)
        axes.barh(index, p50, height=0.55, color=colour)
        axes.plot((p50, p99), (index, index), color=colour, linewidth=2.0)
        axes.plot(largest, index, "o", color=colour, markersize=4.0)
        said = f"{p50:.3g}" if p50 < 1e3 else f"{p50:.0f}"
        axes.annotate(said, (p50, index), xytext=(3, 4), textcoords="offset points", fontsize=8)
    axes.set_xscale("log")
    axes.set_yticks(range(len(logs)), list(logs))
    axes.invert_yaxis()
    tidy(axes, "time of a step [us]", "", "bar: median, line: to p99, dot: largest")
