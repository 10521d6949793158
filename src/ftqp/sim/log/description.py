"""What a log says about its run: robot, limits, faults and versions, in values that JSON can hold."""

import platform
from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from importlib import metadata
from math import isfinite
from typing import Any

import numpy as np

from ftqp import __version__
from ftqp.control.paths import Path
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.planner_view import row_labels, variable_labels
from ftqp.control.planner.running_task import RunningTask
from ftqp.control.scene.solid_shapes import WORDS, Hull
from ftqp.control.task.keep import BOX, CONE, KINDS, TorqueLimits
from ftqp.control.task.own_task import LeastSquares, OwnConstraint, OwnTask, Rows
from ftqp.control.task.soft_tasks import FIRST, PositionTask
from ftqp.core.checks import FloatArray
from ftqp.model.chain import Skeleton
from ftqp.model.frames import mount_of
from ftqp.model.robot import Robot
from ftqp.qp.recording.recorded_qps import Recorder, Recording
from ftqp.sim.further_measures import FurtherMeasures
from ftqp.sim.log.signals import ITSELF, TASKS
from ftqp.sim.schedule import FaultEvent, Schedule

PACKAGES = ("numpy", "scipy", "pin")
KIND_OF = {kind: word for word, kind in KINDS.items()} | {LeastSquares: "least_squares"}
"""What a log calls the kinds of soft tasks."""


def description(
    planner: Planner, schedule: Schedule, path: Path, last: int, reference: str = "time"
) -> dict[str, Any]:
    """Metadata of a run; limits that are infinite are ``None``."""
    robot, emergency = planner.robot, planner.emergency
    return {
        "robot": robot.name,
        "joints": list(robot.joints),
        "prismatic": [bool(slides) for slides in robot.chain.prismatic],
        "skeleton": Skeleton.of(robot.chain).facts(),
        "limits": {
            name: _json(getattr(robot.limits, name))
            for name in ("q_min", "q_max", "v_max", "a_max", "tau_max")
        },
        "scheme": planner.scheme.name,
        "backend": planner.backend,
        "level": planner.level,
        "task_mode": planner.task.mode,
        "emergency": None
        if emergency is None
        else {"position": emergency.position, "rotation": emergency.rotation},
        "dt": planner.dt,
        "ticks": last + 1,
        "path": type(path).__name__,
        "duration": last * planner.dt,
        "path_duration": path.duration,
        "reference": reference,
        "faults": [described(event, robot) for event in schedule],
        **further_about(planner),
        "versions": versions(),
    }


def further_about(planner: Planner, q: FloatArray | None = None) -> dict[str, Any]:
    """Soft tasks and kept points as they were given, each where the planner has any.

    ``unit`` is that of a task's error, ``place`` where the target of one that has a place is [m].
    ``kind`` is what it is kept to, ``joint`` the one that a kept point moves with, and ``at_zero`` where the
    point is while all joints are at 0, in the base frame [m]; of a cone ``axis_at_zero`` is the axis then.
    Whoever has the arm finds it by that, whatever frames it knows.
    """
    robot = planner.robot
    result: dict[str, Any] = {}
    if planner.tasks:
        measures = FurtherMeasures(planner)
        units = {one.name: one.unit for one in measures.columns}
        own: dict[str, dict[str, Any]] = {
            name: {"unit": units[signal]} for name in planner.tasks if (signal := f"{TASKS}.{name}") in units
        }
        for name, place in measures.places(planner.view().command.q if q is None else q).items():
            own[name]["place"] = place.tolist()
        result["tasks"] = [
            {
                "name": name,
                "kind": KIND_OF.get(type(task.given), type(task.given).__name__),
                **own.get(name, {}),
                **_settings(task.given),
                **_mounted(robot, task),
            }
            for name, task in planner.tasks.items()
        ]
    if planner.constraints:
        found: list[dict[str, Any]] = []
        result["constraints"] = found
        for kept in planner.constraints.values():
            keep = kept.given
            if isinstance(keep, TorqueLimits):
                found.append({"name": keep.label, "kind": "torque"})
                continue
            if isinstance(keep, OwnConstraint):
                own_unit = {"unit": keep.unit} if keep.unit else {}
                own_kind = {} if isinstance(keep, Rows) else {"of": type(keep).__name__}
                rows = {"kind": "rows", "rows": keep.count}
                found.append({"name": keep.label, **own_unit, **_settings(keep), **own_kind, **rows})
                continue
            T = robot.pose(np.zeros(robot.nv), keep.frame)
            point = np.zeros(3) if keep.shape == CONE else keep.point
            found.append(
                {
                    **_settings(keep),
                    "name": keep.label,
                    "kind": keep.shape,
                    "joint": robot.joints[mount_of(robot, keep.frame)[0]],
                    "at_zero": (T[:3, :3] @ point + T[:3, 3]).tolist(),
                }
            )
            if keep.shape == CONE:
                found[-1]["axis_at_zero"] = (T[:3, :3] @ keep.axis).tolist()
            elif keep.shape == BOX:  # no number of a file is infinite
                found[-1]["inside"] = [
                    [place if isfinite(place) else None for place in corner]
                    for corner in keep.inside.tolist()
                ]
    if planner.scene is not None:
        result |= _surroundings(planner)
    return result


