"""Belief: which joints are held to have failed, and what follows for two rooms of the planner's record."""

from collections.abc import Mapping
from typing import Any, Self, final

import numpy as np

from ftqp.core.errors import InputError
from ftqp.faults.kinds import (
    RESETS,
    SWINGS,
    Degraded,
    Fault,
    FreeSwinging,
    Locked,
    not_served,
    refuse_unknown,
)
from ftqp.kernel.layout.enums import BRAKING, FREE, HEALTHY, INSTANT, LOCKED
from ftqp.model.robot import Robot

LOCK_SHARE = 0.25
"""Default deceleration of a joint that is being locked, as a share of its acceleration limit.

With the full limit healthy joints saturate when they compensate (``docs/theory/joint-failures.md``).
"""


@final
class Belief:
    """What a planner holds to be true of its joints; it never changes, another belief takes its place."""

    __slots__ = ("_faults", "_robot", "_torque_limits")

    def __init__(
        self, robot: Robot, *, torque_limits: bool = True, faults: Mapping[int, Fault] | None = None
    ) -> None:
        self._robot, self._torque_limits = robot, torque_limits
        self._faults = dict(sorted((faults or {}).items()))

    def _but(self, faults: Mapping[int, Fault]) -> Self:
        return type(self)(self._robot, torque_limits=self._torque_limits, faults=faults)

    @property
    def faults(self) -> dict[str, Fault]:
        """The faults believed now, by joint name; a copy."""
        return {self._robot.joints[i]: fault for i, fault in self._faults.items()}

    @property
    def needs_dynamics(self) -> bool:
        """Whether a row of the QP needs the inertia: a joint swings free."""
        return any(isinstance(fault, FreeSwinging) for fault in self._faults.values())

    def reported(self, fault: Fault) -> Self:
        """This belief and a fault, which replaces what was believed of that joint.

        Args:
            fault: The fault, of one of the kinds in ``ftqp.faults.kinds.KINDS``.

        Raises:
            InputError: The joint is unknown or has no motor, this is no fault, or a joint is to swing freely
                of a robot without inertia, with branches, or that floats.
        """
        refuse_unknown(fault)
        i = self._robot.joint(fault.joint)
        if i < self._robot.chain.floating:
            raise InputError(
                f"{self._robot.joints[i]} has no motor that could fail, for {self._robot.name} floats; "
                f"report faults of {self._robot.joints[self._robot.chain.floating]} and the joints behind it"
            )
        if isinstance(fault, FreeSwinging) and not self._robot.has_inertia:
            raise InputError(
                f"{self._robot.name} has no inertia, so the motion of free-swinging {self._robot.joints[i]} "
                "is unknown; give the model its masses, or report ftqp.Locked"
            )
        match fault:
            case Locked():
                pass
            case FreeSwinging():
                self._robot.refuse_tree(SWINGS)
            case Degraded():
                self._range(i, fault)
            case _:
                not_served(fault, "the planner")
        return self if self._faults.get(i) == fault else self._but(self._faults | {i: fault})

    def without(self, joint: str | int) -> Self:
        """This belief, but the joint is healthy."""
        i = self._robot.joint(joint)
        if i not in self._faults:
            return self
        return self._but({j: fault for j, fault in self._faults.items() if j != i})

    def write(self, limits: Any, codes: Any, before: "Belief | None" = None) -> None:
        """Write what follows from the belief into a record; as often as one likes, before the next tick.

        Args:
            limits: The record's room of limits.
            codes: The record's room of fault codes.
            before: What was believed at the last tick, so that a joint of which nothing else is believed goes
                on as it is, and one that is being locked does so under another fault of the kind; None is
                nothing, and every joint begins anew.
        """
        for i in range(self._robot.nv):
            was, fault = (None if before is None else before._faults.get(i)), self._faults.get(i)
            if before is not None and was == fault:
                continue
            self._limit(i, fault, limits)
            codes.friction[i] = codes.coulomb[i] = 0.0
            match fault:
                case None:
                    codes.code[i] = HEALTHY
                case Locked():
                    self._lock(i, fault, codes, int(codes.code[i]) if isinstance(was, Locked) else HEALTHY)
                case FreeSwinging():
                    codes.code[i] = FREE
                    codes.friction[i] = fault.damping
                    codes.coulomb[i] = fault.friction + self._robot.coulomb[i]
                case Degraded():
                    codes.code[i] = HEALTHY
                case _:
                    not_served(fault, "the planner")

    def _limit(self, i: int, fault: Fault | None, limits: Any) -> None:
        """Write the limits that are left of joint i, each at once: another call may come in between."""
        healthy, left = self._robot.limits, {} if fault is None else fault.shares
        for name in ("v_max", "a_max", "tau_max"):
            most = np.inf if name == "tau_max" and not self._torque_limits else getattr(healthy, name)[i]
            getattr(limits, name)[i] = most * getattr(fault, left[name]) if name in left else most
        reach = self._range(i, fault) if isinstance(fault, Degraded) else (healthy.q_min[i], healthy.q_max[i])
        limits.q_min[i], limits.q_max[i] = reach

    def _lock(self, i: int, fault: Locked, codes: Any, code: int) -> None:
        """Lock joint i of this ``code``: locked it stays so, braking it goes on from where it is."""
        rate = fault.deceleration
        codes.lock_rate[i] = LOCK_SHARE * self._robot.limits.a_max[i] if rate is None else rate
        codes.reset_mode = RESETS.index(fault.reset)
        if code == LOCKED:
            return
        codes.code[i] = INSTANT if fault.mode == "instant" else BRAKING
        if code != BRAKING:
            codes.lock_velocity[i] = np.inf

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
