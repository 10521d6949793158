"""Runs of one arm and path side by side, and a run beside rivals that lead the arm without ftqp."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any, final

import numpy as np

from ftqp.control.planner.status import STATUSES, StepStatus
from ftqp.core.checks import FloatArray
from ftqp.model.chain import Skeleton
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.rival import strayed
from ftqp.viz.figures import arm_views, events
from ftqp.viz.figures.canvas import (
    BLUE,
    DEGREES,
    GREEN,
    GREY,
    MILLIMETRES,
    PURPLE,
    RED,
    Axes,
    Line2D,
    Patch,
    curve,
    few_ticks,
    legend_below,
    made_folder,
    paper,
    save,
    tidy,
    trace,
)  # fmt: skip
from ftqp.viz.figures.error_figures import SMALLEST_ERROR
from ftqp.viz.figures.run_figures import STATUS_COLOURS, spells


def save_comparison(logs: Mapping[str, Log], folder: str | Path, *, name: str, title: str) -> list[Path]:
    """Draw runs of one arm and path as PNG files into ``folder``, which is made if it is missing."""
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
    values = [np.where(slides, MILLIMETRES, 1.0) * log[signal] for log in logs.values()]
    what, rate = quantity
    unit = f"rad{rate}, mm{rate}" if slides.any() else f"rad{rate}"
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


RIVALS = (PURPLE, GREEN)
"""Of the rivals, in their order."""
POSTURES = 3
"""So often each arm is drawn, from the failure on."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rival:
    """A controller beside that of a run: joints (K, nv) [rad or m], tip (K, 3) [m] and its error (K,) [m]."""

    name: str
    q: FloatArray
    tip: FloatArray
    error: FloatArray


def draw_rivals(log: Log, own: str, rivals: Sequence[Rival], path: str | Path, title: str) -> Path:
    """Draw the arms of a run and of its first rival, the paths of all tips and all errors to a PNG file."""
    figure = paper(16.0, 6.8, title)
    grid = figure.add_gridspec(2, 3, width_ratios=(1.0, 1.0, 1.15))
    first, t = rivals[0], log["t"]
    rows = [int(row) for row in np.linspace(_first_row(log), len(log) - 1, POSTURES)]
    skeleton = Skeleton.from_facts(log.metadata["skeleton"])
    failed = log["truth"][rows] != 0
    arms = [
        arm_views.postures_of(skeleton, t[rows], q[rows], failed=failed, way=way)
        for q, way in ((log["q"], log["tip"][:, :3]), (first.q, first.tip))
    ]
    colours = [BLUE, RIVALS[0]]
    arm_views.draw_views(figure, grid, arms, targets=log["target"][:, :3], colours=colours, ways=colours)
    curves = [(own, log["tip"][:, :3], strayed(log), BLUE)]
    curves += [(one.name, one.tip, one.error, colour) for one, colour in zip(rivals, RIVALS, strict=False)]
    _draw_tips(figure.add_subplot(grid[:, 1]), log, curves)
    _draw_distances(figure.add_subplot(grid[:, 2]), log, curves)
    handles = [
        Line2D([], [], color=colour, linewidth=3.0, label=_result(name, error, log))
        for name, _, error, colour in curves
    ]
    handles += [
        Line2D([], [], color=GREY, linewidth=5.0, alpha=0.35, label="where the end effector should go")
    ]
    handles += [*arm_views.arm_handles(arms[0], GREY), *events.fault_handles(log), *events.found_handles(log)]
    legend_below(figure, handles)
    return save(figure, path)


def _result(name: str, error: FloatArray, log: Log) -> str:
    """A controller with the largest error from the failure on and the last one, which the plot shows."""
    since = error[_first_row(log) :]
    most, last = events.length(float(since.max())), events.length(float(error[-1]))
    return f"{name}: at most {most} off, {last} at the end"


def _first_row(log: Log) -> int:
    """The row of the first failure, or the first."""
    at = min([fault["at"] for fault in events.faults(log)], default=float(log["t"][0]))
    return min(int(np.searchsorted(log["t"], at - events.REPORTED_LATER)), len(log) - 1)


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
    at = MILLIMETRES * (log["tip"][_first_row(log), :3] - log["target"][0, :3])
    axes.plot(*at[[first, second]], "X", color=RED, markersize=11.0, zorder=5)
    tidy(
        axes, "", "", f"Where the end effectors went: {'xyz'[first]} and {'xyz'[second]} from the start [mm]"
    )
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    few_ticks(axes, 5, 7)


def _draw_distances(axes: Axes, log: Log, curves: Sequence[tuple[str, FloatArray, FloatArray, str]]) -> None:
    """All distances from the target on one axis."""
    top = MILLIMETRES * max(float(error.max()) for _, _, error, _ in curves)
    for _, _, error, colour in reversed(curves):
        curve(axes, log["t"], MILLIMETRES * error, color=colour, linewidth=2.2)
    axes.set_ylim(-0.03 * top, 1.08 * top or 1.0)
    axes.set_xlim(*events.time_span(log))
    events.mark_faults(axes, log)
    events.mark_found(axes, log)
    tidy(axes, "time [s]", "", "Distance of the end effector from its target [mm]")
