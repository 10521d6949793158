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
    """What a rival has of its own.

    Attributes:
        plant: Its arm, the same once more.
        sensors: What is measured of it; None measures the truth.
        rows: What of the pose it follows.
    """

    plant: Plant
    sensors: JointSensors | None
    rows: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What a person has chosen to see; None is what the scenario says.

    Attributes:
        scenario: Name or path of a scenario.
        overrides: ``a.b=value`` each, put into the scenario before it is checked.
        plan: File of a plan that leads the null space.
        robot: Name of a catalog robot.
        scheme: Name of a scheme.
        backend: Name of a backend.
        detector: Whether the planner looks for failures by itself.
        box: Whether a box stands beside the path, which the arm keeps clear of.
    """

    scenario: str
    overrides: tuple[str, ...] = ()
    plan: str | None = None
    robot: str | None = None
    scheme: str | None = None
    backend: str | None = None
    detector: bool | None = None
    box: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SessionArms:
    """All that takes part in a session.

    Attributes:
        title: What is shown.
        robot: The arm.
        path: What its tip follows.
        q: Where it starts, (nv,) [rad or m].
        v: How fast, (nv,) [rad/s or m/s].
        schedule: What fails by itself.
        arm: The arm and its planner.
        rival: The arm of damped resolved rates beside it; None without one.
        detects: Whether the planner has a detector, so that a click need not tell it.
        urdf: The file that the arm was read from, for pictures; None of an arm without one.
        box: Whether a box was put beside the path.
    """

    title: str
    robot: Robot
    path: Path
    q: FloatArray
    v: FloatArray
    schedule: Schedule
    arm: SessionArm
    rival: SessionRival | None = None
    detects: bool = False
    urdf: str | None = None
    box: bool = False


ArmsOf = Callable[[Choice], SessionArms]
"""Makes the arms of a choice; raises `FtqpError` with one sentence where that cannot be."""
