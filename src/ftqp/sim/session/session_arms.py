"""The arms of a session: the arm, its rival, what fails by itself, and what they are called."""

from collections.abc import Callable
from dataclasses import dataclass

from ftqp.control.paths.path import Path
from ftqp.core.checks import FloatArray
from ftqp.model.robot import Robot
from ftqp.sim.led_arm import LedArm
from ftqp.sim.plants.plant import Plant
from ftqp.sim.schedule import Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors
from ftqp.sim.session.session_leader import SessionLeader

SessionArm = LedArm[SessionLeader]
"""An arm of a session, with its planner."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SessionRival:
    """What a rival has of its own."""

    plant: Plant  # Its arm, the same once more
    sensors: JointSensors | None  # What is measured of it; None measures the truth
    rows: tuple[str, ...]  # What of the pose it follows


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What a person has chosen to see; None is what the scenario says."""

    scenario: str  # Name or path of a scenario
    overrides: tuple[str, ...] = ()  # ``a.b=value`` each, put into the scenario before it is checked
    plan: str | None = None  # File of a plan that leads the null space
    robot: str | None = None  # Name of a catalog robot
    scheme: str | None = None  # Name of a scheme
    backend: str | None = None  # Name of a backend
    detector: bool | None = None  # Whether the planner looks for failures by itself
    box: bool = False  # Whether a box stands beside the path, which the arm keeps clear of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SessionArms:
    """All that takes part in a session."""

    title: str  # What is shown
    robot: Robot  # The arm
    path: Path  # What its tip follows
    q: FloatArray  # Where it starts, (nv,) [rad or m]
    v: FloatArray  # How fast, (nv,) [rad/s or m/s]
    schedule: Schedule  # What fails by itself
    arm: SessionArm  # The arm and its planner
    rival: SessionRival | None = None  # The arm of damped resolved rates beside it; None without one
    detects: bool = False  # Whether the planner has a detector, so that a click need not tell it
    urdf: str | None = None  # The file that the arm was read from, for pictures; None of an arm without one
    box: bool = False  # Whether a box was put beside the path


ArmsOf = Callable[[Choice], SessionArms]
"""Makes the arms of a choice; raises `FtqpError` with one sentence where that cannot be."""
