"""Makes the objects of a run from the tables of a scenario, one function a table."""

from math import floor, hypot
from pathlib import Path as File
from typing import TYPE_CHECKING, Any

import numpy as np

from ftqp.app.schema.fault_sections import AnyFaultTable
from ftqp.app.schema.path_section import (
    CircleTable,
    HoldTable,
    LineTable,
    LissajousTable,
    PathTable,
    PointToPointTable,
    SquareTable,
    WaypointsTable,
)
from ftqp.app.schema.planner_section import DetectorTable, EmergencyTable, StallTable, TaskTable
from ftqp.app.schema.robot_section import PayloadTable, RobotTable
from ftqp.app.schema.scenario_file import RecordingTable, Scenario
from ftqp.app.schema.strict import Table
from ftqp.control.following.path_follower import PathFollower
from ftqp.control.following.stall import StallEscape
from ftqp.control.paths import Circle, Hold, Line, Lissajous, Path, PointToPoint, Square, Waypoints
from ftqp.control.paths.repeated import Repeated
from ftqp.control.planner.planner import Planner
from ftqp.control.task.directional_damping import DirectionalDamping
from ftqp.control.task.emergency import EmergencyStop
from ftqp.control.task.task import Task
from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError
from ftqp.core.pose import transform
from ftqp.faults.detection.calibration import Calibration
from ftqp.faults.detection.detector import Detector
from ftqp.faults.kinds import kind_of
from ftqp.model import catalog
from ftqp.model.payload import Payload
from ftqp.model.robot import Robot
from ftqp.model.shape import reach_of
from ftqp.qp import Backend, Recorder
from ftqp.sim.schedule import TIME_SLACK, FaultEvent, first_tick
from ftqp.sim.waypoint_file import waypoint_table

if TYPE_CHECKING:
    from ftqp.analysis.planning.fault_plan import Plan

_FITTING = {"name": ("options",), "dh": ("convention",), "urdf": ("tip", "locked"), "mjcf": ("tip", "locked")}
"""Keys of ``[robot]`` that fit each kind of source ..."""
_WITH_ANY = ("acceleration", "limits", "payload", "tool", "viscous", "coulomb")
"""... and those that fit every one."""


def robot(table: RobotTable, folder: File) -> Robot:
    """The arm of ``[robot]``; files are relative to ``folder``.

    Raises:
        InputError: An unknown name, file, tip or joint, or a key that this kind of robot does not take.
        ModelError: The robot is unsafe.
    """
    source = next(key for key in ("name", "urdf", "mjcf", "dh") if getattr(table, key) is not None)
    fitting = (source, *_WITH_ANY, *_FITTING[source])
    strange = set(RobotTable.model_fields) - set(fitting)
    if unfit := sorted(key for key in strange if getattr(table, key) is not None):
        raise InputError(
            f"{source} does not go with {', '.join(unfit)}; it goes with {', '.join(fitting[1:])}"
        )
    changes = {} if table.limits is None else _settings(table.limits)
    if table.acceleration is not None:
        if changes.get("a_max") is not None:
            raise InputError("acceleration and limits.a_max both give acceleration limits; leave one out")
        changes["a_max"] = table.acceleration
    limits = {
        key: value[0] if len(value) == 1 else value for key, value in changes.items() if value is not None
    }
    return _fitted(_loaded(table, folder, limits), table)


def _loaded(table: RobotTable, folder: File, limits: dict[str, Any]) -> Robot:
    """The arm as its source has it, with other limits."""
    if table.name is not None:
        if "name" in (table.options or {}):
            raise InputError("options has name, which is the robot's own key beside them; leave it out")
        return catalog.load(table.name, **(table.options or {})).with_limits(**limits)
    if table.dh is not None:
        return Robot.from_dh(table.dh, table.convention or "standard", limits=limits)
    if table.urdf is not None:
        return Robot.from_urdf(folder / table.urdf, table.tip, table.locked or (), limits=limits)
    return Robot.from_mjcf(folder / str(table.mjcf), table.tip, table.locked or (), limits=limits)


def _fitted(arm: Robot, table: RobotTable) -> Robot:
    """The arm with the friction, the load and the tool of its table."""
    rub = {
        key: value[0] if len(value) == 1 else value
        for key in ("viscous", "coulomb")
        if (value := getattr(table, key)) is not None
    }
    if rub:
        arm = arm.with_friction(**rub)
    if table.payload is not None:
        arm = arm.with_payload(payload(table.payload))
    if table.tool is not None:
        arm = arm.with_tip(
            transform(quaternion_rotation(table.tool.orientation), np.array(table.tool.position))
        )
    return arm


def detector(table: DetectorTable | None, folder: File) -> Detector | None:
    """The detector of a table; None without one.

    Raises:
        InputError: Settings out of their range, or a calibration that cannot be read.
    """
    if table is None:
        return None
    slow, fast = table.bandwidths
    return Detector(
        bandwidths=(slow, fast),
        patience=table.patience,
        quantum=table.quantum,
        probe_after=table.probe_after,
        calibration=None if table.calibration is None else Calibration.load(folder / table.calibration),
    )


def plan(tables: Scenario, arm: Robot, folder: File) -> "Plan | None":
    """The plan of ``[planner]`` with its arm; None without one.

    Raises:
        InputError: The file is no plan or one of another arm, or the base moves.
    """
    if tables.planner.plan is None:
        return None
    if tables.base is not None:
        raise InputError(
            "a plan is made for a base that stands, and [base] lets it move; leave one of them out"
        )
    from ftqp.analysis.planning.fault_plan import load_plan  # slow to load, needed with a plan only

    return load_plan(folder / tables.planner.plan, arm)


