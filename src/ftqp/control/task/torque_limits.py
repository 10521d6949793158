"""TorqueLimits: the torque limits of the joints, as an entry of a planner's list of constraints."""

from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.core.errors import InputError
from ftqp.model.robot import Robot


@final
@dataclass(frozen=True, slots=True)
class TorqueLimits:
    """No joint needs more torque than its ``tau_max``: |M a + h| <= tau_max.

    This is what ``ftqp.Planner(torque_limits=True)`` asks for, as an entry of ``constraints``. Every planner
    of an arm with masses and torque limits has them unless ``torque_limits=False``; who lists them is told
    where they could have no effect.
    """

    @property
    def label(self) -> str:
        """What it is called."""
        return "torque limits"

    def refuse_without_effect(self, robot: Robot, wanted: bool) -> None:
        """Refuse what could not be kept.

        Args:
            robot: The arm.
            wanted: The planner's ``torque_limits``.

        Raises:
            InputError: The planner is told to leave torque limits out, or the arm has no masses or no limits.
        """
        if not wanted:
            raise InputError(
                "constraints has TorqueLimits beside torque_limits=False, expected one of them; leave "
                "torque_limits out to have torque limits, or TorqueLimits to have none"
            )
        if not robot.has_inertia:
            raise InputError(
                f"constraints has TorqueLimits, which need masses, and {robot.name} has none; leave them out "
                "or give the model its masses"
            )
        if not np.isfinite(robot.limits.tau_max).any():
            raise InputError(
                f"constraints has TorqueLimits, and {robot.name} has no torque limit; leave them out or give "
                "it some by robot.with_limits(tau_max=...)"
            )
