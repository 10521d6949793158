"""Positions, velocities and torques of every joint with their limits, and distances from what was sent."""

from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import Locked, kind_of
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.metrics import is_sensed
from ftqp.sim.log.signals import HEALTHY
from ftqp.viz.figures import events
from ftqp.viz.figures.canvas import Line2D, Patch, curve
from ftqp.viz.figures.joint_panels import (
    bar_handle,
    degradations,
    draw_values,
    finish_figure,
    finish_panel,
    panels,
)
from ftqp.viz.figures.palette import BLUE, FORBIDDEN, ORANGE, RED, WINE

TINY = 5e-5
"""Following errors that stay below this [rad or m] are drawn in millionths."""
DEGREES, MILLIMETRES = 180.0 / np.pi, 1e3
MOTOR_OF_FAILED = "motor of a failed joint"


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
    return (MILLIMETRES, f"mm{rate}") if slides else (DEGREES, f"deg{rate}" if mixed else "")


def _label(log: Log, what: str, rate: str) -> str:
    return what if any(log.metadata["prismatic"]) else f"{what} [deg{rate}]"


def _either_way(limit: float | None) -> tuple[float | None, float | None]:
    return (None, None) if limit is None else (-limit, limit)


def _left(log: Log, i: int, name: str, limit: float | None) -> list[tuple[float, float | None, float | None]]:
    """What degradations leave of a limit that holds either way, and since when."""
    found = []
    for fault in degradations(log, i):
        share = kind_of(fault["kind"]).shares.get(name)
        if share is not None and limit is not None:
            found.append((fault["at"], *_either_way(fault[share] * limit)))
    return found


def _scaled(limit: float | None, factor: float) -> float | None:
    return None if limit is None else factor * limit
