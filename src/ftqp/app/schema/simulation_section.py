"""The tables ``[simulation]`` and ``[[faults]]``: what stands for the world, and what fails in it."""

from dataclasses import dataclass
from typing import Literal

from ftqp.app.schema.reading import Options, Table, options, settings_for
from ftqp.control.scene.placed_shapes import Scene
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, like, setting
from ftqp.faults.kinds import KINDS, Fault
from ftqp.model.payload import Payload
from ftqp.model.robot import Robot
from ftqp.sim.plants.held_plant import HeldPlant, Hold
from ftqp.sim.plants.joint_servo import JointServo
from ftqp.sim.plants.kinematic_plant import KinematicPlant
from ftqp.sim.plants.plant import Plant
from ftqp.sim.plants.servo_plant import ServoPlant
from ftqp.sim.plants.true_arm import TrueArm
from ftqp.sim.schedule import FaultEvent

PerJoint = float | dict[str, float]
"""One number for all joints, or a table by joint name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MujocoTable(Table):
    """The arm in physics, and what is true of it and unknown to its planner."""

    bandwidth: float = like(JointServo, "bandwidth")
    takes_velocity: bool = like(JointServo, "takes_velocity")
    substeps: int = setting(4, "time steps of the physics in a control period, >= 1", least=1.0)
    payload: Options[Payload] | None = like(TrueArm, "payload")
    mass_scale: float = like(TrueArm, "mass_scale")
    jitter: float = like(TrueArm, "jitter")
    rotors: PerJoint = like(TrueArm, "rotors")
    coulomb: PerJoint = like(TrueArm, "coulomb")
    viscous: PerJoint = like(TrueArm, "viscous")
    brake: dict[str, float] = like(TrueArm, "brake")
    brake_delay: float = like(TrueArm, "brake_delay")
    end_stops: float | None = like(TrueArm, "end_stops")

    def true_arm(self) -> TrueArm:
        """What is true of the arm."""
        return TrueArm(**settings_for(TrueArm, self))

    def plant(self, arm: Robot, dt: float, drive: str, seed: int, scene: Scene | None) -> Plant:
        """The arm in physics, behind servos that take what a drive sends; MuJoCo is loaded here.

        Who made the servos knows the rotors.
        """
        from ftqp.sim.plants.mujoco_plant import MujocoPlant

        true = self.true_arm()
        servo = JointServo(true.geared(arm), drive, **settings_for(JointServo, self))
        return MujocoPlant(arm, dt, servo, true, substeps=self.substeps, seed=seed, scene=scene)


@dataclass(frozen=True, slots=True, kw_only=True)
class HoldTable(Table):
    """All joints are held at once, as by a protective stop, and nobody is told."""

    at: float = setting(REQUIRED, "when it happens, >= 0", unit="s", least=0.0)
    duration: float = setting(REQUIRED, "for how long, > 0", unit="s", above=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationTable(Table):
    """What stands for the world."""

    plant: str = setting(
        "kinematic",
        "the arm follows every command exactly, or through joint servos that lag, or as physics makes it",
        choices=("kinematic", "servo", "mujoco"),
    )
    servo: Options[ServoPlant] = setting(options(ServoPlant), "the servos of plant = 'servo'")
    mujoco: MujocoTable = setting(MujocoTable(), "the arm of plant = 'mujoco'")
    seed: int = setting(0, "seed of everything random, >= 0", least=0.0)
    feed_forward: str = setting(
        "sampled",
        "the path's acceleration at a tick, or its mean until the next one",
        choices=("sampled", "mean"),
    )
    holds: tuple[HoldTable, ...] = setting((), "when all joints are held at once")
    duration: float | None = setting(
        None, "end of the run, > 0; the path's duration if absent", unit="s", above=0.0
    )

    def made_plant(
        self, arm: Robot, dt: float, level: str, drive: str, *, moving: bool, scene: Scene | None = None
    ) -> Plant:
        """The arm that is simulated."""
        plant: Plant
        if self.plant == "servo":
            plant = self.servo.made(arm, dt, drive=None if moving else drive)
        elif self.plant == "mujoco":
            plant = self.mujoco.plant(arm, dt, drive, self.seed, scene)
        else:
            plant = KinematicPlant(arm, dt, level)
        holds = [Hold(one.at, one.duration) for one in self.holds]
        return HeldPlant(plant, arm, dt, holds) if holds else plant


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultTable(Table):
    """What every fault of a scenario says: which joint, when it fails, when the planner is told."""

    kind: Options[Fault] = setting(REQUIRED, "kind of fault", kinds=KINDS)
    joint: str | int = setting(REQUIRED, "a joint's name or its index from 0", least=0.0)
    at: float = setting(REQUIRED, "when it happens, >= 0", unit="s", least=0.0)
    announced: float | Literal["never"] | None = setting(
        None, "when the planner is told (a time >= at, or 'never'); at once if absent", least=0.0
    )

    def __post_init__(self) -> None:
        if isinstance(self.announced, float) and self.announced < self.at:
            raise InputError(f"is announced at {self.announced:g} s, before it happens at {self.at:g} s")

    def event(self) -> FaultEvent:
        """What fails, and when."""
        return FaultEvent(self.at, self.kind.made(joint=self.joint), announced=self.announced)
