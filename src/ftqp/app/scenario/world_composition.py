"""Makes the simulated arm and its sensors from the tables of a scenario."""

from typing import Any

from ftqp.app.scenario.composition import payload
from ftqp.app.schema import Scenario
from ftqp.app.schema.planner_section import PlannerTable
from ftqp.app.schema.simulation_section import MujocoTable
from ftqp.app.schema.strict import Table
from ftqp.model.robot import Robot
from ftqp.sim.plants.joint_servo import JointServo
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.plants.plant import Plant
from ftqp.sim.plants.servo_plant import ServoPlant
from ftqp.sim.plants.true_arm import TrueArm
from ftqp.sim.sensors.joint_sensors import JointSensors
from ftqp.sim.sensors.sensor_faults import SENSOR_KINDS


def plant(tables: Scenario, arm: Robot) -> Plant:
    """The arm of ``[simulation]``.

    Raises:
        InputError: A robot that this kind of plant cannot move, an unknown joint, a value out of its range.
        MissingPackage: MuJoCo is needed and not installed.
    """
    table = tables.simulation
    if table.plant == "servo":
        servo, dt = table.servo, tables.planner.dt
        drive = None if tables.base is not None else tables.planner.drive.kind
        return ServoPlant(
            arm,
            dt,
            drive=drive,
            takes_velocity=servo.takes_velocity,
            time_constant=servo.time_constant,
            substeps=servo.substeps,
        )
    if table.plant == "mujoco":
        return _mujoco(table.mujoco, arm, tables.planner)
    return KinematicPlant(arm, tables.planner.dt, tables.planner.level)


def _mujoco(table: MujocoTable, arm: Robot, planner: PlannerTable) -> Plant:
    """The arm in physics, with the planner's drive; MuJoCo is loaded here and not before."""
    from ftqp.sim.plants.mujoco_plant import MujocoPlant

    true = TrueArm(
        payload=None if table.payload is None else payload(table.payload),
        mass_scale=table.mass_scale,
        coulomb=table.coulomb,
        viscous=table.viscous,
        brake=table.brake,
        end_stops=table.end_stops,
    )
    drive = planner.drive.kind
    servo = JointServo(arm, drive, bandwidth=table.bandwidth, takes_velocity=table.takes_velocity)
    return MujocoPlant(arm, planner.dt, servo, true, substeps=table.substeps)


def sensors(tables: Scenario, arm: Robot) -> JointSensors | None:
    """The sensors of ``[sensors]``; None where the planner is given the truth.

    Raises:
        InputError: an unknown joint, a bias that does not fit the arm.
    """
    table = tables.sensors
    if table is None:
        return None
    faults = [SENSOR_KINDS[entry.kind](**_settings(entry, "kind")) for entry in table.faults]
    return JointSensors(
        arm, tables.planner.dt, faults=faults, seed=tables.simulation.seed, **_settings(table, "faults")
    )


def _settings(table: Table, *without: str) -> dict[str, Any]:
    """The fields of ``table`` as keyword arguments."""
    return {name: getattr(table, name) for name in type(table).model_fields if name not in without}
