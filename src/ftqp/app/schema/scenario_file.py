"""A whole scenario file: every key with its type, default, unit, range and meaning."""

from dataclasses import dataclass
from math import floor
from typing import Any

from ftqp.app.schema.base_section import BaseTable
from ftqp.app.schema.path_section import PathTable
from ftqp.app.schema.planner_section import PlannerTable
from ftqp.app.schema.reading import Options, Table
from ftqp.app.schema.robot_section import RobotTable
from ftqp.app.schema.simulation_section import FaultTable, SimulationTable
from ftqp.control.scene.placed_shapes import Clearance
from ftqp.control.scene.solid_shapes import WORDS, Shape
from ftqp.control.task.soft_tasks import SoftTask
from ftqp.control.task.task_kinds import CONSTRAINT_KINDS, KEPT, KINDS
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, setting
from ftqp.kernel.layout.rows import KEEPS
from ftqp.kernel.layout.scene_room import OBSTACLES, TERMS
from ftqp.kernel.layout.thresholds import TIME_SLACK
from ftqp.qp import Backend, Recorder
from ftqp.sim.schedule import first_tick
from ftqp.sim.sensors.joint_sensors import JointSensors


@dataclass(frozen=True, slots=True, kw_only=True)
class StartTable(Table):
    """The state at t = 0."""

    q: tuple[float, ...] | None = setting(
        None, "joint positions; the robot's neutral ones if absent", unit="rad or m"
    )
    v: tuple[float, ...] | None = setting(None, "joint velocities; at rest if absent", unit="rad/s or m/s")


@dataclass(frozen=True, slots=True, kw_only=True)
class LogTable(Table):
    """How the log of a long run is cut into files."""

    part: float | None = setting(
        None,
        "simulated time after which a new file begins, > 0; the log is one file if absent",
        unit="s",
        above=0.0,
    )
    keep: int | None = setting(
        None,
        "how many parts are kept, the newest included, >= 1; older ones are deleted, none if absent",
        least=1.0,
    )

    def __post_init__(self) -> None:
        if self.keep is not None and self.part is None:
            raise InputError("keeps parts of a log, but part, their length, is not given")


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingTable(Table):
    """Which QPs a run keeps when it is told to: ``ftqp run --record-qps FILE``."""

    every: int = setting(1, "keep one of so many ticks, >= 1", least=1.0)
    begin: float = setting(0.0, "keep none before, >= 0", unit="s", least=0.0)
    end: float | None = setting(None, "keep none after; the end of the run if absent", unit="s", least=0.0)
    limit: int | None = setting(
        None, "keep the last so many; as many as fit into 256 MiB if absent", least=1.0
    )

    def __post_init__(self) -> None:
        if self.end is not None and self.end < self.begin:
            raise InputError(f"ends at {self.end:g} s, before it begins at {self.begin:g} s")

    def recorder(self, backend: Backend, dt: float) -> Recorder:
        """``backend`` with a copy kept of what is asked for; times become ticks of ``dt``."""
        first = first_tick(self.begin, dt)
        last = None if self.end is None else floor((self.end + TIME_SLACK) / dt)
        if last is not None and last < first:
            raise InputError(
                f"no tick of {dt:g} s lies between begin, {self.begin:g} s, and end, {self.end:g} s"
            )
        return Recorder(backend, every=self.every, limit=self.limit, first=first, last=last)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario(Table):
    """A whole scenario file."""

    description: str = setting("", "what a reader should know")
    robot: RobotTable = setting(REQUIRED, "the arm")
    planner: PlannerTable = setting(PlannerTable(), "how the next command is chosen")
    start: StartTable = setting(StartTable(), "the state at t = 0")
    path: PathTable = setting(REQUIRED, "what the tip follows")
    tasks: tuple[Options[SoftTask], ...] = setting(
        (),
        "what other points and joints should do with what the tip's task leaves",
        kinds=KINDS,
        count=(0, TERMS),
    )
    constraints: tuple[Options[Any], ...] = setting(
        (),
        "points of the arm that are kept on their side of a plane, and other constraints",
        kinds=CONSTRAINT_KINDS,
        usual=KEPT,
        count=(0, KEEPS),
    )
    scene: tuple[Options[Shape], ...] = setting(
        (), "what stands around the arm, from which it keeps clear", kinds=WORDS, count=(0, OBSTACLES)
    )
    clearance: Options[Clearance] | None = setting(
        None, "how far the arm keeps from itself and from the scene; as by default beside one if absent"
    )
    base: BaseTable | None = setting(None, "what carries the arm; it stands if absent")
    faults: tuple[FaultTable, ...] = setting((), "what fails, and when the planner is told")
    simulation: SimulationTable = setting(SimulationTable(), "what stands for the world")
    sensors: Options[JointSensors] | None = setting(
        None, "what is measured of the joints; the planner is given the truth if absent"
    )
    log: LogTable = setting(LogTable(), "how the log of a long run is cut into files")
    recording: RecordingTable = setting(RecordingTable(), "which QPs --record-qps keeps")
