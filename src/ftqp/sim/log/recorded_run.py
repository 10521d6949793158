"""The QPs that a recorder kept during a simulation, with names and with what the run was about."""

from collections.abc import Mapping
from typing import Any

from ftqp.control.paths import Path
from ftqp.control.planner.labels import row_labels, variable_labels
from ftqp.control.planner.planner import Planner
from ftqp.qp.recording.recorded_qps import Recording
from ftqp.qp.recording.recorder import Recorder
from ftqp.sim.log.description import description
from ftqp.sim.schedule import Schedule


def recorded(
    recorder: Recorder,
    planner: Planner,
    path: Path,
    schedule: Schedule | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> Recording:
    """What ``recorder`` kept while ``planner`` was led along ``path``.

    The metadata are those of a log and ``length``: the rows of rotations are multiplied by this
    characteristic length [m], so that every row counts in metres.
    """
    about = description(planner, Schedule() if schedule is None else schedule, path, planner.tick)
    length = planner.robot.length if planner.task.length is None else planner.task.length
    return recorder.recording(
        dt=planner.dt,
        variables=variable_labels(planner),
        rows=row_labels(planner),
        metadata=about | {"length": float(length)} | dict(metadata or {}),
    )