def _surroundings(planner: Planner) -> dict[str, Any]:
    """What stands around the arm, and its bodies, as whoever has the arm can find them.

    ``scene`` has the kind, extent [m] and pose of each thing, and the corners of a hull, ``bodies`` the
    capsules: the joint that each moves with, None is none, and where its ends, and the corners of the convex
    body inside if that is known, are while all joints are at 0, in the base frame [m].
    """
    robot, scene, clearance = planner.robot, planner.scene, planner.clearance
    assert scene is not None and clearance is not None
    zero, words = np.zeros(robot.nv), {kind: word for word, kind in WORDS.items()}
    bodies = []
    for one in robot.capsules:
        T, joint = robot.pose(zero, one.frame), mount_of(robot, one.frame or "universe")[0]
        ends = [(T[:3, :3] @ end + T[:3, 3]).tolist() for end in (one.a, one.b)]
        at = robot.joints[joint] if joint >= 0 else None
        body = {"name": one.label, "joint": at, "ends_at_zero": ends, "radius": one.radius}
        if one.corners is not None:
            body["corners_at_zero"] = (one.corners @ T[:3, :3].T + T[:3, 3]).tolist()
        bodies.append(body)
    things = [
        {
            "name": name,
            "kind": words[type(placed.shape)],
            "extent": list(placed.shape.extent),
            "pose": placed.place.tolist(),
        }
        | ({"corners": placed.shape.corners.tolist()} if isinstance(placed.shape, Hull) else {})
        for name, placed in scene.items()
    ]
    watched = sorted({tuple(names) for names in planner.distances(robot.neutral)})
    return {
        "scene": [*things, {"name": ITSELF, "kind": "arm"}],
        "bodies": bodies,
        "watched": [list(names) for names in watched],
        "clearance": {"keep": clearance.keep, "stop": clearance.stop},
    }


def _mounted(robot: Robot, task: RunningTask) -> dict[str, Any]:
    """Of a task that OK claims: the joints of its frames, their poses with joints at 0, its target now."""
    given, found = task.given, dict[str, Any]()
    meant = given.counts or (given.level == FIRST and given.required is None)
    if not meant or isinstance(given, OwnTask):
        return found
    other = getattr(given, "to", None) or getattr(given, "towards", None)
    for prefix, frame in (("", getattr(given, "frame", None)), ("other_", other)):
        if isinstance(frame, str):
            body, T = mount_of(robot, frame)[0], robot.pose(np.zeros(robot.nv), frame).copy()
            if not prefix and isinstance(given, PositionTask):
                T[:3, 3] += T[:3, :3] @ given.point
            found[f"{prefix}joint"] = None if body < 0 else robot.joints[body]
            found[f"{prefix}at_zero"] = T.tolist()
    found["goal"] = task.target.tolist()
    return found


def _settings(given: Any) -> dict[str, Any]:
    """The settings of a task or constraint that a file can hold."""
    result = {}
    for setting in fields(given):
        value = getattr(given, setting.name)
        if isinstance(value, Mapping):
            value = {str(key): float(one) for key, one in value.items()}
        elif isinstance(value, tuple | list) and all(isinstance(one, str) for one in value):
            value = list(value)
        elif not isinstance(value, str | int | float | None):
            value = None if callable(value) else np.asarray(value, dtype=np.float64).tolist()
        if value is not None and setting.name != "name":
            result[setting.name] = value
    return result


def described(event: FaultEvent, robot: Robot) -> dict[str, Any]:
    """A fault event by name, with its settings; ``announced`` is ``None`` where it is never reported."""
    fault = event.fault
    index = robot.joint(fault.joint)
    result: dict[str, Any] = {
        "kind": fault.kind,
        "joint": robot.joints[index],
        "index": index,
        "at": event.at,
        "announced": event.reported_at,
    }
    for setting in fields(fault):
        if setting.name != "joint":
            value = getattr(fault, setting.name)
            result[setting.name] = value if isinstance(value, str) else _finite(value)
    return result


def versions() -> dict[str, str]:
    """Versions of what took part in a run."""
    return dict(_installed())


@cache
def _installed() -> dict[str, str]:
    """The same, looked up once in a process: that takes milliseconds."""
    found = {"python": platform.python_version(), "ftqp": __version__}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed as a package"
    return found


def _finite(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else float(value)


def _json(values: FloatArray) -> list[float | None]:
    return [_finite(float(value)) for value in values]


def recorded(
    recorder: Recorder,
    planner: Planner,
    path: Path,
    schedule: Schedule | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> Recording:
    """What ``recorder`` kept while ``planner`` was led along ``path``."""
    about = description(planner, Schedule() if schedule is None else schedule, path, planner.tick)
    length = planner.robot.length if planner.task.length is None else planner.task.length
    return recorder.recording(
        dt=planner.dt,
        variables=variable_labels(planner),
        rows=row_labels(planner),
        metadata=about | {"length": float(length)} | dict(metadata or {}),
    )
