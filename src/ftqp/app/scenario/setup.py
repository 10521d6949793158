"""A scenario, resolved: from a file to robot, planner, path and faults of a run, or to all errors at once."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path as File
from typing import TYPE_CHECKING, Any

from ftqp.app.scenario import composition, document
from ftqp.app.schema import Scenario
from ftqp.app.schema.reading import made, plain, read
from ftqp.app.schema.robot_section import RobotTable
from ftqp.control.following.path_follower import PathFollower
from ftqp.control.paths import Path
from ftqp.control.planner.planner import Planner
from ftqp.control.task import bounds, schemes
from ftqp.core.checks import FloatArray, instance
from ftqp.core.errors import InputError, MissingPackage, ModelError, ScenarioError
from ftqp.model.robot import Robot
from ftqp.qp import Recorder
from ftqp.qp import backend as qp_backend
from ftqp.sim.base.moving_world import MovingWorld
from ftqp.sim.loop import Simulation
from ftqp.sim.plants.plant import Plant
from ftqp.sim.schedule import FaultEvent, Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors

if TYPE_CHECKING:
    from ftqp.analysis.planning.fault_plan import Plan  # slow to load, needed with a plan only


@dataclass(frozen=True, slots=True, kw_only=True)
class Setup:
    """Everything a run needs.

    Attributes:
        name: Names the run.
        folder: Where relative paths start.
        tables: The scenario with every default filled in.
        robot: The arm.
        planner: Reset to the start.
        path: What the tip follows.
        schedule: What really fails.
        q: Joint positions at t = 0, (nv,) [rad or m].
        v: Joint velocities at t = 0, (nv,) [rad/s or m/s].
        duration: End of the run [s]; None where the path's progress ends it.
        plant: What stands for the arm.
        sensors: What is measured of it, or None where the truth is.
        follower: Leads the planner by the path's progress, or None.
        world: The base, where it moves.
        recorder: The planner's backend when its QPs are recorded.
    """

    name: str
    folder: File
    tables: Scenario
    robot: Robot
    planner: Planner
    path: Path
    schedule: Schedule
    q: FloatArray
    v: FloatArray
    duration: float | None
    plant: Plant
    sensors: JointSensors | None = None
    follower: PathFollower | None = None
    world: MovingWorld | None = None
    recorder: Recorder | None = None

    @property
    def content(self) -> dict[str, Any]:
        """The scenario as plain tables, its files with absolute paths."""
        content: dict[str, Any] = plain(self.tables, self.folder)
        return content

    @property
    def toml(self) -> str:
        """The scenario as a TOML file in which no default is left out."""
        return document.toml(self.content)

    def simulation(self, **settings: Any) -> Simulation:
        """The run, ready to be simulated.

        Args:
            settings: Further arguments of ``Simulation``, such as ``log``.
        """
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
    choices = list(overrides)
    if backend is not None and backend.endswith(".toml"):
        choices += ["planner.backend=", f"planner.profile={File(backend).resolve()}"]
    elif backend is not None:
        choices += ["planner.profile=", f"planner.backend={backend}"]
    if scheme is not None:
        choices.append(f"planner.scheme={scheme}")
    if plan is not None:
        choices.append(f"planner.plan={plan.resolve()}")
    found = document.read(source, choices)
    return resolve(found, validated(found), record=record)


def validated(found: document.Document) -> Scenario:
    """The tables of a scenario, each checked by itself.

    Raises:
        ScenarioError: Unknown or missing keys, wrong types, values out of range; carries every error.
    """
    return read(Scenario, found.content, f"{found.origin} has errors:")


class _Errors:
    """Collects what is wrong, so that one answer tells all of it."""

    def __init__(self) -> None:
        self.found: list[str] = []

    @contextmanager
    def at(self, place: str) -> Iterator[None]:
        """Notes an error of the block as one of ``place`` and goes on after it."""
        try:
            yield
        except ModelError as error:
            self.found += [f"{place}: {finding}" for finding in error.findings or (str(error),)]
        except (InputError, MissingPackage) as error:
            self.found.append(f"{place}: {error}")


def resolve(
    found: document.Document,
    tables: Scenario,
    *,
    record: bool = False,
    arms: Callable[[RobotTable, File], Robot] = composition.robot,
) -> Setup:
    """The objects that the tables stand for.

    Args:
        found: The scenario as it was read.
        tables: Its tables.
        record: Keep the planner's QPs, those that ``[recording]`` asks for.
        arms: Makes the arm of ``[robot]``, for example one that was made before.

    Raises:
        ScenarioError: What the tables name does not exist or does not fit together; carries every error.
    """
    errors, folder = _Errors(), found.folder
    arm: Robot | None = None
    with errors.at("robot"):
        arm = arms(tables.robot, folder)
    settings = _planner_settings(tables, folder, errors)
    recorder: Recorder | None = None
    if record and "backend" in settings:
        with errors.at("recording"):
            recorder = tables.recording.recorder(settings["backend"], tables.planner.dt)
            settings["backend"] = recorder
    plant: Plant | None = None
    sensors: JointSensors | None = None
    if arm is not None:
        with errors.at("simulation"):
            plant = tables.simulation.made_plant(
                arm,
                tables.planner.dt,
                tables.planner.level,
                tables.planner.drive["kind"],
                moving=tables.base is not None,
            )
        with errors.at("sensors"):
            if tables.sensors is not None:
                sensors = tables.sensors.made(arm, tables.planner.dt, seed=tables.simulation.seed)
    events: list[FaultEvent] = []
    for index, table in enumerate(tables.faults):
        with errors.at(f"faults[{index}]"):
            event = table.event()
            if plant is not None:
                plant.fail(event.fault)
            events.append(event)
    if arm is None:
        raise ScenarioError(f"{found.origin} has errors:", errors.found)
    start: tuple[FloatArray, FloatArray] | None = None
    led: Plan | None = None
    with errors.at("planner.plan"):
        led = composition.plan(tables, arm, folder)
    with errors.at("start"):
        q = tables.start.q if led is None else led.q[0]
        start = composition.start(arm, q, tables.start.v)
    way = _path(tables, arm, start, folder, errors)
    if led is not None and way is not None:
        with errors.at("planner.plan"):
            settings["plan"] = led.of(arm, way)
    planner: Planner | None = None
    if not errors.found:
        with errors.at("planner"):
            planner = Planner(arm, **settings)
        if planner is not None and start is not None:
            for index, event in enumerate(events):
                with errors.at(f"faults[{index}]"):
                    planner.report(event.fault)
                    planner.withdraw(event.fault.joint)
            planner.reset(*start)
            if recorder is not None:
                recorder.follow(planner)
    world: MovingWorld | None = None
    if planner is not None and tables.base is not None:
        with errors.at("base"):
            world = tables.base.world(planner, folder, tables.simulation.seed)
            way = tables.path.path(
                world.start() @ arm.pose(arm.neutral if start is None else start[0]), folder
            )
    leader: PathFollower | None = None
    if planner is not None and way is not None:
        with errors.at("path.reference"):
            leader = composition.follower(tables, planner, way)
    if planner is None or way is None or start is None or plant is None or errors.found:
        raise ScenarioError(f"{found.origin} has errors:", errors.found)
    return Setup(
        name=found.name,
        folder=folder,
        tables=tables,
        robot=arm,
        planner=planner,
        path=way,
        schedule=Schedule(events),
        q=start[0],
        v=start[1],
        duration=tables.simulation.duration or (way.duration if leader is None else None),
        plant=plant,
        sensors=sensors,
        follower=leader,
        world=world,
        recorder=recorder,
    )


def _planner_settings(tables: Scenario, folder: File, errors: _Errors) -> dict[str, Any]:
    """The arguments of the planner, each checked by its owner."""
    table = tables.planner
    profile, backend = table.profile, "planner.profile" if table.profile else "planner.backend"
    settings: dict[str, Any] = {
        key: getattr(table, key) for key in ("dt", "level", "posture", "torque_limits", "branch_limits")
    }
    made_by: dict[str, Callable[[], Any]] = {
        "scheme": lambda: schemes.by_name(table.scheme),
        "noise": lambda: made(table.noise),
        "drive": lambda: made(table.drive),
        "detector": lambda: composition.detector(table.detector, folder),
        "task": lambda: made(table.task),
        "bounds": lambda: bounds.by_name(table.bounds),
        "backend": lambda: qp_backend(folder / profile if profile else table.backend or "active_set"),
        "emergency": lambda: made(table.emergency),
    }
    for key, make in made_by.items():
        with errors.at(backend if key == "backend" else f"planner.{key}"):
            settings[key] = make()
    return settings


def _path(
    tables: Scenario, arm: Robot, start: tuple[FloatArray, FloatArray] | None, folder: File, errors: _Errors
) -> Path | None:
    """The path from where the start puts the tip; from the neutral posture when the start itself is wrong."""
    way: Path | None = None
    with errors.at("path"):
        way = tables.path.path(arm.pose(arm.neutral if start is None else start[0]), folder)
        if tables.base is None and not tables.path.beyond_reach:
            composition.refuse_out_of_reach(arm, way)
    return way
