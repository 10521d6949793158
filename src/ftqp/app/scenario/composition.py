"""Makes the objects of a run from the tables of a scenario, where more is to do than the tables do."""

from dataclasses import fields
from pathlib import Path as File
from typing import Any

import numpy as np

from ftqp.app.schema.reading import Options, Table, made
from ftqp.app.schema.robot_section import LimitsTable, RobotTable
from ftqp.app.schema.scenario_file import Scenario
from ftqp.control.following.path_follower import PathFollower
from ftqp.control.paths import Path
from ftqp.control.paths.path import Repeated
from ftqp.control.planner.leading_plan import plan_for
from ftqp.control.planner.planner import Planner
from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError
from ftqp.core.setting import keys_of
from ftqp.faults.detection.calibration import Calibration
from ftqp.faults.detection.detector import Detector
from ftqp.model import catalog
from ftqp.model.robot import Robot
from ftqp.model.shape import reach_of

SOURCES = {
    "name": ("options",),
    "dh": ("convention",),
    **dict.fromkeys(("urdf", "mjcf"), ("tip", "tips", "locked")),
}
"""Keys of ``[robot]`` that fit each kind of source ..."""
WITH_ANY = ("acceleration", "limits", "payload", "tool", "viscous", "coulomb", "rotors", "capsules")
"""... and those that fit every one."""


def robot(table: RobotTable, folder: File) -> Robot:
    """The arm of ``[robot]``; files are relative to ``folder``."""
    given = [field.name for field in fields(table) if getattr(table, field.name) is not None]
    source = next(key for key in SOURCES if key in given)
    fitting = (*WITH_ANY, *SOURCES[source])
    if unfit := sorted(set(given) - {source, *fitting}):
        raise InputError(f"{source} does not go with {', '.join(unfit)}; it goes with {', '.join(fitting)}")
    limits = {} if table.limits is None else _per_joint(table.limits, *keys_of(LimitsTable))
    if table.acceleration is not None:
        if "a_max" in limits:
            raise InputError("acceleration and limits.a_max both give acceleration limits; leave one out")
        limits["a_max"] = _per_joint(table, "acceleration")["acceleration"]
    arm = _loaded(table, folder, limits)
    if friction := _per_joint(table, "viscous", "coulomb"):
        arm = arm.with_friction(**friction)
    if table.rotors is not None:
        arm = arm.with_rotors(_per_joint(table, "rotors")["rotors"])
    if table.capsules is not None:
        arm = arm.with_capsules([one.made() for one in table.capsules])
    if table.payload is not None:
        arm = arm.with_payload(table.payload.made())
    return arm if table.tool is None else arm.with_tip(table.tool.pose)


def _per_joint(table: Table, *names: str) -> dict[str, Any]:
    """What is given of one number for all joints, one each, or some by name."""
    given = {name: value for name in names if (value := getattr(table, name)) is not None}
    return {
        name: value[0] if len(value) == 1 and not isinstance(value, dict) else value
        for name, value in given.items()
    }


def _loaded(table: RobotTable, folder: File, limits: dict[str, Any]) -> Robot:
    """The arm as its source has it, with other limits."""
    if table.name is not None:
        options = table.options or {}
        if "name" in options:
            raise InputError("options has name, which is the robot's own key beside them; leave it out")
        return catalog.load(table.name, **options).with_limits(**limits)
    if table.dh is not None:
        return Robot.from_dh(table.dh, table.convention or "standard", limits=limits)
    ends = (table.tip, table.locked or (), table.tips)
    if table.urdf is not None:
        return Robot.from_urdf(folder / table.urdf, *ends, limits=limits)
    return Robot.from_mjcf(folder / str(table.mjcf), *ends, limits=limits)


def detector(given: Options[Detector] | None, folder: File) -> Detector | None:
    """The detector of a table; None without one."""
    if given is None:
        return None
    file = given["calibration"]
    return given.made(calibration=None if file is None else Calibration.load(folder / file))


def plan(tables: Scenario, arm: Robot, folder: File) -> Any:
    """The plan of ``[planner]`` with its arm; None without one."""
    if tables.planner.plan is None:
        return None
    if tables.base is not None:
        raise InputError(
            "a plan is made for a base that stands, and [base] lets it move; leave one of them out"
        )
    from ftqp.analysis.planning.fault_plan import load_plan  # slow to load, needed with a plan only

    return plan_for(load_plan(folder / tables.planner.plan), arm)


def start(arm: Robot, q: Any, v: Any) -> tuple[FloatArray, FloatArray]:
    """The joint positions and velocities at t = 0, (nv,) each."""
    positions = arm.neutral.copy() if q is None else arm.angles(q)
    velocities = np.zeros(arm.nv) if v is None else array("v", v, (arm.nv,), "(nv,)")
    limits, outside = arm.limits, []
    for name, at, low, high in zip(arm.joints, positions, limits.q_min, limits.q_max, strict=True):
        if at < low:
            outside.append(f"{name} starts at {at:.4g}, below its limit {low:.4g}")
        elif at > high:
            outside.append(f"{name} starts at {at:.4g}, above its limit {high:.4g}")
    for name, speed, most in zip(arm.joints, velocities, limits.v_max, strict=True):
        if abs(speed) > most:
            outside.append(f"{name} starts with the speed {speed:.4g}, beyond its limit {most:.4g}")
    if outside:
        raise InputError("; ".join(outside))
    return positions, velocities


def shoulder(arm: Robot) -> tuple[FloatArray, float] | None:
    """The point about which the arm reaches, (3,), and how far it reaches [m]; None where it slides along.

    The height of the second joint along the axis of the first is no part of the reach.
    """
    chain = arm.chain
    way = chain.way(chain.tip_joint)
    first = way[0]
    if chain.prismatic[first]:
        return None
    height = [*chain.translation[way[1:]], chain.tip_translation][0][2]
    return chain.translation[first] + height * chain.rotation[first][:, 2], reach_of(chain, arm.limits)


def refuse_out_of_reach(arm: Robot, way: Path) -> None:
    """Refuses a path that leaves what the stretched arm can reach."""
    found = shoulder(arm)
    if found is None:
        return
    centre, reach = found
    once = min(way.lap, way.duration) if isinstance(way, Repeated) else way.duration
    times = once * np.linspace(0.0, 1.0, 1001)
    with np.errstate(over="ignore"):  # what is infinitely far is out of reach
        distance = np.linalg.norm(way.sample(times).pose[:, :3, 3] - centre, axis=1)
    beyond = distance > reach * (1.0 + 1e-9)
    if beyond.any():
        at = int(np.argmax(beyond))
        raise InputError(
            f"at t = {times[at]:.3g} s the path is {distance[at]:.4g} m from {arm.joints[0]}, out of reach: "
            f"the stretched arm is {reach:.4g} m long; allow it by path.beyond_reach = true"
        )


def follower(tables: Scenario, planner: Planner, way: Path) -> PathFollower | None:
    """What leads the planner along the path by its progress; None where the clock does."""
    reference = tables.path.reference or ("progress" if planner.task.mode == "scaled" else "time")
    own = tables.planner
    if reference == "time":
        if own.bridges or own.leave:
            given = "bridges is true" if own.bridges else f"leave is {own.leave:g}"
            raise InputError(
                f"planner.{given} and the path runs by the clock; expected reference = 'progress' "
                "with planner.task.mode = 'scaled': only such a path waits while a bridge is gone"
            )
        return None
    return PathFollower(planner, way, stall=made(own.stall), bridges=own.bridges, leave=own.leave)
