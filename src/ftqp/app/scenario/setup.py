"""A scenario, resolved: from a file to robot, planner, path and faults of a run, or to all errors at once."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path as File
from re import sub
from typing import Any, TypeVar

import numpy as np

from ftqp.app.scenario import document
from ftqp.app.schema.reading import Options, Table, made, plain, read
from ftqp.app.schema.robot_section import LimitsTable, RobotTable
from ftqp.app.schema.scenario_file import FaultTable, PlannerTable, Scenario
from ftqp.control.drive.joint_drive import Drive
from ftqp.control.following.goto import GoTo
from ftqp.control.following.path_follower import PathFollower
from ftqp.control.paths import Path
from ftqp.control.paths.path import Repeated
from ftqp.control.planner.detector import Detector
from ftqp.control.planner.leading_plan import plan_for
from ftqp.control.planner.planner import Planner
from ftqp.control.scene.placed_shapes import Scene
from ftqp.control.scene.solid_shapes import WORDS, Shape
from ftqp.control.task import bounds, schemes
from ftqp.core.checks import FloatArray, array, instance
from ftqp.core.errors import InputError, MissingPackage, ModelError, ScenarioError
from ftqp.core.setting import keys_of
from ftqp.faults.calibration import Calibration
from ftqp.model import catalog
from ftqp.model.robot import Robot
from ftqp.model.shape import reach_of
from ftqp.qp import Recorder
from ftqp.qp import backend as qp_backend
from ftqp.sim.base.moving_world import MovingWorld
from ftqp.sim.loop import Simulation
from ftqp.sim.plants.plant import Plant
from ftqp.sim.schedule import FaultEvent, Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors

SOURCES = {
    "name": ("options",),
    "dh": ("convention",),
    **dict.fromkeys(("urdf", "mjcf"), ("tip", "tips", "locked")),
}
"""Keys of ``[robot]`` that fit each kind of source ..."""
WITH_ANY = ("acceleration", "limits", "payload", "tool", "viscous", "coulomb", "rotors", "capsules")
"""... and those that fit every one."""

IN_A_SCENARIO = (
    r"robot\.with_limits\((\w+)=\.\.\.\)",
    r"--set robot.limits.\1=..., or limits = { \1 = ... } of [robot]",
)
"""How a remedy of Python is spelled where a scenario says what the arm is."""


def arm_from(table: RobotTable, folder: File) -> Robot:
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
            raise InputError("options has name, which is the robot's own key, next to them; leave it out")
        return catalog.load(table.name, **options).with_limits(**limits)
    if table.dh is not None:
        return Robot.from_dh(table.dh, table.convention or "standard", limits=limits)
    ends = (table.tip, table.locked or (), table.tips)
    if table.urdf is not None:
        return Robot.from_urdf(folder / table.urdf, *ends, limits=limits)
    return Robot.from_mjcf(folder / str(table.mjcf), *ends, limits=limits)


def _detector(given: Options[Detector] | bool | None, folder: File) -> Detector | bool | None:
    """The detector of a table; what stands in place of one as it is."""
    if not isinstance(given, Options):
        return Detector() if given else given
    file = given["calibration"]
    return given.made(calibration=None if file is None else Calibration.load(folder / file))


def _drive(given: Options[Drive], folder: File) -> Drive:
    """The drive of a table, what is known of it in a file relative to ``folder``."""
    file = given["known"]
    return given.made(known=None if file is None else folder / file)


def _plan(tables: Scenario, arm: Robot, folder: File) -> Any:
    """The plan of ``[planner]`` with its arm; None without one."""
    if tables.planner.plan is None:
        return None
    if tables.base is not None:
        raise InputError(
            "a plan is made for a base that stands, and [base] lets it move; leave one of them out"
        )
    from ftqp.analysis.planning.fault_plan import load_plan  # slow to load, needed with a plan only

    return plan_for(load_plan(folder / tables.planner.plan), arm)


def _start(arm: Robot, q: Any, v: Any) -> tuple[FloatArray, FloatArray]:
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
    """The point about which the arm reaches, (3,), and how far it reaches [m]; None where it slides along."""
    chain = arm.chain
    way = chain.way(chain.tip_joint)
    first = way[0]
    if chain.prismatic[first]:
        return None
    height = [*chain.translation[way[1:]], chain.tip_translation][0][2]
    return chain.translation[first] + height * chain.rotation[first][:, 2], reach_of(chain, arm.limits)


def _refuse_out_of_reach(arm: Robot, way: Path) -> None:
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


def _follower(tables: Scenario, planner: Planner, way: Path) -> PathFollower | GoTo | None:
    """What leads the planner along the path by its progress, or to its end; None where the clock does."""
    reference = tables.path.reference or ("progress" if planner.task.mode == "scaled" else "time")
    own = tables.planner
    if reference == "goal":
        return GoTo(planner, pose=way.sample(np.array([way.duration])).pose[0])
    if reference == "time":
        if own.bridges or own.leave:
            given = "bridges is true" if own.bridges else f"leave is {own.leave:g}"
            raise InputError(
                f"planner.{given} and the path runs by the clock; expected reference = 'progress' "
                "with planner.task.mode = 'scaled': only such a path waits while a bridge is gone"
            )
        return None
    return PathFollower(planner, way, stall=made(own.stall), bridges=own.bridges, leave=own.leave)


T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """Everything a run needs."""

    name: str  # Names the run
    folder: File  # Where relative paths start
    tables: Scenario  # The scenario with every default filled in
    robot: Robot  # The arm
    planner: Planner  # Reset to the start
    path: Path  # What the tip follows
    schedule: Schedule  # What really fails
    q: FloatArray  # Joint positions at t = 0, (nv,) [rad or m]
    v: FloatArray  # Joint velocities at t = 0, (nv,) [rad/s or m/s]
    duration: float | None  # End of the run [s]; None where the path's progress ends it
    plant: Plant  # What stands for the arm
    sensors: JointSensors | None = None  # What is measured of it, or None where the truth is
    # Leads the planner by the path's progress or to its end, or None
    follower: PathFollower | GoTo | None = None
    world: MovingWorld | None = None  # The base, where it moves
    recorder: Recorder | None = None  # The planner's backend when its QPs are recorded

    @property
    def content(self) -> dict[str, Any]:
        """The scenario as plain tables, its files with absolute paths."""
        content: dict[str, Any] = plain(self.tables, self.folder)
        return content

    @property
    def toml(self) -> str:
        """The scenario as a TOML file in which no default is left out."""
        return document.toml(self.content)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is doubtful of the scenario, in sentences."""
        takes, drive = self.tables.simulation.takes_velocity, self.planner.drive
        if takes is None or drive.kind != "position" or takes == drive.takes_velocity:
            return ()
        where = f"simulation.{self.tables.simulation.plant}"
        return (
            f"planner.drive.takes_velocity is {drive.takes_velocity}, and that of {where} {takes}: the drive "
            "is not that of the plant; give both the same, or leave it so as a test",
        )

    def refuse_tables(self, command: str, *keys: str) -> None:
        """Refuse what a command would leave out of sight."""
        for key in keys:
            if getattr(self.tables, key):
                raise InputError(
                    f"scenario {self.name} has [[{key}]], which {command} does not look at; leave them out "
                    f"by --set {key}=[], and run what it finds with them"
                )

    def simulation(self, **settings: Any) -> Simulation:
        """The run, ready to be simulated."""
        return Simulation(
            self.planner,
            self.path,
            q=self.q,
            v=self.v,
            schedule=self.schedule,
            plant=self.plant,
            sensors=self.sensors,
            world=self.world,
            follower=self.follower,
            duration=self.duration,
            feed_forward=self.tables.simulation.feed_forward,
            **settings,
        )


