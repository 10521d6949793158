"""Runs of one arm and path side by side: errors, joint motion, torques, statuses, and how well they agree."""

from collections.abc import Callable, Mapping
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.control.planner.status import STATUSES, StepStatus
from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError, unknown
from ftqp.sim.log.log_arrays import Log
from ftqp.viz.figures import events
from ftqp.viz.figures.canvas import (
    DEGREES,
    GREY,
    MILLIMETRES,
    Axes,
    Line2D,
    Patch,
    curve,
    decades,
    few_ticks,
    legend_below,
    made_folder,
    paper,
    save,
    tidy,
)  # fmt: skip
from ftqp.viz.figures.error_figures import SMALLEST_ERROR
from ftqp.viz.figures.status_ribbon import STATUS_COLOURS, spells

LEAST = 1e-16
"""Differences below this are drawn at it: a logarithmic axis has no zero [rad or m]."""


def save_comparison(logs: Mapping[str, Log], folder: str | Path, *, name: str, title: str) -> list[Path]:
    """Draw runs of one arm and path as PNG files into ``folder``, which is made if it is missing.

    Logs are by the label of their run; empty ones are left out. The files are errors, velocities,
    accelerations, torques (where the arm has inertia) and statuses, and their names begin with ``name``.
    """
    drawn = {label: log for label, log in logs.items() if len(log)}
    if not drawn:
        return []
    place = made_folder(folder)
    drawings: dict[str, Callable[[Mapping[str, Log], str, Path], Path]] = {
        "errors": draw_errors,
        "velocities": draw_velocities,
        "accelerations": draw_accelerations,
        "torques": draw_torques,
        "status": draw_statuses,
    }
    if not any(np.isfinite(log["tau"]).any() for log in drawn.values()):
        del drawings["torques"]
    return [draw(drawn, title, place / f"{name}-{what}.png") for what, draw in drawings.items()]


def draw_errors(logs: Mapping[str, Log], title: str, path: Path) -> Path:
    """Distance from the target over time, and the angle to it where it is not zero, one curve a run."""
    turns = any((log["rotation_error"] > 0.0).any() for log in logs.values())
    figure = paper(12.0, 8.0 if turns else 5.6, f"Distance from the target: {title}")
    grid: Any = figure.subplots(2 if turns else 1, 1, squeeze=False, sharex=True)
    signals = [("position_error", "position error [mm]", MILLIMETRES)]
    signals += [("rotation_error", "rotation error [deg]", DEGREES)] if turns else []
    for axes, (signal, label, factor) in zip(grid.flat, signals, strict=True):
        values = [np.maximum(factor * log[signal], SMALLEST_ERROR) for log in logs.values()]
        events.draw_runs(axes, logs, values)
        events.logarithmic(axes, values)
        tidy(axes, "", label)
        _mark_instants(axes, logs)
    grid.flat[-1].set_xlabel("time [s]")
    largest = [f"largest {events.length(float(log['position_error'].max()))}" for log in logs.values()]
    legend_below(figure, [*events.run_handles(logs, largest), *_instants(logs)])
    return save(figure, path)


def draw_velocities(logs: Mapping[str, Log], title: str, path: Path) -> Path:
    """The velocities of all joints, a panel a run, all with the same axes."""
    return _draw_joints(logs, "v", ("velocity", "/s"), f"Joint velocities: {title}", path)


def draw_accelerations(logs: Mapping[str, Log], title: str, path: Path) -> Path:
    """The commanded accelerations of all joints, a panel a run, all with the same axes."""
    return _draw_joints(logs, "a", ("acceleration", "/s²"), f"Joint accelerations: {title}", path)


def draw_torques(logs: Mapping[str, Log], title: str, path: Path) -> Path:
    """The norm of the motor torques over time, all runs in one panel."""
    values = [np.linalg.norm(log["tau"], axis=1) for log in logs.values()]
    top = events.frame(values)
    spikes = events.SPIKES if top < events.peak(values) else ""
    figure = paper(12.0, 5.6, f"Norm of the motor torques: {title}{spikes}")
    axes = figure.add_subplot()
    events.draw_runs(axes, logs, values)
    slides = any(any(log.metadata["prismatic"]) for log in logs.values())
    unit = "N m and N" if slides else "N m"
    tidy(axes, "time [s]", f"torque norm [{unit}]")
    axes.set_ylim(0.0, top)
    _mark_instants(axes, logs)
    largest = [f"largest {events.peak([curve]):.3g} {unit}" for curve in values]
    legend_below(figure, [*events.run_handles(logs, largest), *_instants(logs)])
    return save(figure, path)


