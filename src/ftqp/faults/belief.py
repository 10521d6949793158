"""Belief: which joints are held to have failed, written into two rooms of the planner's record."""

from typing import Any

import numpy as np

from ftqp.core.errors import InputError
from ftqp.faults.kinds import RESETS, Degraded, Fault, FreeSwinging, Locked, not_served, refuse_unknown
from ftqp.kernel.layout.enums import BRAKING, FREE, HEALTHY, INSTANT, LOCKED
from ftqp.model.robot import Robot

LOCK_SHARE = 0.25
"""Default deceleration of a joint that is being locked, as a share of its acceleration limit.

With the full limit healthy joints saturate when they compensate (``docs/theory/joint-failures.md``).
"""


class Belief:
    """What a planner holds to be true of its joints, kept in step with the record that the kernel reads.

    Args:
        robot: The healthy robot.
        limits: The record's room of limits; what is believed of them is written here.
        faults: The record's room of fault codes.
        torque_limits: Whether torque limits are believed in at all.
    """

    def __init__(self, robot: Robot, limits: Any, faults: Any, *, torque_limits: bool = True) -> None:
        self._robot = robot
        self._tau_max = robot.limits.tau_max if torque_limits else np.full(robot.nv, np.inf)
        self._limits = limits
        self._codes = faults
        self._faults: dict[int, Fault] = {}
        self.restore()

    @property
    def faults(self) -> dict[str, Fault]:
        """The faults believed now, by joint name."""
        return {self._robot.joints[i]: fault for i, fault in sorted(self._faults.items())}

    @property
    def needs_dynamics(self) -> bool:
        """Whether a row of the QP needs the inertia: a joint swings free."""
        return any(isinstance(fault, FreeSwinging) for fault in self._faults.values())

    def report(self, fault: Fault) -> None:
        """Hold a fault to be true from the next tick on; it replaces what was believed of that joint.

        Args:
            fault: The fault, of one of the kinds in ``ftqp.faults.kinds.KINDS``.

        Raises:
            InputError: The joint is unknown, this is no fault, or a joint is to swing freely of a robot
                without inertia.
        """
        refuse_unknown(fault)
        i = self._robot.joint(fault.joint)
        if isinstance(fault, FreeSwinging) and not self._robot.has_inertia:
            raise InputError(
                f"{self._robot.name} has no inertia, so the motion of free-swinging {self._robot.joints[i]} "
                "is unknown; give the model its masses, or report ftqp.Locked"
            )
        before = self._faults.get(i)
        if before == fault:
            return
        code = self._codes.code
        match fault:
            case Locked():
                self._restore_limits(i)
                self._lock(i, fault, int(code[i]) if isinstance(before, Locked) else HEALTHY)
            case FreeSwinging():
                self._restore_limits(i)
                code[i] = FREE
                self._codes.friction[i] = fault.damping
                self._codes.coulomb[i] = fault.friction + self._robot.coulomb[i]
            case Degraded():
                low, high = self._range(i, fault)
                self._restore_limits(i)
                code[i] = HEALTHY
                self._lower(i, fault)
                self._limits.q_min[i], self._limits.q_max[i] = low, high
            case _:
                not_served(fault, "the planner")
        self._faults[i] = fault

    def withdraw(self, joint: str | int) -> None:
        """Hold the joint to be healthy again.

        Args:
            joint: The joint's name or its 0-based index.

        Raises:
            InputError: The joint is unknown.
        """
        i = self._robot.joint(joint)
        if self._faults.pop(i, None) is not None:
            self._restore_limits(i)
            self._codes.code[i] = HEALTHY

    def restore(self) -> None:
        """Hold every joint to be healthy."""
        self._faults.clear()
        for i in range(self._robot.nv):
            self._restore_limits(i)
        self._codes.code[:] = HEALTHY

    def _restore_limits(self, i: int) -> None:
        limits = self._robot.limits
        for name in ("q_min", "q_max", "v_max", "a_max"):
            getattr(self._limits, name)[i] = getattr(limits, name)[i]
        self._limits.tau_max[i] = self._tau_max[i]
        self._codes.friction[i] = self._codes.coulomb[i] = 0.0

    def _lock(self, i: int, fault: Locked, code: int) -> None:
        """Lock joint i of this ``code``: locked it stays so, braking it goes on from where it is."""
        codes, rate = self._codes, fault.deceleration
        codes.lock_rate[i] = LOCK_SHARE * self._robot.limits.a_max[i] if rate is None else rate
        codes.reset_mode = RESETS.index(fault.reset)
        if code == LOCKED:
            return
        codes.code[i] = INSTANT if fault.mode == "instant" else BRAKING
        if code != BRAKING:
            codes.lock_velocity[i] = np.inf

    def _lower(self, i: int, fault: Fault) -> None:
        """What is left of the limits of joint i, which ``_restore_limits`` has just made healthy."""
        for limit, share in fault.shares.items():
            getattr(self._limits, limit)[i] *= getattr(fault, share)

    def _range(self, i: int, fault: Degraded) -> tuple[float, float]:
        """What is left of the range of joint i."""
        limits = self._robot.limits
        low = limits.q_min[i] if fault.q_min is None else max(fault.q_min, limits.q_min[i])
        high = limits.q_max[i] if fault.q_max is None else min(fault.q_max, limits.q_max[i])
        if not low < high:
            raise InputError(
                f"the range left of {self._robot.joints[i]} is empty: [{low:g}, {high:g}]; "
                f"its healthy range is [{limits.q_min[i]:g}, {limits.q_max[i]:g}]"
            )
        return float(low), float(high)