def load(
    source: str,
    overrides: Iterable[str] = (),
    *,
    backend: str | None = None,
    scheme: str | None = None,
    record: bool = False,
    plan: File | None = None,
) -> Setup:
    """The run that a scenario describes.

    Args:
        source: a path or a bundled name.
        overrides: ``a.b=value`` each, put into the scenario before it is checked.
        backend: Name, profile file or TOML table that replaces the scenario's backend.
        scheme: Name or TOML table that replaces the scenario's scheme.
        record: Keep the planner's QPs, those that ``[recording]`` asks for.
        plan: A file of a plan that leads the planner's null space, in place of the scenario's.

    Raises:
        ScenarioError: The scenario is wrong; carries every error.
    """
    instance("source", source, str | File, "the path of a scenario or the name of a bundled one")
    found = document.read(source, chosen(overrides, backend, scheme, plan))
    return resolve(found, validated(found), record=record)


def chosen(
    overrides: Iterable[str], backend: str | None, scheme: str | None, plan: str | File | None
) -> list[str]:
    """Overrides that put a backend or profile, a scheme and a plan in place of a scenario's, too."""
    choices = list(overrides)
    if backend is not None and backend.endswith(".toml"):
        choices += ["planner.backend=", f"planner.profile={File(backend).resolve()}"]
    elif backend is not None:
        choices += ["planner.profile=", f"planner.backend={backend}"]
    if scheme is not None:
        choices.append(f"planner.scheme={scheme}")
    if plan is not None:
        choices.append(f"planner.plan={File(plan).resolve()}")
    return choices


