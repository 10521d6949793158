"""An arm behind joint servos, which follow what they take late, and no faster than they can."""

from typing import ClassVar, final

import numpy as np

from ftqp.core.checks import FloatArray, array, positive, seen, whole_number
from ftqp.core.errors import InputError, unknown
from ftqp.core.setting import Setting, Settings
from ftqp.faults.kinds import Degraded, Fault, FreeSwinging, Locked, not_served
from ftqp.model.followers import coupled_places, is_led
from ftqp.model.robot import Robot
from ftqp.sim.plants.plant import Command, Plant

TAKES = ("position", "velocity")


@final
class ServoPlant(Plant):
    """Joint servos of first order at the arm's speed limits, without masses.

    What they do with the command (q_c, v_c) of a tick, in sub-steps:

    * ``"position"``: q' = clip(v_c + (q_c - q)/tau), and without ``takes_velocity`` q' = clip((q_c - q)/tau)
    * ``"velocity"``: q'' = (v_c - q')/tau, q' = clip(q')
    * None, increments: q' = clip((q_set - q)/tau), where q_set += dt v_c adds the commands up, so that any
      planner fits, that of a moving base, too

    Ramp and instant locks both fix the joint where it is. A joint that mimics another has no servo and is
    where its leader puts it.

    Source: Holt and Desrochers 1994: the increments are a fit to their tables.
    """

    __slots__ = (
        "_drive", "_dt", "_leads", "_led", "_q", "_robot", "_set", "_substeps", "_tau", "_v",
        "_works",
    )  # fmt: skip

    settings: ClassVar[Settings] = {
        "time_constant": Setting("time constant, > 0", unit="s", above=0.0),
        "takes_velocity": Setting("whether position servos are given velocities, too"),
        "substeps": Setting("steps of the servos in a control period, >= 1", least=1.0),
    }

    def __init__(
        self,
        robot: Robot,
        dt: float,
        *,
        drive: str | None = None,
        takes_velocity: bool = True,
        time_constant: float = 0.1,
        substeps: int = 10,
    ) -> None:
        if drive is not None and drive not in TAKES:
            raise unknown("drive", drive, "plant 'servo', which has no masses", TAKES)
        robot.refuse_floating("plant 'servo', which would hold it, needs")
        self._robot, self._drive, self._led = robot, drive, bool(is_led(robot.chain).any())
        self._leads = drive == "position" and takes_velocity
        self._dt = positive("dt", dt, "s")
        self._tau = positive("time constant of the servos", time_constant, "s")
        whole_number("substeps", substeps, 1)
        if self._dt / substeps >= 2.0 * self._tau:
            raise InputError(
                f"{substeps} substeps of {self._dt / substeps:g} s are unstable with a time constant of "
                f"{self._tau:g} s; take more"
            )
        self._substeps = substeps
        self._q, self._v = robot.neutral.copy(), np.zeros(robot.nv)
        self._set = self._q.copy()
        self._works = np.ones(robot.nv, dtype=np.bool_)

    @property
    def q(self) -> FloatArray:
        return seen(self._q)

    @property
    def v(self) -> FloatArray:
        """Joint velocities at the end of the last sub-step, (nv,) [rad/s or m/s]; belongs to the plant."""
        return seen(self._v)

    @property
    def setpoint(self) -> FloatArray:
        """Where the servos want the joints, (nv,) [rad or m], which velocity servos do not know."""
        return seen(self._set)

    @property
    def dt(self) -> float:
        """The period of the commands that it takes [s]."""
        return self._dt

    @property
    def drive(self) -> str | None:
        """What the servos take; None for increments, for which any planner fits."""
        return self._drive

    def reset(self, q: FloatArray, v: FloatArray) -> None:
        self._works[:] = True
        self._q[:] = self._robot.angles(q)
        self._v[:] = array("v", v, (self._robot.nv,), "(nv,)")
        self._set[:] = self._q

    def fail(self, fault: Fault) -> None:
        i = self._leader(fault.joint)
        match fault:
            case Locked():
                self._works[i] = False
            case FreeSwinging() | Degraded():
                raise InputError(
                    f"plant 'servo' knows locked joints only, but {self._robot.joints[i]} is "
                    f"{type(fault).__name__}; take plant 'kinematic'"
                )
            case _:
                not_served(fault, "plant 'servo'")
        self._v[i] = 0.0

    def repair(self, joint: str | int) -> None:
        i = self._leader(joint)
        if not self._works[i]:
            self._works[i] = True
            self._set[i] = self._q[i]

    def _leader(self, joint: str | int) -> int:
        """The joint with the servo that moves one."""
        return int(self._robot.chain.lead[self._robot.joint(joint)])

    def advance(self, command: Command) -> None:
        h, top = self._dt / self._substeps, self._robot.limits.v_max
        v = np.where(self._works, command.v, 0.0)
        if self._drive is None:
            self._set += self._dt * v
        elif self._drive == "position":
            self._set[self._works] = command.q[self._works]
        for _ in range(self._substeps):
            if self._drive == "velocity":
                rate = self._v + h / self._tau * (v - self._v)
            else:
                rate = (self._set - self._q) / self._tau
                if self._leads:
                    rate += v
            self._v[:] = np.where(self._works, np.clip(rate, -top, top), 0.0)
            self._q += h * self._v
        if self._led:
            self._v[:] = self._robot.chain.ratio * self._v[self._robot.chain.lead]
            self._q[:] = coupled_places(self._robot.chain, self._q)
