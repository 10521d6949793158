"""An arm at a few instants of a run, seen from the side and from above, with the way of its tip."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.pose import rotated
from ftqp.model.chain import Skeleton
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.signals import HEALTHY
from ftqp.viz.figures import events
from ftqp.viz.figures.canvas import (
    BLUE,
    GREY,
    MILLIMETRES,
    ORANGE,
    RED,
    Axes,
    Figure,
    Line2D,
    few_ticks,
    paper,
    save,
    shade_beyond,
    tidy,
    trace,
)  # fmt: skip

INSTANTS = 5
"""So often the arm is drawn."""
FLAT = 0.02
"""A motion whose extent along a direction is below this share of its size is flat there."""
LARGE = 5.0
"""Arms that extend farther than this [m] are drawn in metres."""
FAINTEST = 0.22
"""How dark the first posture is; the last is black."""
ROOM = 0.09
"""Free room around what is drawn, as a share of its size."""
Plane = tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Postures:
    """An arm at the instants t, (k,) [s], and the way of its tip, (K, 3) [m].

    Points are base, joints and tip, in space where the base moves, (k, nv + 2, 3) [m]; each limb is a line
    through some of them. Joints have failed by then, (k, nv).
    """

    t: FloatArray
    points: FloatArray
    failed: BoolArray
    way: FloatArray
    limbs: Sequence[Sequence[int]]


def instants(log: Log) -> list[int]:
    """Rows of a log at which its arm is worth a look: start, end, the first fault, the stop, and between."""
    t, last = log["t"], len(log) - 1
    times = [fault["at"] for fault in events.faults(log)[:1]]
    stop = events.stop_time(log)
    times += [] if stop is None else [stop]
    rows = {0, last, *(int(np.searchsorted(t, at - events.REPORTED_LATER)) for at in times)}
    rows = {min(row, last) for row in rows}
    while len(rows) < min(INSTANTS, len(log)):
        ordered = sorted(rows)
        gap = int(np.argmax(np.diff(ordered)))
        middle = (ordered[gap] + ordered[gap + 1]) // 2
        if middle in rows:
            break
        rows.add(middle)
    return sorted(rows)


def postures(log: Log, rows: Sequence[int] | NDArray[np.intp]) -> Postures | None:
    """The arm at some rows of a log; None for a log that does not say where its joints sit."""
    if "skeleton" not in log.metadata:
        return None
    at = list(rows)
    found = postures_of(
        Skeleton.from_facts(log.metadata["skeleton"]), log["t"][at], log["q"][at],
        failed=log["truth"][at] != HEALTHY, way=log["tip"][:, :3],
    )  # fmt: skip
    if "base.x" in log:  # the end effector of an arm on a moving base is logged where it is in space
        base = log["base"][at]
        return replace(found, points=rotated(base[:, 3:], found.points) + base[:, None, :3])
    return found


def postures_of(
    skeleton: Skeleton, t: FloatArray, q: FloatArray, *, failed: BoolArray, way: FloatArray
) -> Postures:
    """An arm on a base that stands, at the instants t, (k,), in the configurations q, (k, nv)."""
    frames = skeleton.frames(q)
    points = np.concatenate([np.zeros((len(q), 1, 3)), frames[:, :, :3, 3]], axis=1)
    return Postures(t=t, points=points, failed=failed, way=way, limbs=skeleton.limbs)


def planes(*motions: Postures) -> list[Plane]:
    """From where motions are seen best: from the side and from above, or from above alone where flat."""
    everything = np.concatenate([motion.points.reshape(-1, 3) for motion in motions])
    extent = np.ptp(everything, axis=0)
    if extent[2] <= FLAT * extent.max():
        return [(0, 1)]
    return [(0 if extent[0] >= extent[1] else 1, 2), (0, 1)]


def name(plane: Plane) -> str:
    """How a view is called."""
    return "from above" if plane == (0, 1) else f"from the side, along {'yx'[plane[0]]}"


def draw_views(
    figure: Figure, grid: Any, motions: Sequence[Postures], *, targets: FloatArray,
    colours: Sequence[str] = ("black",), ways: Sequence[str] = (ORANGE,),
) -> None:  # fmt: skip
    """Draw arms from where they are seen best, in the first column, of two rows, of the figure's grid."""
    views, (scale, unit) = planes(*motions), _unit(*motions)
    for row, plane in enumerate(views):
        axes: Axes = (
            figure.add_subplot(1, len(views), row + 1)
            if grid is None
            else figure.add_subplot(grid[row, 0] if len(views) > 1 else grid[:, 0])
        )
        at = list(plane)
        trace(axes, *(scale * targets[:, at]).T, color=GREY, linewidth=5.0, alpha=0.35, zorder=2)
        for motion, colour, way in reversed(list(zip(motions, colours, ways, strict=True))):
            _draw_arm(axes, motion, scale, at, colour)
            trace(axes, *(scale * motion.way[:, at]).T, color=way, linewidth=1.6, zorder=6)
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(ROOM)
        labels = [f"{'xyz'[k]} [{unit}]" for k in plane]
        tidy(axes, "", "", f"The arm {name(plane)}, {labels[0]} and {labels[1]}")
        few_ticks(axes, 4, 4)


