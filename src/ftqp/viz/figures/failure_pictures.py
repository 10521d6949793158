"""Pictures of motions after failures that nobody was told of: the arm's way, basins, where an error falls."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.viz.figures.canvas import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    WINE,
    YELLOW,
    Line2D,
    Patch,
    few_ticks,
    legend_below,
    paper,
    save,
    tidy,
)  # fmt: skip

POSTURES = 9
"""Of an arm on its way."""
COLOURS = (SKY, YELLOW, GREEN, PURPLE, ORANGE, BLUE)
"""Of basins, the largest first."""
Motion = tuple[FloatArray, FloatArray, FloatArray]
"""Times (k,) [s], configurations (k, n) [rad] and errors (k,) [m]."""
NO_REST, NOT_KNOWN = "#444444", "#FFFFFF"


def draw_motions(
    path: str | Path, title: str, lengths: FloatArray, motions: dict[str, Motion], goal: FloatArray
) -> Path:
    """Draw planar arms on their ways, a panel each, and below it the error over time, to a PNG file.

    ``lengths`` are those of the links, (n,) [m], motions are by the heading of their panel, and the goal is
    (2,) [m].
    """
    figure = paper(3.9 * len(motions), 6.4, title)
    grid = figure.add_gridspec(2, len(motions), height_ratios=(2.6, 1.0))
    reach = float(np.sum(lengths))
    for k, (name, (t, q, errors)) in enumerate(motions.items()):
        axes = figure.add_subplot(grid[0, k])
        joints = _joints(lengths, q)
        way = np.linalg.norm(np.diff(joints[:, -1], axis=0), axis=1)
        done = np.concatenate([[0.0], np.cumsum(way)])
        shown = np.searchsorted(done, np.linspace(0.0, done[-1], POSTURES)).clip(0, len(q) - 1)
        for number, row in enumerate(shown):
            share = number / (POSTURES - 1)
            axes.plot(*joints[row].T, color=GREY, alpha=0.15 + 0.35 * share, linewidth=1.6)
        axes.plot(*joints[0].T, color=BLUE, marker="o", markersize=3.5, linewidth=2.0)
        axes.plot(*joints[-1].T, color=RED, marker="o", markersize=3.5, linewidth=2.0)
        axes.plot(*joints[:, -1].T, color=ORANGE, linewidth=1.3)
        axes.plot(*goal, marker="x", color="black", markersize=9, markeredgewidth=2.0, linestyle="none")
        axes.set_aspect("equal")
        axes.set_xlim(-1.05 * reach, 1.05 * reach)
        axes.set_ylim(-1.05 * reach, 1.05 * reach)
        tidy(axes, "x [m]", "y [m]" if k == 0 else "", name)
        below = figure.add_subplot(grid[1, k])
        below.plot(t, errors, color=ORANGE, linewidth=1.4)
        below.set_ylim(0.0, 1.08 * max(float(errors.max()), 1e-9))
        tidy(below, "time [s]", "error [m]" if k == 0 else "")
        few_ticks(below)
    handles = [
        Line2D([], [], color=BLUE, marker="o", label="at the failure"),
        Line2D([], [], color=RED, marker="o", label="in the end"),
        Line2D([], [], color=ORANGE, label="the tip's way"),
        Line2D([], [], color="black", marker="x", linestyle="none", label="goal"),
    ]
    legend_below(figure, handles)
    return save(figure, path)


def _joints(lengths: FloatArray, q: FloatArray) -> FloatArray:
    """Base, joints and tip of planar arms, (k, n + 1, 2) [m]."""
    ends = np.cumsum(lengths * np.exp(1j * np.cumsum(q, axis=1)), axis=1)
    points = np.concatenate([np.zeros((len(q), 1)), ends], axis=1)
    return np.asarray(np.stack([points.real, points.imag], axis=-1))


def draw_basins(
    path: str | Path, title: str, names: tuple[str, str], angles: FloatArray, label: IntArray,
    ends: FloatArray, kinds: tuple[str, ...], saddles: FloatArray, separatrices: list[FloatArray],
) -> Path:  # fmt: skip
    """Draw which start goes where over the two joints that move, to a PNG file.

    ``angles`` are the middles of the cells, (k,) [rad], and ``label`` is the index of the end of each start,
    -1 without rest, -2 where that is not known, (k, k). ``ends`` (e, 2) and ``saddles`` (s, 2) hold both
    joints [rad], each separatrix (k, 2) a way into a saddle, and ``kinds`` what each end is.
    """
    figure = paper(6.4, 6.9, title)
    axes = figure.add_subplot()
    image = np.empty((*label.shape, 3))
    image[:] = _rgb(NOT_KNOWN)
    image[label == -1] = _rgb(NO_REST)
    for k in range(len(ends)):
        image[label == k] = _rgb(COLOURS[k % len(COLOURS)])
    edge = np.degrees(angles[0] - 0.5 * (angles[1] - angles[0]))
    axes.imshow(
        np.swapaxes(image, 0, 1), origin="lower", extent=(edge, -edge, edge, -edge), interpolation="nearest"
    )
    for way in separatrices:
        x, y = (np.degrees(column) for column in _broken(way).T)
        axes.plot(x, y, color="black", linewidth=1.2)
    axes.plot(*np.degrees(ends).T, "o", color="black", markerfacecolor="white", markersize=8)
    axes.plot(*np.degrees(saddles).T, "X", color=RED, markersize=9)
    tidy(axes, f"{names[0]} [degrees]", f"{names[1]} [degrees]")
    handles: list[Any] = [
        Patch(color=COLOURS[k % len(COLOURS)], label=f"{kind}, {100 * np.mean(label == k):.1f} %")
        for k, kind in enumerate(kinds)
    ]
    if (label == -1).any():
        handles.append(Patch(color=NO_REST, label="no rest"))
    handles += [
        Line2D([], [], color="black", marker="o", markerfacecolor="white", linestyle="none", label="rest"),
        Line2D([], [], color=RED, marker="X", linestyle="none", label="saddle"),
        Line2D([], [], color="black", label="separatrix"),
    ]
    legend_below(figure, handles)
    return save(figure, path)


def _rgb(colour: str) -> tuple[float, float, float]:
    """The shares of red, green and blue of ``#RRGGBB``."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    return red, green, blue


