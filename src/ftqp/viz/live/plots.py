"""Plots beside the scene: joints in their ranges, the error of the tip, the time of a step."""

from collections.abc import Sequence
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.viz.live import colours
from ftqp.viz.live.history import LEAST_ERROR, LEAST_TIME, SAMPLES, SPAN, History

LINES = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#17becf", "#bcbd22")
"""Colours of the joints' lines, used again after the last one."""
LIMIT = "#d62728"
HEIGHT = 140
"""Height of a plot [px]."""
_SMALL: dict[str, Any] = {"size": 46, "font": "11px system-ui", "gap": 3, "ticks": {"size": 4}}
_TIME: dict[str, Any] = {**_SMALL, "size": 26, "splits": (-10, -8, -6, -4, -2, 0)}
_AGO: dict[str, Any] = {"time": False, "range": (-SPAN, 0.0)}
_NOTE = (
    '<div style="font:11px system-ui;color:#888;padding:0 12px">seconds before now, below every plot</div>'
)


@final
class Plots:
    """Three plots in the container that is open."""

    def __init__(self, gui: Any, joints: Sequence[str], history: History) -> None:
        legend = {"show": len(joints) <= len(LINES), "live": False}
        lines = [
            {"label": str(i + 1), "stroke": LINES[i % len(LINES)], "width": 1.5, "points": {"show": False}}
            for i in range(len(joints))
        ]
        ends = [_line("upper", LIMIT, dash=(4, 4)), _line("lower limit", LIMIT, dash=(4, 4))]
        self._joints = gui.add_uplot(
            data=_shares(history),
            series=({"label": "before now [s]"}, *lines, *ends),
            title=f"joints 1 to {len(joints)} in their ranges, limits at ±1",
            scales={"x": _AGO, "y": {"range": (-1.15, 1.15)}},
            axes=(_TIME, _SMALL),
            legend={"show": False} if not legend["show"] else legend,
            height=HEIGHT + 20,
        )
        gui.add_html(_NOTE)
        self._error = gui.add_uplot(
            data=_errors(history),
            series=(
                {"label": "before now [s]"},
                _line("told of its faults", colours.hexadecimal(colours.CONDITION[0])),
                _line("never told (ghost)", colours.hexadecimal(colours.GHOST)),
            ),
            title="error of the tip [mm]",
            scales={"x": _AGO, "y": {"distr": 3, "log": 10, "range": (LEAST_ERROR, 3e3)}},
            axes=(_TIME, _decades(-3, 3)),
            legend={"show": True, "live": False},
            height=HEIGHT,
        )
        self._time = gui.add_uplot(
            data=_times(history),
            series=(
                {"label": "before now [s]"},
                _line("step", "#888888"),
                _line("median", colours.hexadecimal(colours.CONDITION[0])),
                _line("99.9 %", LIMIT, dash=(4, 4)),
            ),
            title="time of a planner's step [µs]",
            scales={"x": _AGO, "y": {"distr": 3, "log": 10, "range": (LEAST_TIME, 3e4)}},
            axes=(_TIME, _decades(0, 4)),
            legend={"show": True, "live": False},
            height=HEIGHT,
        )

    def show(self, history: History) -> None:
        """Draw what has been kept."""
        self._joints.data = _shares(history)
        self._error.data = _errors(history)
        self._time.data = _times(history)


def _decades(low: int, high: int) -> dict[str, Any]:
    """A logarithmic axis with a mark at every power of ten."""
    powers = [10.0**k for k in range(low, high + 1)]
    return {**_SMALL, "splits": powers, "values": [f"{power:,g}" for power in powers], "space": 1}


def _line(label: str, colour: str, dash: tuple[int, int] | None = None) -> dict[str, Any]:
    """The look of a curve."""
    look = {"label": label, "stroke": colour, "width": 1.5, "points": {"show": False}}
    return look if dash is None else {**look, "dash": dash}


def _shares(history: History) -> tuple[FloatArray, ...]:
    """Times, the place of each joint in its range, and both limits."""
    ones = np.ones(SAMPLES)
    return (history.ago, *(column.copy() for column in history.share.T), ones, -ones)


def _errors(history: History) -> tuple[FloatArray, ...]:
    """Times, the error of the tip and that of the naive twin."""
    return history.ago, history.error.copy(), history.ghost.copy()


def _times(history: History) -> tuple[FloatArray, ...]:
    """Times, the time of a step, its median and what one in a thousand exceeds."""
    median, slow = (np.full(SAMPLES, history.step_quantile(share)) for share in (0.5, 0.999))
    return history.ago, history.step_time.copy(), median, slow