def draw_statuses(logs: Mapping[str, Log], title: str, path: Path) -> Path:
    """The status of every step, a ribbon a run; and the scale along the path where a run was slowed."""
    scaled = STATUSES.index(StepStatus.SCALED)
    slowed = any((log["status"] == scaled).any() for log in logs.values())
    height = 2.4 + 0.45 * len(logs)
    figure = paper(12.0, height + (2.6 if slowed else 0.0), f"Status of every step: {title}")
    ratios = (height - 1.4, 2.4) if slowed else (1.0,)
    grid: Any = figure.subplots(len(ratios), 1, squeeze=False, sharex=True, height_ratios=ratios)
    axes = grid.flat[0]
    for place, log in enumerate(logs.values()):
        spells(axes, log, log["status"], float(place), dict(enumerate(STATUS_COLOURS)))
    axes.set_yticks(range(len(logs)), list(logs))
    axes.set_ylim(len(logs) - 0.4, -0.6)
    tidy(axes, "", "")
    if slowed:
        events.draw_runs(grid.flat[1], logs, [log["scale"] for log in logs.values()])
        grid.flat[1].set_ylim(-0.05, 1.05)
        tidy(grid.flat[1], "", "scale along the path [-]")
    for panel in grid.flat:
        panel.set_xlim(*events.common_span(logs))
        _mark_instants(panel, logs)
    grid.flat[-1].set_xlabel("time [s]")
    seen = sorted({int(code) for log in logs.values() for code in np.unique(log["status"])})
    statuses = [Patch(color=STATUS_COLOURS[code], label=STATUSES[code].name) for code in seen]
    runs = events.run_handles(logs, [""] * len(logs)) if slowed else []
    handles = [*statuses, *runs, *_instants(logs)]
    legend_below(figure, handles)
    return save(figure, path)


def _mark_instants(axes: Axes, logs: Mapping[str, Log]) -> None:
    """Faults, and when detectors found out, as vertical lines."""
    events.mark_faults(axes, events.longest(logs))
    events.mark_found(axes, *logs.values())


def _instants(logs: Mapping[str, Log]) -> list[Line2D]:
    """What the vertical lines mean: faults, and when detectors found out."""
    runs = list(logs.values())
    return [*events.fault_handles(events.longest(logs), *runs), *events.found_handles(*runs)]


def _draw_joints(
    logs: Mapping[str, Log], signal: str, quantity: tuple[str, str], title: str, path: Path
) -> Path:
    """One signal of all joints, a panel a run."""
    columns = min(len(logs), 3 if len(logs) in (3, 5, 6, 9) else 4 if len(logs) > 4 else 2)
    rows = ceil(len(logs) / columns)
    slides = np.array(next(iter(logs.values())).metadata["prismatic"])
    values = [np.where(slides, MILLIMETRES, DEGREES) * log[signal] for log in logs.values()]
    what, rate = quantity
    unit = f"deg{rate}, mm{rate}" if slides.any() else f"deg{rate}"
    top = events.frame(values)
    spikes = events.SPIKES if top < events.peak(values) else ""
    figure = paper(max(4.0 * columns, 12.0), 2.6 * rows + 1.4, f"{title}{spikes}")
    grid: Any = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for unused in grid.flat[len(logs) :]:
        unused.set_axis_off()
    for index, (label, log) in enumerate(logs.items()):
        axes = grid.flat[index]
        for joint in range(len(slides)):
            colour, style = events.look(joint)
            line = {"color": colour, "linestyle": style, "linewidth": events.THIN}
            curve(axes, log["t"], values[index][:, joint], **line)
        heading = f"{label}: at most {events.peak([values[index]]):.3g} {unit}"
        tidy(axes, "", f"{what} [{unit}]" if index % columns == 0 else "", heading)
        axes.set_xlim(*events.common_span(logs))
        axes.set_ylim(-top, top)
        few_ticks(axes, 5, 6)
        events.mark(axes, log)
        lowest = index + columns >= len(logs)
        axes.xaxis.set_tick_params(labelbottom=lowest)
        if lowest:
            axes.set_xlabel("time [s]")
    names = next(iter(logs.values())).metadata["joints"]
    joints = [events.handle(joint, name) for joint, name in enumerate(names)]
    stops = [log for log in logs.values() if events.stop_time(log) is not None]
    marks = [Line2D([], [], color="black", linestyle="--", label="emergency stop")] if stops else []
    legend_below(figure, [*joints, *_instants(logs), *marks])
    return save(figure, path)


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
    events.draw_runs(error, logs, errors)
    events.logarithmic(error, errors)
    tidy(error, "", "position error [mm]")
    _draw_differences(difference, logs, reference, tolerance)
    for axes in (error, difference):
        axes.set_xlim(*events.time_span(events.longest(logs)))
        events.mark_faults(axes, events.longest(logs))
    _draw_times(figure.add_subplot(grid[:, 1]), logs)
    handles = [*events.run_handles(logs, [""] * len(logs)), *events.fault_handles(events.longest(logs))]
    legend_below(figure, handles)
    return save(figure, path)


def _draw_differences(axes: Axes, logs: Mapping[str, Log], reference: str, tolerance: float | None) -> None:
    """Running maximum of the joint difference, one curve a run."""
    decades(axes)
    for index, (label, log) in enumerate(logs.items()):
        if label != reference:
            colour, style = events.look(index)
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
        colour, _ = events.look(index)
        axes.barh(index, p50, height=0.55, color=colour)
        axes.plot((p50, p99), (index, index), color=colour, linewidth=2.0)
        axes.plot(largest, index, "o", color=colour, markersize=4.0)
        said = f"{p50:.3g}" if p50 < 1e3 else f"{p50:.0f}"
        axes.annotate(said, (p50, index), xytext=(3, 4), textcoords="offset points", fontsize=8)
    axes.set_xscale("log")
    axes.set_yticks(range(len(logs)), list(logs))
    axes.invert_yaxis()
    tidy(axes, "time of a step [us]", "", "bar: median, line: to p99, dot: largest")
