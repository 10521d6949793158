"""A motion of an arm along a path: the arm at a few instants, and its joints within their limits."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.viz.figures.canvas import Axes, paper, save, shade_beyond, tidy
from ftqp.viz.figures.palette import BLUE, GREY, ORANGE

INSTANTS = 5
"""So often the arm is drawn."""
FLAT = 0.02
"""A motion whose extent along a direction is below this share of its size is flat there."""


def draw_motion(
    path: str | Path,
    title: str,
    joints: Sequence[str],
    t: FloatArray,
    q: FloatArray,
    limits: FloatArray,
    arms: FloatArray,
    way: FloatArray,
    limbs: Sequence[Sequence[int]],
) -> Path:
    """Draw a motion to a PNG file.

    Times ``t`` are (N,) [s], joint positions ``q`` (N, nv) [rad or m], their ``limits`` (nv, 2), infinite
    where there is none; ``arms`` is the arm at some instants, base to tip, (k, points, 3) [m], ``way`` that
    of the tip, (N, 3) [m], and ``limbs`` are the lines through the points, as ``Chain.limbs`` has them.
    """
    everything = np.vstack([arms.reshape(-1, 3), way])
    extent = np.ptp(everything, axis=0)
    views = [(0, 2), (0, 1)] if extent[2] > FLAT * extent.max() else [(0, 1)]
    rows = -(-len(joints) // 2)
    figure = paper(11.0, 4.2 + 1.5 * rows, title)
    parts: Any = figure.subfigures(2, 1, height_ratios=[4.2, 1.5 * rows])
    above, below = parts
    for k, plane in enumerate(views):
        _view(above.add_subplot(1, len(views), k + 1), plane, arms, way, limbs)
    panels = np.atleast_1d(below.subplots(rows, 2, sharex=True, squeeze=False)).ravel()
    for i, panel in enumerate(panels):
        if i >= len(joints):
            panel.set_visible(False)
            continue
        low, high = (float(x) if np.isfinite(x) else None for x in limits[i])
        shade_beyond(panel, low, high, q[:, i])
        panel.plot(t, q[:, i], color=BLUE, linewidth=1.6)
        tidy(panel, "time [s]" if i >= len(joints) - 2 else "", "[rad or m]", joints[i])
        panel.set_xlim(t[0], t[-1])
        panel.tick_params(labelbottom=i >= len(joints) - 2)
    return save(figure, path)


def _view(
    panel: Axes,
    plane: tuple[int, int],
    arms: FloatArray,
    way: FloatArray,
    limbs: Sequence[Sequence[int]],
) -> None:
    """The arm at its instants, seen along one axis of the base."""
    at = list(plane)
    for k, arm in enumerate(arms):
        share = (k + 1) / len(arms)
        for limb in limbs:
            line = arm[limb][:, at].T
            panel.plot(*line, color=GREY, linewidth=3.0, alpha=0.25 + 0.6 * share, solid_capstyle="round")
        panel.plot(*arm[1:-1, at].T, linestyle="none", marker="o", markersize=4, color=BLUE, alpha=share)
    panel.plot(*arms[0, 0, at], marker="s", color="black", markersize=8, linestyle="none")
    panel.plot(*way[:, at].T, color=ORANGE, linewidth=2.0)
    panel.plot(*way[-1, at], marker="*", color=ORANGE, markersize=12, linestyle="none")
    tidy(panel, f"{'xyz'[plane[0]]} [m]", f"{'xyz'[plane[1]]} [m]")
    panel.set_title("from the side" if plane == (0, 2) else "from above", fontsize=10)
    panel.set_aspect("equal", adjustable="datalim")
    panel.margins(0.1)
