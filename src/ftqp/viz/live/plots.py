"""Plots and the ribbon beside the scene, and the last seconds of what a page has shown, which they are of."""

from collections.abc import Sequence
from html import escape
from itertools import groupby
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.sim.session.frame import Frame
from ftqp.viz.live import colours

SAMPLES = 150
"""Samples that are kept."""
SPAN = 10.0
"""Time that they cover [s]."""
GAP = 2.5
"""A frame so much later than the last one begins anew [s]."""
LEAST_ERROR, LEAST_TIME = 1e-3, 1.0
"""Errors [mm] and step times [us] below these are drawn there, on logarithmic axes."""
LINES = ("#1f77b4", "#ff7f0e", "#2ca02c", "#9467bd", "#8c564b", "#e377c2", "#17becf", "#bcbd22", "#7f7f7f")
"""Colours of the joints' lines, used again after the last one; red is a limit's."""
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
class History:
    """Samples of frames in the order of their times; a frame before the last one begins anew."""

    def __init__(self, frame: Frame) -> None:
        self.t: FloatArray = np.zeros(SAMPLES)
        self.share: FloatArray = np.zeros((SAMPLES, len(frame.share)))
        self.error: FloatArray = np.zeros(SAMPLES)
        self.rival: FloatArray = np.zeros(SAMPLES)
        self.step_time: FloatArray = np.zeros(SAMPLES)
        self.status: list[str] = []
        self._tick = frame.tick
        self._begin(frame)

    def add(self, frame: Frame) -> None:
        """Keep a frame, unless the last one that was kept is too near."""
        if frame.tick < self._tick or frame.t < self.t[-1] or frame.t > self.t[-1] + GAP:
            self._begin(frame)
        elif _place(frame.t) > _place(float(self.t[-1])):
            for column in (self.t, self.share, self.error, self.rival, self.step_time):
                column[:-1] = column[1:]
            self.status = [*self.status[1:], frame.status]
            self._write(frame)
        self._tick = frame.tick

    @property
    def ago(self) -> FloatArray:
        """The times of the samples before the last one, (SAMPLES,), <= 0 [s]."""
        result: FloatArray = self.t - self.t[-1]
        return result

    def step_quantile(self, share: float) -> float:
        """The step time that a share of the samples that are kept does not exceed [us]."""
        known = self.step_time[np.isfinite(self.step_time)]
        return float(np.quantile(known, share)) if known.size else np.nan

    def ribbon(self, width: int = 300, height: int = 14) -> str:
        """The statuses as a strip of SVG, the latest at its right end."""
        bar, pieces, end = width / SAMPLES, [], 0
        for status, spell in groupby(self.status):
            start, end = end, end + len(list(spell))
            if status:
                fill = colours.hexadecimal(colours.STATUS.get(status, colours.UNKNOWN))
                pieces.append(
                    f'<rect x="{start * bar:g}" width="{(end - start) * bar:g}" height="{height}" '
                    f'fill="{fill}"><title>{escape(status)}</title></rect>'
                )
        return (
            f'<svg viewBox="0 0 {width} {height}" width="100%" height="{height}" '
            f'preserveAspectRatio="none">{"".join(pieces)}</svg>'
        )

    def _begin(self, frame: Frame) -> None:
        """Forget every sample but one."""
        self.t[:] = frame.t + np.linspace(-SPAN * (1.0 - 1.0 / SAMPLES), 0.0, SAMPLES)
        for column in (self.share, self.error, self.rival, self.step_time):
            column[:] = np.nan
        self.status = [""] * (SAMPLES - 1) + [frame.status]
        self._tick = frame.tick
        self._write(frame)

    def _write(self, frame: Frame) -> None:
        """The latest sample."""
        self.t[-1] = frame.t
        self.share[-1] = frame.share
        self.error[-1] = _millimetres(frame.position_error)
        seen = frame.rival is not None and frame.truth.any()
        self.rival[-1] = _millimetres(frame.rival.error) if seen and frame.rival else np.nan
        self.step_time[-1] = max(frame.step_time_us, LEAST_TIME)


def _place(t: float) -> int:
    """The number of the sample that a time [s] belongs to."""
    return int(np.floor(t * SAMPLES / SPAN + 1e-6))


def _millimetres(error: float) -> float:
    """An error [m] in mm, at least what the axis begins with."""
    return float(np.maximum(1e3 * error, LEAST_ERROR))


@final
class Plots:
    """Three plots in the container that is open."""

    def __init__(self, gui: Any, joints: Sequence[str], history: History) -> None:
        lines = [_line(str(i + 1), LINES[i % len(LINES)]) for i in range(len(joints))]
        ends = [_line("upper", LIMIT, dash=(4, 4)), _line("lower limit", LIMIT, dash=(4, 4))]
        healthy = colours.hexadecimal(colours.CONDITION[0])

        def add(data: Any, series: Sequence[Any], title: str, scale: Any, axis: Any, **more: Any) -> Any:
            look = {"legend": {"show": True, "live": False}, "height": HEIGHT, **more}
            scales, all_series = {"x": _AGO, "y": scale}, ({"label": "before now [s]"}, *series)
            return gui.add_uplot(
                data=data, series=all_series, title=title, scales=scales, axes=(_TIME, axis), **look
            )

        both = [_line("ftqp", healthy), _line("resolved rates", colours.hexadecimal(colours.RIVAL))]
        range_of_errors = {"distr": 3, "log": 10, "range": (LEAST_ERROR, 3e3)}
        self._error = add(
            _errors(history), both, "error of the end effector [mm]", range_of_errors, _decades(-3, 3)
        )
        gui.add_html(_NOTE)
        few = {"show": True, "live": False} if len(joints) <= len(LINES) else {"show": False}
        self._joints = add(
            _shares(history), [*lines, *ends], f"joints 1 to {len(joints)} in their ranges, limits at ±1",
            {"range": (-1.15, 1.15)}, _SMALL, legend=few, height=HEIGHT + 20,
        )  # fmt: skip
        times = [_line("step", "#888888"), _line("median", healthy), _line("99.9 %", LIMIT, dash=(4, 4))]
        range_of_times = {"distr": 3, "log": 10, "range": (LEAST_TIME, 3e4)}
        title = "time of a planner's step [µs]"
        self._time = add(_times(history), times, title, range_of_times, _decades(0, 4))

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
    """Times, the error of the tip and that of the rival."""
    return history.ago, history.error.copy(), history.rival.copy()


def _times(history: History) -> tuple[FloatArray, ...]:
    """Times, the time of a step, its median and what one in a thousand exceeds."""
    median, slow = (np.full(SAMPLES, history.step_quantile(share)) for share in (0.5, 0.999))
    return history.ago, history.step_time.copy(), median, slow