def _unit(*motions: Postures) -> tuple[float, str]:
    """Factor and unit of lengths."""
    extent = max(float(np.abs(motion.points).max()) for motion in motions)
    return (1.0, "m") if extent > LARGE else (MILLIMETRES, "mm")


def _draw_arm(axes: Axes, motion: Postures, scale: float, at: list[int], colour: str) -> None:
    """The postures, the last one darkest; failed joints in red."""
    count = len(motion.points)
    for k, (points, failed) in enumerate(zip(scale * motion.points, motion.failed, strict=True)):
        dark = FAINTEST + (1.0 - FAINTEST) * ((k + 1) / count) ** 2
        last = k == count - 1
        x, y = points[:, at].T
        for limb in motion.limbs:
            joints = [place for place, row in enumerate(limb) if place and row < len(points) - 1]
            axes.plot(
                x[limb], y[limb], color=colour, linewidth=4.0 if last else 3.0, alpha=dark,
                solid_capstyle="round", solid_joinstyle="round", marker="o", markevery=joints, markersize=5.5,
                markerfacecolor="white", markeredgecolor=colour, markeredgewidth=1.2, zorder=3 + k / count,
            )  # fmt: skip
        if failed.any():
            axes.plot(
                x[1:-1][failed], y[1:-1][failed], linestyle="none", marker="X", color=RED, zorder=5,
                markersize=10.0 if last else 7.0, alpha=max(dark, 0.5), markeredgecolor="white",
                markeredgewidth=0.6,
            )  # fmt: skip
    bases = scale * motion.points[:, 0, at]
    axes.plot(*bases.T, linestyle="none", marker="s", markersize=9, color="black", zorder=3)


def arm_handles(motion: Postures, colour: str = "black") -> list[Line2D]:
    """What the arms mean, for a legend."""
    times = ", ".join(f"{t:.3g}" for t in motion.t)
    found = [
        Line2D([], [], color=colour, linewidth=3.0, marker="o", markersize=5.5, markerfacecolor="white",
               label=f"arm at {times} s, the last darkest"),
    ]  # fmt: skip
    if motion.failed.any():
        found.append(
            Line2D([], [], color=RED, marker="X", markersize=9.0, linestyle="none", label="failed joint")
        )
    return found


def draw_motion(path: str | Path, title: str, robot: Robot, t: FloatArray, q: FloatArray) -> Path:
    """Draw a motion to a PNG file: configurations q, (N, nv) [rad or m], at the times t, (N,) [s]."""
    at = np.linspace(0, len(q) - 1, INSTANTS).round().astype(int)
    way, none = np.stack([robot.pose(row)[:3, 3] for row in q]), np.zeros((len(at), robot.nv), dtype=bool)
    arm = postures_of(Skeleton.of(robot.chain), t[at], q[at], failed=none, way=way)
    rows = -(-robot.nv // 2)
    figure = paper(11.0, 4.2 + 1.5 * rows, title)
    parts: Any = figure.subfigures(2, 1, height_ratios=[4.2, 1.5 * rows])
    above, below = parts
    draw_views(above, None, [arm], targets=way)
    panels = np.atleast_1d(below.subplots(rows, 2, sharex=True, squeeze=False)).ravel()
    for i, panel in enumerate(panels):
        if i >= robot.nv:
            panel.set_visible(False)
            continue
        ends = (robot.limits.q_min[i], robot.limits.q_max[i])
        low, high = (float(x) if np.isfinite(x) else None for x in ends)
        shade_beyond(panel, low, high, q[:, i])
        panel.plot(t, q[:, i], color=BLUE, linewidth=1.6)
        unit = "[m]" if robot.chain.prismatic[i] else "[rad]"
        tidy(panel, "time [s]" if i >= robot.nv - 2 else "", unit, robot.joints[i])
        panel.set_xlim(t[0], t[-1])
        panel.tick_params(labelbottom=i >= robot.nv - 2)
    return save(figure, path)
