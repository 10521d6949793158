"""What figures of runs share: the instants that they mark, and curves that can be distinguished."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ftqp.control.planner.status import STATUSES, StepStatus
from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import KINDS
from ftqp.sim.log.log_arrays import Log
from ftqp.viz.figures.canvas import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    WINE,
    Axes,
    Line2D,
    curve,
    decades,
)  # fmt: skip

REPORTED_LATER = 1e-6
"""An announcement at least this much after its fault is marked by itself [s]."""


def faults(log: Log) -> list[dict[str, Any]]:
    """The faults that happened within the log, first to last."""
    end = float(log["t"][-1]) if len(log) else -1.0
    return [fault for fault in log.metadata.get("faults", []) if fault["at"] <= end + REPORTED_LATER]


def reported_later(fault: dict[str, Any]) -> bool:
    """Whether it was reported to the planner, but not at once."""
    return fault["announced"] is not None and fault["announced"] - fault["at"] > REPORTED_LATER


def found_at(log: Log) -> list[float]:
    """When the planner's detector found what it believed [s]."""
    return [float(found["detected_at"]) for found in log.metadata.get("detections") or ()]


def sentence(fault: dict[str, Any], *, reported: bool = True) -> str:
    """One fault in words, with when it is reported or without."""
    if not reported:
        return f"{fault['joint']} {KINDS[fault['kind']].happens} at {fault['at']:g} s"
    if fault["announced"] is None:
        heard = " (never reported)"
    elif reported_later(fault):
        heard = f" (reported at {fault['announced']:g} s)"
    else:
        heard = ""
    return f"{fault['joint']} {KINDS[fault['kind']].happens} at {fault['at']:g} s{heard}"


def stop_time(log: Log) -> float | None:
    """When the arm gave up its task [s], or ``None``."""
    codes = [STATUSES.index(StepStatus.STOPPING), STATUSES.index(StepStatus.STOPPED)]
    stops = np.flatnonzero(np.isin(log["status"], codes))
    return float(log["t"][stops[0]]) if len(stops) else None


def mark(axes: Axes, log: Log) -> None:
    """Draw the instants as vertical lines."""
    mark_faults(axes, log)
    mark_found(axes, log)
    stop = stop_time(log)
    if stop is not None:
        axes.axvline(stop, color="black", linewidth=1.2, linestyle="--")


def mark_faults(axes: Axes, log: Log) -> None:
    """Draw when joints fail, and when that is reported, as vertical lines."""
    for fault in faults(log):
        axes.axvline(fault["at"], color=RED, linewidth=1.2)
        if reported_later(fault):
            axes.axvline(fault["announced"], color=BLUE, linewidth=1.2, linestyle=":")


def mark_found(axes: Axes, *logs: Log) -> None:
    """Draw when the planner finds out by itself as vertical lines."""
    for at in sorted({at for log in logs for at in found_at(log)}):
        axes.axvline(at, color=BLUE, linewidth=1.2, linestyle="-.")


def found_handles(*logs: Log) -> list[Line2D]:
    """What these lines mean, for a legend."""
    times = sorted({at for log in logs for at in found_at(log)})
    if not times:
        return []
    label = f"detector finds out at {', '.join(f'{at:.4g}' for at in times)} s"
    return [Line2D([], [], color=BLUE, linewidth=1.2, linestyle="-.", label=label)]


def handles(log: Log) -> list[Line2D]:
    """What the vertical lines mean, for a legend."""
    result = [*fault_handles(log), *found_handles(log)]
    stop = stop_time(log)
    if stop is not None:
        label = f"emergency stop at {stop:.4g} s"
        result.append(Line2D([], [], color="black", linewidth=1.2, linestyle="--", label=label))
    return result


def fault_handles(log: Log, *others: Log) -> list[Line2D]:
    """What the lines of the faults mean, for a legend; others may have been reported at other times."""
    happened = faults(log)
    result = []
    if happened:
        alike = all([f["announced"] for f in happened] == [f["announced"] for f in faults(o)] for o in others)
        label = sentence(happened[0], reported=alike) if len(happened) == 1 else _together(happened)
        result.append(Line2D([], [], color=RED, linewidth=1.2, label=label))
    if any(reported_later(fault) for fault in happened):
        result.append(Line2D([], [], color=BLUE, linewidth=1.2, linestyle=":", label="reported"))
    return result


def _together(happened: Sequence[dict[str, Any]]) -> str:
    """Several faults in words, short."""
    times = sorted({f"{fault['at']:g} s" for fault in happened}, key=lambda text: float(text[:-2]))
    return f"{len(happened)} joints fail, at {', '.join(times)}"


def heading(log: Log) -> str:
    """What was run, for a title."""
    about = log.metadata
    parts = [str(about.get("scenario") or ""), about.get("robot", "arm")]
    parts += [f"{about['scheme']} scheme" if about.get("scheme") else ""]
    parts += [f"solver {about['backend']}" if about.get("backend") else ""]
    return ", ".join(part for part in parts if part)


