"""The instants that every figure marks: a joint fails, the planner is told or finds out, the arm stops."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ftqp.control.planner.status import STATUSES, StepStatus
from ftqp.faults.kinds import KINDS
from ftqp.sim.log.log_arrays import Log
from ftqp.viz.figures.canvas import Axes, Line2D
from ftqp.viz.figures.palette import BLUE, RED

TOLD_LATER = 1e-6
"""An announcement at least this much after its fault is marked by itself [s]."""


def faults(log: Log) -> list[dict[str, Any]]:
    """The faults that happened within the log, first to last."""
    end = float(log["t"][-1]) if len(log) else -1.0
    return [fault for fault in log.metadata.get("faults", []) if fault["at"] <= end + TOLD_LATER]


def told_later(fault: dict[str, Any]) -> bool:
    """Whether the planner was told, but not at once."""
    return fault["announced"] is not None and fault["announced"] - fault["at"] > TOLD_LATER


def found_at(log: Log) -> list[float]:
    """When the planner's detector found what it believed [s]."""
    return [float(found["detected_at"]) for found in log.metadata.get("detections") or ()]


def sentence(fault: dict[str, Any], *, told: bool = True) -> str:
    """One fault in words, with when the planner is told of it or without."""
    if not told:
        return f"{fault['joint']} {KINDS[fault['kind']].happens} at {fault['at']:g} s"
    if fault["announced"] is None:
        heard = " (planner never told)"
    elif told_later(fault):
        heard = f" (planner told at {fault['announced']:g} s)"
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
    """Draw when joints fail, and when the planner is told, as vertical lines."""
    for fault in faults(log):
        axes.axvline(fault["at"], color=RED, linewidth=1.2)
        if told_later(fault):
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
    """What the lines of the faults mean, for a legend; others may have been told at other times."""
    happened = faults(log)
    result = []
    if happened:
        alike = all([f["announced"] for f in happened] == [f["announced"] for f in faults(o)] for o in others)
        label = sentence(happened[0], told=alike) if len(happened) == 1 else _together(happened)
        result.append(Line2D([], [], color=RED, linewidth=1.2, label=label))
    if any(told_later(fault) for fault in happened):
        result.append(Line2D([], [], color=BLUE, linewidth=1.2, linestyle=":", label="planner is told"))
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
