"""What a log says about its run: robot, limits, faults and versions, in values that JSON can hold."""

import platform
import sqlite3
from dataclasses import fields
from functools import cache
from importlib import metadata
from typing import Any

import numpy as np

from ftqp.control.paths import Path
from ftqp.control.planner.planner import Planner
from ftqp.core.checks import FloatArray
from ftqp.model.robot import Robot
from ftqp.model.skeleton import Skeleton
from ftqp.sim.schedule import FaultEvent, Schedule

PACKAGES = ("ftqp", "numpy", "scipy", "pin")


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
        "versions": versions(),
    }


def described(event: FaultEvent, robot: Robot) -> dict[str, Any]:
    """A fault event by name, with its settings; ``announced`` is ``None`` when the planner is never told."""
    fault = event.fault
    index = robot.joint(fault.joint)
    result: dict[str, Any] = {
        "kind": fault.kind,
        "joint": robot.joints[index],
        "index": index,
        "at": event.at,
        "announced": event.told,
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
    found = {"python": platform.python_version(), "sqlite": sqlite3.sqlite_version}
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
