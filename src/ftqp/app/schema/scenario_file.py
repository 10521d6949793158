"""A whole scenario file: every key with its type, default, unit, range and meaning."""

from pydantic import Field, model_validator

from ftqp.app.schema.base_section import BaseTable
from ftqp.app.schema.fault_sections import FaultTable
from ftqp.app.schema.log_section import LogTable
from ftqp.app.schema.path_section import PathTable
from ftqp.app.schema.planner_section import PlannerTable
from ftqp.app.schema.robot_section import RobotTable
from ftqp.app.schema.sensor_section import SensorsTable
from ftqp.app.schema.simulation_section import SimulationTable
from ftqp.app.schema.strict import Finite, Table, unit


class StartTable(Table):
    """The state at t = 0."""

    q: list[Finite] | None = Field(
        None,
        description="joint positions; the robot's neutral ones if absent",
        json_schema_extra=unit("rad or m"),
    )
    v: list[Finite] | None = Field(
        None, description="joint velocities; at rest if absent", json_schema_extra=unit("rad/s or m/s")
    )


class RecordingTable(Table):
    """Which QPs a run keeps when it is told to: ``ftqp run --record-qps FILE``."""

    every: int = Field(1, ge=1, description="keep one of so many ticks, >= 1")
    begin: Finite = Field(0.0, ge=0, description="keep none before, >= 0", json_schema_extra=unit("s"))
    end: Finite | None = Field(
        None, ge=0, description="keep none after; the end of the run if absent", json_schema_extra=unit("s")
    )
    limit: int | None = Field(
        None, ge=1, description="keep the last so many; as many as fit into 256 MiB if absent"
    )

    @model_validator(mode="after")
    def _begin_before_end(self) -> "RecordingTable":
        if self.end is not None and self.end < self.begin:
            raise ValueError(f"ends at {self.end:g} s, before it begins at {self.begin:g} s")
        return self


class Scenario(Table):
    """A whole scenario file."""

    description: str = Field("", description="what a reader should know")
    robot: RobotTable = Field(description="the arm")
    planner: PlannerTable = Field(PlannerTable(), description="how the next command is chosen")
    start: StartTable = Field(StartTable(), description="the state at t = 0")
    path: PathTable = Field(description="what the tip follows")
    base: BaseTable | None = Field(None, description="what carries the arm; it stands if absent")
    faults: list[FaultTable] = Field([], description="what fails, and when the planner is told")
    simulation: SimulationTable = Field(SimulationTable(), description="what stands for the world")
    sensors: SensorsTable | None = Field(
        None, description="what is measured of the joints; the planner is given the truth if absent"
    )
    log: LogTable = Field(LogTable(), description="how the log of a long run is cut into files")
    recording: RecordingTable = Field(RecordingTable(), description="which QPs --record-qps keeps")