def validated(found: document.Document) -> Scenario:
    """The tables of a scenario, each checked by itself."""
    return read(Scenario, found.content, f"{found.origin} has errors:")


def scene_of(shapes: Sequence[Shape]) -> Scene:
    """A scene of some shapes; those without a name are called by what they are: ``box``, ``box 2``."""
    scene, counts = Scene(), dict[str, int]()
    for shape in shapes:
        word = next(word for word, kind in WORDS.items() if isinstance(shape, kind)).replace("_", " ")
        counts[word] = counts.get(word, 0) + (shape.name is None)
        scene.add(shape.name or (word if counts[word] == 1 else f"{word} {counts[word]}"), shape)
    return scene


def _shape(one: Options[Shape], folder: File) -> Shape:
    """Something that stands in a scene; the file of a mesh is relative to ``folder``."""
    file = one.values.get("mesh")
    return one.made(mesh=str(folder / file)) if file else one.made()


class _Errors:
    """Collects what is wrong, so that one answer has all of it."""

    def __init__(self) -> None:
        self.found: list[str] = []

    def collect(self, place: str, make: Callable[[], T]) -> T | None:
        """What is made, or None where that is an error, which is noted as one of ``place``."""
        try:
            return make()
        except (InputError, ModelError, MissingPackage) as error:
            told = (isinstance(error, ModelError) and error.findings) or (str(error),)
            self.found += [f"{place}: {sub(*IN_A_SCENARIO, one)}" for one in told]
        return None


