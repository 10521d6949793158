"""The last seconds of what a page has shown: what its plots and its ribbon are made of."""

from html import escape
from itertools import groupby
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.viz.live import colours
from ftqp.viz.live.frame import Frame

SAMPLES = 150
"""Samples that are kept."""
SPAN = 10.0
"""Time that they cover [s]."""
GAP = 2.5
"""A frame so much later than the last one begins anew [s]."""
LEAST_ERROR, LEAST_TIME = 1e-3, 1.0
"""Errors [mm] and step times [us] below these are drawn there, on logarithmic axes."""


@final
class History:
    """Samples of frames in the order of their times; a frame before the last one begins anew.

    Samples that there are not yet are NaN, and their status is empty.
    """

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
        failed = frame.rival is not None and frame.truth.any()
        self.rival[-1] = _millimetres(frame.rival_error) if failed else np.nan
        self.step_time[-1] = max(frame.step_time_us, LEAST_TIME)


def _place(t: float) -> int:
    """The number of the sample that a time [s] belongs to."""
    return int(np.floor(t * SAMPLES / SPAN + 1e-6))


def _millimetres(error: float) -> float:
    """An error [m] in mm, at least what the axis begins with."""
    return float(np.maximum(1e3 * error, LEAST_ERROR))
