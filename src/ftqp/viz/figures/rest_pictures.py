"""Pictures of where an arm rests that does not know of its failure, over the value of the locked joint."""

from pathlib import Path
from typing import Final

import numpy as np

from ftqp.analysis import CircularIntervals, RestCurve, RestCurves, RestKind
from ftqp.core.checks import FloatArray
from ftqp.viz.figures.canvas import (
    BLUE,
    GREY,
    PURPLE,
    RED,
    Axes,
    Line2D,
    Patch,
    few_ticks,
    legend_below,
    paper,
    save,
    tidy,
)  # fmt: skip

COLOURS: Final = {
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
            _draw(axes, curve, np.degrees(curve.q[:, i]), y)
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
        *(Line2D([], [], color=colour, label=str(kind)) for kind, colour in COLOURS.items() if kind in kinds),
        Line2D([], [], color="black", marker="o", markersize=3.5, linestyle="none", label="change of kind"),
    ]
    if within_reach is not None:
        handles.append(Patch(color=WITHIN_REACH, label="goal within reach"))
    legend_below(figure, handles)
    return save(figure, path)


def _principal(degrees: FloatArray) -> FloatArray:
    """Angles in [-180, 180), those that are 180 but for rounding at -180."""
    return np.asarray((degrees + 180.0 + SEAM) % 360.0 - 180.0 - SEAM)


def _draw(axes: Axes, curve: RestCurve, x: FloatArray, y: FloatArray) -> None:
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
        colour = COLOURS.get(kinds[begin])
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