def payload(table: PayloadTable) -> Payload:
    """The load of a table."""
    return Payload(table.mass, table.com)


def _settings(table: Table, *without: str) -> dict[str, Any]:
    """The fields of ``table`` as keyword arguments."""
    return {key: getattr(table, key) for key in type(table).model_fields if key not in without}


def start(arm: Robot, q: list[float] | None, v: list[float] | None) -> tuple[FloatArray, FloatArray]:
    """The joint positions and velocities at t = 0, (nv,) each.

    Raises:
        InputError: a wrong shape; a joint outside its limits, named with the limit.
    """
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


def path(table: PathTable, origin: FloatArray, folder: File) -> Path:
    """The path of ``[path]`` from the pose ``origin``, (4, 4).

    Raises:
        InputError: a parameter out of its range, or a waypoint file that cannot be used.
    """
    once = _once(table, origin, folder)
    return once if table.laps is None else Repeated(once, table.laps)


def _once(table: PathTable, origin: FloatArray, folder: File) -> Path:
    """The path without its laps."""
    settings = _settings(table, "kind", "reference", "laps", "beyond_reach")
    match table:
        case LineTable():
            return Line(origin, **settings)
        case SquareTable():
            return Square(origin, **settings)
        case CircleTable():
            return Circle(origin, **settings)
        case LissajousTable():
            return Lissajous(origin, **settings)
        case WaypointsTable():
            points = waypoint_table(folder / table.file)
            if table.duration is not None and points.times is not None:
                raise InputError(f"{table.file} has times, so duration cannot hold as well; leave it out")
            return Waypoints(
                origin,
                points.positions,
                orientations=points.orientations,
                times=points.times,
                duration=table.duration,
                relative=table.relative,
            )
        case HoldTable():
            return Hold(origin, **settings)
        case PointToPointTable():
            return PointToPoint(origin, _goal(table, origin), duration=table.duration, law=table.law)


def _goal(table: PointToPointTable, origin: FloatArray) -> FloatArray:
    position, rotation = origin[:3, 3], origin[:3, :3]
    if table.position is not None:
        position = np.array(table.position) + (position if table.relative else 0.0)
    if table.orientation is not None:
        turn = quaternion_rotation(table.orientation)
        rotation = turn @ rotation if table.relative else turn
    return transform(rotation, position)


def quaternion_rotation(quaternion: list[float]) -> FloatArray:
    """R, (3, 3), of a unit quaternion x, y, z, w."""
    length = hypot(*quaternion)
    if abs(length - 1.0) > 1e-3:
        raise InputError(f"orientation has the length {length:.4g}, expected a unit quaternion x, y, z, w")
    from scipy.spatial.transform import Rotation  # slow to load, needed with an orientation only

    return np.asarray(Rotation.from_quat(quaternion).as_matrix())


def shoulder(arm: Robot) -> tuple[FloatArray, float] | None:
    """The point about which the arm reaches, (3,), and how far it reaches [m]; None where it slides along.

    The height of the second joint along the axis of the first is no part of the reach.
    """
    chain = arm.chain
    if chain.prismatic[0]:
        return None
    height = [*chain.translation[1:], chain.tip_translation][0][2]
    return chain.translation[0] + height * chain.rotation[0][:, 2], reach_of(chain, arm.limits)


def refuse_out_of_reach(arm: Robot, way: Path) -> None:
    """Refuses a path that leaves what the stretched arm can reach.

    Raises:
        InputError: The first time at which the path is farther from the first joint than the arm is long.
    """
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


def task(table: TaskTable) -> Task:
    """The task of ``[planner.task]``.

    Raises:
        InputError: Unknown rows, or an axis without a direction.
    """
    x, y, z = table.axis
    rows = tuple(table.rows) if isinstance(table.rows, list) else table.rows
    damping = None if table.damping is None else DirectionalDamping(**_settings(table.damping))
    return Task(rows=rows, axis=(x, y, z), damping=damping, **_settings(table, "rows", "axis", "damping"))


def emergency(table: EmergencyTable | None) -> EmergencyStop | None:
    """The emergency stop of ``[planner.emergency]``; None: off."""
    return None if table is None else EmergencyStop(**_settings(table))


def follower(table: PathTable, stall: StallTable | None, planner: Planner, way: Path) -> PathFollower | None:
    """What leads the planner along the path by its progress; None where the clock does.

    Raises:
        InputError: The path is to run by its progress, but the task mode is not ``scaled``.
    """
    reference = table.reference or ("progress" if planner.task.mode == "scaled" else "time")
    if reference == "time":
        return None
    if stall is None:
        return PathFollower(planner, way, stall=None)
    escape = StallEscape(patterns=tuple(stall.patterns), **_settings(stall, "patterns"))
    return PathFollower(planner, way, stall=escape)


def fault(table: AnyFaultTable) -> FaultEvent:
    """What fails, and when.

    Raises:
        InputError: a parameter out of its range.
    """
    made = kind_of(table.kind)(**_settings(table, "kind", "at", "announced"))
    return FaultEvent(made, at=table.at, announced=table.announced)


def recorder(backend: Backend, table: RecordingTable, dt: float) -> Recorder:
    """``backend`` with a copy kept of what ``[recording]`` asks for; times become ticks of ``dt``.

    Raises:
        InputError: No tick lies between begin and end.
    """
    first = first_tick(table.begin, dt)
    last = None if table.end is None else floor((table.end + TIME_SLACK) / dt)
    if last is not None and last < first:
        raise InputError(
            f"no tick of {dt:g} s lies between begin, {table.begin:g} s, and end, {table.end:g} s"
        )
    return Recorder(backend, every=table.every, limit=table.limit, first=first, last=last)