def time_span(log: Log) -> tuple[float, float]:
    """First and last time of the log [s]."""
    t = log["t"]
    return float(t[0]), float(max(t[-1], t[0] + 1e-9))


COLOURS = (BLUE, ORANGE, GREEN, "black", SKY, PURPLE, GREY, WINE)
"""Colours of runs and of joints; they come again, dashed, after the last. Red marks faults."""
THIN, STEP, WIDE = 1.3, 2.2, 12.0
"""Width of a curve, what is added for each later run that hides it, and what is added at most [points]."""
ALIKE, MOSTLY = 0.05, 0.95
"""Two curves hide each other when they differ by less than a share for most of the time."""
USUAL, RARE = 99.5, 3.0
"""The frame ends beyond this percentile where the peak is so many times higher."""
SPIKES = " (rare spikes go beyond the frame)"
"""What a title says then."""
STYLES = ("-", "--", ":", "-.")


def draw_runs(axes: Axes, logs: Mapping[str, Log], curves: Sequence[FloatArray]) -> None:
    """One curve a run; those that later ones hide are so much wider that all are seen."""
    nested, step = False, min(STEP, WIDE / max(len(curves) - 1, 1))
    for index, (log, signal) in enumerate(zip(logs.values(), curves, strict=True)):
        colour, style = look(index)
        hidden = sum(_alike(signal, other) for other in curves[index + 1 :])
        nested |= hidden > 0
        curve(axes, log["t"], signal, color=colour, linestyle=style, linewidth=THIN + step * hidden)
        stop = stop_time(log)
        if stop is not None:
            at = int(np.searchsorted(log["t"], stop - REPORTED_LATER))
            axes.plot(stop, signal[at], "o", color=colour, markersize=6.0 + 2.0 * step * hidden, zorder=3)
    axes.set_xlim(*common_span(logs))
    if nested:
        axes.set_title("curves that coincide are drawn one inside the other", loc="right", fontsize=8.5)


def _alike(first: FloatArray, second: FloatArray) -> bool:
    """Whether one curve hides the other: nearly equal nearly everywhere."""
    count = min(len(first), len(second))
    a, b = np.abs(first[:count]), np.abs(second[:count])
    return bool(np.mean(np.abs(a - b) <= ALIKE * np.maximum(a, b)) > MOSTLY)


def frame(curves: Sequence[FloatArray]) -> float:
    """Where the frame ends: above the peak, or above what is usual when the peak is a rare spike."""
    top = peak(curves)
    usual = float(np.nanpercentile(np.abs(np.concatenate([curve.ravel() for curve in curves])), USUAL))
    return 1.3 * usual if top > RARE * usual > 0.0 else 1.08 * top or 1.0


def peak(curves: Sequence[FloatArray]) -> float:
    """The largest absolute value of all; 0 where there is none."""
    return max(float(np.nanmax(np.abs(curve))) if np.isfinite(curve).any() else 0.0 for curve in curves)


def length(metres: float) -> str:
    """A length for a legend."""
    return f"{1e3 * metres:.3g} mm" if metres >= 1e-4 else f"{1e6 * metres:.3g} µm"


def look(index: int) -> tuple[str, Any]:
    """Colour and line style of the run or joint of that index."""
    return COLOURS[index % len(COLOURS)], STYLES[index // len(COLOURS) % len(STYLES)]


def handle(index: int, label: str) -> Line2D:
    """The run or joint of that index, for a legend."""
    colour, style = look(index)
    return Line2D([], [], color=colour, linestyle=style, linewidth=2.0, label=label)


def run_handles(logs: Mapping[str, Log], remarks: Sequence[str]) -> list[Line2D]:
    """What the colours of the runs mean, with a remark on each."""
    handles = []
    for index, ((label, log), remark) in enumerate(zip(logs.items(), remarks, strict=True)):
        stop = stop_time(log)
        parts = [label, remark, "" if stop is None else f"stopped at {stop:.4g} s"]
        handles.append(handle(index, ", ".join(part for part in parts if part)))
    return handles


def logarithmic(axes: Axes, curves: Sequence[FloatArray]) -> None:
    """A logarithmic axis over what is usual and all that is above it; the start from zero is cut off."""
    decades(axes)
    usual = min(float(np.percentile(curve, 1.0)) for curve in curves)
    axes.set_ylim(0.3 * usual, 5.0 * max(float(curve.max()) for curve in curves))


def common_span(logs: Mapping[str, Log]) -> tuple[float, float]:
    """First and last time of all logs [s]."""
    spans = [time_span(log) for log in logs.values()]
    return min(start for start, _ in spans), max(end for _, end in spans)


def longest(logs: Mapping[str, Log]) -> Log:
    """The log that went on longest: all faults of the scenario that happened in any run."""
    return max(logs.values(), key=lambda log: float(log["t"][-1]))
