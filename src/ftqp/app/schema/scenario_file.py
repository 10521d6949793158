"""A whole scenario file: every key with its type, default, unit, range and meaning."""

from typing import Literal

from pydantic import Field, model_validator

from ftqp.app.schema.base_section import BaseTable
from ftqp.app.schema.fault_sections import FaultTable
from ftqp.app.schema.path_section import PathTable
from ftqp.app.schema.planner_section import PlannerTable
from ftqp.app.schema.robot_section import RobotTable
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


class ServoTable(Table):
    """First-order joint servos at the arm's speed limits, whose set points add up the commands."""

    time_constant: Finite = Field(0.1, gt=0, description="time constant, > 0", json_schema_extra=unit("s"))
    substeps: int = Field(10, ge=1, description="steps of the servos in a control period, >= 1")


class SimulationTable(Table):
    """What stands for the world."""

    plant: Literal["kinematic", "servo"] = Field(
        "kinematic", description="the arm follows every command exactly, or through joint servos that lag"
    )
    servo: ServoTable = Field(ServoTable(), description="the servos of plant = 'servo'")
    seed: int = Field(0, ge=0, description="seed of everything random, >= 0")
    feed_forward: Literal["sampled", "mean"] = Field(
        "sampled", description="the path's acceleration at a tick, or its mean until the next one"
    )
    duration: Finite | None = Field(
        None,
        gt=0,
        description="end of the run, > 0; the path's duration if absent",
        json_schema_extra=unit("s"),
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
    recording: RecordingTable = Field(RecordingTable(), description="which QPs --record-qps keeps")
