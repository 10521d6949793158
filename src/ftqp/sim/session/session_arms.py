"""The arms of a session: the arm, its rival, what fails by itself, and what they are called."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.control.paths.path import Path
from ftqp.core.checks import FloatArray, frozen
from ftqp.faults.kinds import Fault
from ftqp.model.robot import Robot
from ftqp.sim.leader import LedArm
from ftqp.sim.plants.plant import Plant
from ftqp.sim.rival import ResolvedRates
from ftqp.sim.schedule import Schedule
from ftqp.sim.sensors.joint_sensors import JointSensors
from ftqp.sim.session.frame import DrawnArm, Twin
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


LINEAR = ("x", "y", "z")


@final
class RivalArm:
    """It follows the path of an arm beside it, failing and told as that is, and rests while a hand leads."""

    def __init__(self, rival: SessionRival, beside: SessionArm) -> None:
        self._plant, self._sensors, self._beside = rival.plant, rival.sensors, beside
        robot: Robot = beside.planner.robot
        self._robot, self._drawn = robot, DrawnArm(robot)
        self._rates = ResolvedRates(robot, beside.planner.dt, rows=rival.rows)
        self._error_rows = [LINEAR.index(row) for row in rival.rows if row in LINEAR]
        self._failed: dict[int, Fault] = {}
        self._reported: set[int] = set()
        self._here = True

    def begin(self, q: FloatArray, v: FloatArray) -> None:
        """Tick 0: the healthy arm at (q, v), each (nv,)."""
        self._failed.clear()
        self._reported.clear()
        self._start(q, v)

    def _start(self, q: FloatArray, v: FloatArray) -> None:
        """Put it at (q, v), each (nv,), with the failures that there are."""
        self._here = True
        self._plant.reset(q, v)
        if self._sensors is not None:
            self._sensors.reset()
        self._rates.reset(q, v)
        for i, fault in self._failed.items():
            self._plant.fail(fault)
            if i in self._reported:
                self._rates.tell(i)

    def fail(self, fault: Fault) -> None:
        """Let a joint fail."""
        self._plant.fail(fault)
        self._failed[self._robot.joint(fault.joint)] = fault

    def tell(self, fault: Fault) -> None:
        """Tell it of a failure; of a joint that is only weaker it can make nothing."""
        if not fault.works:
            i = self._robot.joint(fault.joint)
            self._reported.add(i)
            self._rates.tell(i)

    def repair(self, joint: str) -> None:
        """Let a joint work again; its drive is switched on where the joint is."""
        i = self._robot.joint(joint)
        self._plant.repair(joint)
        self._failed.pop(i, None)
        self._reported.discard(i)
        self._rates.repair(i, float(self._plant.q[i]))

    @property
    def failure(self) -> str | None:
        """Why its simulation cannot go on, or None."""
        if self._plant.failure is not None:
            return self._plant.failure
        if np.isfinite(self._plant.q).all() and np.isfinite(self._plant.v).all():
            return None
        return "the position of a joint is not a number any more"

    def plan_step(self, k: int) -> None:
        """Its command at this tick, after the other arm has thought."""
        leader, plant = self._beside.leader, self._beside.plant
        if leader.on_path and not self._here:
            self._start(plant.q, plant.v)
        self._here = leader.on_path
        if not self._here:
            return
        q = self._plant.q
        if self._sensors is not None:
            self._sensors.measure(q, self._plant.v)
            q = self._sensors.q
        target = leader.target
        self._rates.step(q, target.pose, np.asarray(target.twist))

    def move(self) -> None:
        """Let it move on."""
        if self._here:
            self._plant.advance(self._rates)

    def seen(self) -> Twin | None:
        """What a picture needs of it; None while it is not there."""
        if not self._here:
            return None
        q = self._plant.q
        off = self._robot.pose(q)[:3, 3] - self._beside.leader.target.pose[:3, 3]
        return Twin(
            joints=self._drawn.joints(q),
            q=frozen(q.copy()),
            error=float(np.linalg.norm(off[self._error_rows])),
            reported=bool(self._failed) and self._reported.issuperset(self._failed),
        )
