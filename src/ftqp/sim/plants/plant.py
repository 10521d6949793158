"""The role of the arm in a simulation: what every plant holds and does."""

from abc import ABC, abstractmethod
from operator import attrgetter
from typing import NamedTuple, Protocol, final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray
from ftqp.faults.kinds import Fault
from ftqp.kernel.entry.session import ArmSession
from ftqp.model.robot import Robot

DRIVES = ("position", "velocity", "torque")
"""What an arm takes."""


class Command(Protocol):
    """The part of a planner's step that an arm obeys, each (nv,): motions, torques, brakes to close."""

    @property
    def q(self) -> FloatArray: ...
    @property
    def v(self) -> FloatArray: ...
    @property
    def tau(self) -> FloatArray: ...
    @property
    def brakes(self) -> BoolArray: ...


class Motors(NamedTuple):
    """What the motors of an arm did in the last time step, each (nv,) [N m or N]."""

    tau: FloatArray  # The torques that they gave
    demand: FloatArray  # The torques that the drives asked of them, within the healthy limits


class Plant(ABC):
    """The role of the arm in a simulation: holds the true state, suffers the faults and moves by commands."""

    __slots__ = ()

    @property
    @abstractmethod
    def q(self) -> FloatArray:
        """True joint positions, (nv,) [rad or m]; belongs to the plant."""

    @property
    @abstractmethod
    def v(self) -> FloatArray:
        """True joint velocities, (nv,) [rad/s or m/s]; belongs to the plant."""

    @property
    def drive(self) -> str | None:
        """What the arm takes, one of `DRIVES`; None for an arm that follows its commands exactly."""
        return None

    @property
    def dt(self) -> float | None:
        """The period of the commands that the arm takes [s]; None where it says none."""
        return None

    @property
    def tolerance(self) -> float:
        """How far a joint that a brake holds may creep in a run [rad or m]."""
        return 0.0

    @property
    def motors(self) -> Motors | None:
        """What its motors did in the last time step; None where there are none. It belongs to the plant."""
        return None

    @property
    def failure(self) -> str | None:
        """Why the simulation of the arm cannot go on, or None."""
        return None

    @abstractmethod
    def reset(self, q: FloatArray, v: FloatArray) -> None:
        """Put the healthy arm at (q, v).

        Args:
            q: Joint positions, (nv,) or (nq,) [rad or m].
            v: Joint velocities, (nv,) [rad/s or m/s].
        """

    @abstractmethod
    def fail(self, fault: Fault) -> None:
        """From now on the joint of ``fault`` behaves as it says, and no longer as an earlier one said.

        Args:
            fault: What happens, and to which joint.

        Raises:
            InputError: unknown joint, or a fault that this plant does not know.
        """

    @abstractmethod
    def repair(self, joint: str | int) -> None:
        """From now on the joint works as if it had never failed; one that works stays so.

        Args:
            joint: Its name or 0-based index.

        Raises:
            InputError: unknown joint.
        """

    @abstractmethod
    def advance(self, command: Command) -> None:
        """Move on by dt.

        Args:
            command: The planner's step for this tick.
        """


class PlantAround(Plant):
    """The role of what stands around another plant, counts its ticks and does something more."""

    __slots__ = ("_plant", "_tick")

    def __init__(self, plant: Plant) -> None:
        self._plant, self._tick = plant, 0

    q = property(attrgetter("_plant.q"))
    v = property(attrgetter("_plant.v"))
    drive = property(attrgetter("_plant.drive"))
    dt = property(attrgetter("_plant.dt"))
    tolerance = property(attrgetter("_plant.tolerance"))
    motors = property(attrgetter("_plant.motors"))
    failure = property(attrgetter("_plant.failure"))

    def reset(self, q: FloatArray, v: FloatArray) -> None:
        self._plant.reset(q, v)
        self._tick = 0

    def fail(self, fault: Fault) -> None:
        self._plant.fail(fault)

    def repair(self, joint: str | int) -> None:
        self._plant.repair(joint)

    def advance(self, command: Command) -> None:
        self._plant.advance(command)
        self._tick += 1


@final
class Arm:
    """The kernel's kinematics and dynamics of one robot, apart from any planner."""

    def __init__(self, robot: Robot) -> None:
        n = robot.nv
        self._session = ArmSession(robot.chain.constants())
        kinematics = self._session.K.kinematics
        self._tip = np.eye(4)
        self._rotation = kinematics.R_tip.reshape(3, 3)
        self._origin = kinematics.o_tip
        self._mass, self._bias = kinematics.M[:n, :n], kinematics.h[:n]

    def tip(self, q: FloatArray) -> FloatArray:
        """Pose of E in W, (4, 4); valid until the next call."""
        self._session.kinematics(q)
        self._tip[:3, :3] = self._rotation
        self._tip[:3, 3] = self._origin
        return self._tip

    def dynamics(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """M (nv, nv) and h (nv,) with tau = M a + h; valid until the next call."""
        self._session.dynamics(q, v)
        return self._mass, self._bias
