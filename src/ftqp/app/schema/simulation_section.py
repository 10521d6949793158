"""The table ``[simulation]``: what stands for the world."""

from typing import Annotated, Literal

from pydantic import Field

from ftqp.app.schema.robot_section import PayloadTable
from ftqp.app.schema.strict import Finite, Table, unit
from ftqp.sim.plants.joint_servo import BANDWIDTH

Friction = Annotated[Finite, Field(ge=0)] | dict[str, Annotated[Finite, Field(ge=0)]]
"""One number for all joints, or a table by joint name."""


class ServoTable(Table):
    """First-order joint servos at the arm's speed limits, which take what the planner's drive sends.

    Above a moving base the commanded velocities add up to the set points.
    """

    time_constant: Finite = Field(0.1, gt=0, description="time constant, > 0", json_schema_extra=unit("s"))
    takes_velocity: bool = Field(True, description="whether position servos are given velocities, too")
    substeps: int = Field(10, ge=1, description="steps of the servos in a control period, >= 1")


class MujocoTable(Table):
    """The arm in physics, and what is true of it and unknown to its planner."""

    bandwidth: Finite = Field(
        BANDWIDTH, gt=0, description="of the joint servos, > 0", json_schema_extra=unit("rad/s")
    )
    takes_velocity: bool = Field(True, description="whether position servos are given velocities, too")
    substeps: int = Field(4, ge=1, description="time steps of the physics in a control period, >= 1")
    payload: PayloadTable | None = Field(
        None, description="a load at the tip that the planner does not know of"
    )
    mass_scale: Finite = Field(1.0, gt=0, description="true masses by those of the model, > 0")
    coulomb: Friction = Field(
        0.0,
        description="dry friction beside that of the model, >= 0: one number, or a table by joint name",
        json_schema_extra=unit("N m or N"),
    )
    viscous: Friction = Field(
        0.0,
        description="viscous friction beside that of the model, >= 0: one number, or a table by joint name",
        json_schema_extra=unit("N m s/rad or N s/m"),
    )
    brake: dict[str, Annotated[Finite, Field(gt=0)]] = Field(
        {},
        description="what the brake of a joint holds, by joint name, > 0; it slips above; "
        "twice the torque limit for a joint that is absent",
        json_schema_extra=unit("N m or N"),
    )
    end_stops: Finite | None = Field(
        None,
        ge=0,
        description="room between a limit and its end stop, >= 0; 0.05, at most 5 % of the range, if absent",
        json_schema_extra=unit("rad or m"),
    )


class SimulationTable(Table):
    """What stands for the world."""

    plant: Literal["kinematic", "servo", "mujoco"] = Field(
        "kinematic",
        description="the arm follows every command exactly, or through joint servos that lag, or as physics "
        "makes it",
    )
    servo: ServoTable = Field(ServoTable(), description="the servos of plant = 'servo'")
    mujoco: MujocoTable = Field(MujocoTable(), description="the arm of plant = 'mujoco'")
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