def _broken(way: FloatArray) -> FloatArray:
    """A curve on the torus in (-pi, pi], broken by NaN where it leaves the square."""
    turned = np.pi - (np.pi - way) % (2.0 * np.pi)
    jumps = (np.abs(np.diff(turned, axis=0)) > np.pi).any(axis=1)
    return np.asarray(np.insert(turned, np.flatnonzero(jumps) + 1, np.nan, axis=0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SignPanel:
    """Where an error falls over directions of a goal and angles of the joint that moves.

    Attributes:
        phi: Directions of the goal, (a,) [rad].
        theta: Angles, (b,) [rad].
        falls: Whether the error falls, (a, b).
        rate: Of the joint, (a, b) [rad/s].
        rest: A smooth function that is zero where the joint is at rest, (a, b).
        taken_in: Directions with which a singularity at angle 0 takes the joint in, (a,).
    """

    phi: FloatArray
    theta: FloatArray
    falls: BoolArray
    rate: FloatArray
    rest: FloatArray
    taken_in: BoolArray


def draw_error_signs(path: str | Path, title: str, panels: dict[str, SignPanel]) -> Path:
    """Draw over goals and angles of a joint where its error falls, and which way it turns, to a PNG file."""
    figure = paper(5.2 * len(panels), 5.6, title)
    grid = figure.add_gridspec(1, len(panels))
    for k, (name, panel) in enumerate(panels.items()):
        axes = figure.add_subplot(grid[0, k])
        x, y = np.degrees(panel.phi), np.degrees(panel.theta)
        axes.imshow(
            np.where(panel.falls, 0.62, 0.92).T, origin="lower", extent=(x[0], x[-1], y[0], y[-1]),
            cmap="gray", vmin=0.0, vmax=1.0, aspect="auto",
        )  # fmt: skip
        axes.contour(x, y, panel.rest.T, levels=[0.0], colors=[RED], linewidths=1.6)
        axes.plot(np.where(panel.taken_in, x, np.nan), np.zeros(len(x)), color=WINE, linewidth=4.0)
        every = max(1, len(x) // 18)
        for i in range(every // 2, len(x), every):
            for j in range(every // 2, len(y), every):
                turn = 9.0 * np.sign(panel.rate[i, j])
                axes.annotate(
                    "", (x[i], y[j] + turn), (x[i], y[j]), arrowprops={"arrowstyle": "->", "color": BLUE}
                )
        axes.set_xticks(range(-180, 181, 60))
        axes.set_yticks(range(-180, 181, 60))
        axes.set_xlabel("direction of the goal from joint 2 [degrees]")
        axes.set_ylabel("joint 2 [degrees]" if k == 0 else "")
        axes.set_title(name, fontsize=10)
    handles = [
        Patch(color="#9E9E9E", label="error falls"),
        Patch(color="#EBEBEB", label="error rises"),
        Line2D([], [], color=RED, label="rest"),
        Line2D([], [], color=WINE, linewidth=4.0, label="taken in by the stretched arm"),
        Line2D([], [], color=BLUE, marker="^", linestyle="none", label="which way joint 2 turns"),
    ]
    legend_below(figure, handles)
    return save(figure, path)
