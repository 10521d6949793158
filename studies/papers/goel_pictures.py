"""Pictures of the paper by Goel and others: rests, their basins, and where an error falls."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ftqp.analysis import CircularIntervals, RestCurve, RestCurves, RestKind
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
    Axes,
    Line2D,
    Patch,
    few_ticks,
    legend_below,
    paper,
    save,
    tidy,
)  # fmt: skip

COLOURS = (SKY, YELLOW, GREEN, PURPLE, ORANGE, BLUE)
"""Of basins, the largest first."""
NO_REST, NOT_KNOWN = "#444444", "#FFFFFF"


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


KINDS = {
    RestKind.SINK: RED,
    RestKind.SADDLE: GREY,
    RestKind.SOURCE: BLUE,
    RestKind.DEGENERATE: PURPLE,
}
"""Of the kinds that are drawn; what lies outside joint limits is not."""
WITHIN_REACH = "#E4F3EC"
"""Shade of locked values with which the goal stays within reach."""
SEAM = 1e-4
"""Rounding of an angle of half a turn [degrees]."""
MOST_JOINTS = 3
"""An arm with more joints beside the locked one gets the panel of the error only."""


def draw_rests(
    path: str | Path, title: str, rests: RestCurves, within_reach: CircularIntervals | None = None
) -> Path:
    """Draw curves of rests to a PNG file: the error and the other joints over the locked value, by kind.

    Locked values with which the goal stays within reach, as of ``joint_ranges``, are shaded.
    """
    i, joints = rests.index, rests.joints
    others = [k for k in range(len(joints)) if k != i]
    shown = others if len(others) <= MOST_JOINTS else []
    figure = paper(7.2, 2.4 + 2.2 * len(shown), title)
    rows = figure.subplots(1 + len(shown), 1, sharex=True, squeeze=False)[:, 0]
    for axes, k in zip(rows, [None, *shown], strict=True):
        if within_reach is not None:
            _shade(axes, within_reach)
        for curve in rests:
            y = curve.error if k is None else np.degrees(curve.q[:, k])
            _draw_stretches(axes, curve, np.degrees(curve.q[:, i]), y)
            _mark(axes, curve, i, k)
        last = axes is rows[-1]
        label = "error [m]" if k is None else f"{joints[k]} [°]"
        tidy(axes, f"{rests.joint} locked at [°]" if last else "", label)
        few_ticks(axes, x=8)
        if k is not None:
            axes.set_ylim(-185.0, 185.0)
    rows[0].set_xlim(-185.0, 185.0)
    rows[0].set_ylim(bottom=0.0)
    kinds = {kind for curve in rests for kind in curve.kinds}
    handles: list[Line2D | Patch] = [
        *(Line2D([], [], color=colour, label=str(kind)) for kind, colour in KINDS.items() if kind in kinds),
        Line2D([], [], color="black", marker="o", markersize=3.5, linestyle="none", label="change of kind"),
    ]
    if within_reach is not None:
        handles.append(Patch(color=WITHIN_REACH, label="goal within reach"))
    legend_below(figure, handles)
    return save(figure, path)


def _principal(degrees: FloatArray) -> FloatArray:
    """Angles in [-180, 180), those that are 180 but for rounding at -180."""
    return np.asarray((degrees + 180.0 + SEAM) % 360.0 - 180.0 - SEAM)


def _draw_stretches(axes: Axes, curve: RestCurve, x: FloatArray, y: FloatArray) -> None:
    """Stretches of one kind each, broken where an angle jumps by a turn."""
    turning = y is not curve.error
    x, y = _principal(x), _principal(y) if turning else y
    jump = np.abs(np.diff(x)) > 180.0
    if turning:
        jump |= np.abs(np.diff(y)) > 180.0
    kinds = list(curve.kinds)
    begin = 0
    for k in range(1, len(kinds) + 1):
        if k < len(kinds) and kinds[k] is kinds[begin] and not jump[k - 1]:
            continue
        colour = KINDS.get(kinds[begin])
        if colour is not None:
            width = 2.2 if kinds[begin] is RestKind.SINK else 1.4
            axes.plot(x[begin:k], y[begin:k], color=colour, linewidth=width)
        begin = k


def _mark(axes: Axes, curve: RestCurve, i: int, k: int | None) -> None:
    """Dots where the kind changes."""
    for change in curve.changes:
        if RestKind.OUTSIDE in (change.before, change.after):
            continue
        at = int(np.argmin(np.abs(curve.q - change.q).sum(axis=1)))
        x = float(_principal(np.degrees(curve.q[at : at + 1, i]))[0])
        value = curve.error[at] if k is None else float(_principal(np.degrees(curve.q[at : at + 1, k]))[0])
        axes.plot(x, value, color="black", marker="o", markersize=3.5, linestyle="none")


def _shade(axes: Axes, values: CircularIntervals) -> None:
    for low, high in np.degrees(np.array(values.intervals).reshape(-1, 2)):
        for turn in (-360.0, 0.0, 360.0) if values.circular else (0.0,):
            left, right = max(low + turn, -180.0), min(high + turn, 180.0)
            if left < right:
                axes.axvspan(left, right, color=WITHIN_REACH, linewidth=0.0, zorder=0)