def resolve(
    found: document.Document,
    tables: Scenario,
    *,
    record: bool = False,
    arms: Callable[[RobotTable, File], Robot] = arm_from,
) -> Setup:
    """The objects that the tables stand for."""
    errors, folder, dt = _Errors(), found.folder, tables.planner.dt
    arm = errors.collect("robot", lambda: arms(tables.robot, folder))
    settings = _planner_settings(tables.planner, folder, errors)
    soft = [errors.collect(f"tasks[{k}]", partial(made, one)) for k, one in enumerate(tables.tasks)]
    settings["tasks"] = soft
    kept = [errors.collect(f"constraints[{k}]", one.made) for k, one in enumerate(tables.constraints)]
    settings["constraints"] = kept
    tried = [
        errors.collect(f"scene[{k}]", partial(_shape, one, folder)) for k, one in enumerate(tables.scene)
    ]
    around = [shape for shape in tried if shape is not None]
    if around:
        settings["scene"] = errors.collect("scene", partial(scene_of, around))
    if tables.clearance is not None:
        settings["clearance"] = errors.collect("clearance", tables.clearance.made)
    recorder: Recorder | None = None
    if record and settings["backend"] is not None:
        backend = settings["backend"]
        recorder = errors.collect("recording", lambda: tables.recording.recorder(backend, dt))
        settings["backend"] = recorder
    plant = (
        None
        if arm is None
        else errors.collect("simulation", partial(_plant, tables, arm, settings.get("scene")))
    )
    sensors = None if arm is None else errors.collect("sensors", partial(_sensors, tables, arm))
    events = [
        errors.collect(f"faults[{index}]", partial(_event, table, plant))
        for index, table in enumerate(tables.faults)
    ]
    if arm is None:
        raise ScenarioError(f"{found.origin} has errors:", errors.found)
    led = errors.collect("planner.plan", partial(_plan, tables, arm, folder))
    q = tables.start.q if led is None else led.q[0]
    start = errors.collect("start", partial(_start, arm, q, tables.start.v))
    origin = arm.pose(
        arm.neutral if start is None else start[0]
    )  # of a wrong start, paths are looked at, too
    way = errors.collect("path", partial(_path, tables, arm, origin, folder))
    if led is not None and way is not None:
        settings["plan"] = errors.collect(
            "planner.plan",
            partial(led.of, arm, way, scene=settings.get("scene"), clearance=settings.get("clearance")),
        )
    planner, world, leader = None, None, None
    if not errors.found:
        planner = errors.collect("planner", partial(Planner, arm, **settings))
    if planner is not None and start is not None:
        for index, event in enumerate(events):
            if event is not None:
                errors.collect(f"faults[{index}]", partial(_try, planner, event))
        planner.reset(*start)
        if recorder is not None:
            recorder.follow(planner)
    if planner is not None and tables.base is not None:
        world = errors.collect("base", partial(tables.base.world, planner, folder, tables.simulation.seed))
        if world is not None:
            way = errors.collect("base", partial(tables.path.path, world.start() @ origin, folder))
    if planner is not None and way is not None:
        leader = errors.collect("path.reference", partial(_follower, tables, planner, way))
    if planner is None or way is None or start is None or plant is None or errors.found:
        raise ScenarioError(f"{found.origin} has errors:", errors.found)
    return Setup(
        name=found.name,
        folder=folder,
        tables=tables,
        robot=arm,
        planner=planner,
        path=way,
        schedule=Schedule([event for event in events if event is not None]),
        q=start[0],
        v=start[1],
        duration=tables.simulation.duration or (None if isinstance(leader, PathFollower) else way.duration),
        plant=plant,
        sensors=sensors,
        follower=leader,
        world=world,
        recorder=recorder,
    )


def _planner_settings(table: PlannerTable, folder: File, errors: _Errors) -> dict[str, Any]:
    """The arguments of the planner, each checked by its owner; None where one is wrong."""
    backend = folder / table.profile if table.profile else table.backend or "active_set"
    made_by: dict[str, Callable[[], Any]] = {
        "scheme": lambda: schemes.by_name(table.scheme),
        "noise": lambda: made(table.noise),
        "drive": lambda: _drive(table.drive, folder),
        "detector": lambda: _detector(table.detector, folder),
        "task": lambda: made(table.task),
        "bounds": lambda: bounds.by_name(table.bounds),
        "profile" if table.profile else "backend": lambda: qp_backend(backend),
        "emergency": lambda: made(table.emergency),
    }
    found = {key: errors.collect(f"planner.{key}", make) for key, make in made_by.items()}
    found["backend"] = found.pop("profile", found.get("backend"))
    same = ("dt", "level", "posture", "torque_limits", "branch_limits", "remember")
    return {key: getattr(table, key) for key in same} | found


def _plant(tables: Scenario, arm: Robot, scene: Scene | None) -> Plant:
    planner = tables.planner
    return tables.simulation.made_plant(
        arm, planner.dt, planner.level, planner.drive["kind"], moving=tables.base is not None, scene=scene
    )


def _sensors(tables: Scenario, arm: Robot) -> JointSensors | None:
    given = tables.sensors
    return None if given is None else given.made(arm, tables.planner.dt, seed=tables.simulation.seed)


def _event(table: FaultTable, plant: Plant | None) -> FaultEvent:
    """The event, whose fault the plant can have."""
    event = table.event()
    if plant is not None:
        plant.fail(event.fault)
    return event


def _try(planner: Planner, event: FaultEvent) -> None:
    """That the fault can be reported to the planner."""
    planner.report(event.fault)
    planner.withdraw(event.fault.joint)


def _path(tables: Scenario, arm: Robot, origin: FloatArray, folder: File) -> Path:
    """The path from the pose of the tip at the start."""
    way = tables.path.path(origin, folder)
    if tables.base is None and not tables.path.beyond_reach:
        _refuse_out_of_reach(arm, way)
    return way
