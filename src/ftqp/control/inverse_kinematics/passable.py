"""Where an arm may stand and pass: its motors hold it, kept points are on their sides, the scene is clear."""

from collections.abc import Callable, Sequence
from typing import final

import numpy as np

from ftqp.control.task.keep import Keep
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.kernel.entry.session import ArmSession
from ftqp.model.robot import Robot

HELD = 0.98
"""A motor may need this share of its torque limit to hold the arm at rest. Two per cent are left to the
feedback. A guess that the campaigns have not contradicted."""
Clearance = Callable[[FloatArray], FloatArray]
"""From places, (k, nv), to the arm's distance from its scene at each, (k,) [m]; negative inside of it."""


@final
class Passable:
    """Asks of places whether the arm may stand there; the one door for all who look ahead on a motion.

    Args:
        robot: The arm with its load.
        tau_max: Torque limits as believed, (nv,) [N m or N]; inf is none.
        counts: Which motors have to hold the arm, (nv,): a joint that has failed holds itself.
        keeps: Points and axes that are kept on their sides.
        clearance: The arm's distance from its scene; None where there is no scene.
    """

    def __init__(
        self,
        robot: Robot,
        tau_max: FloatArray,
        counts: BoolArray,
        keeps: Sequence[Keep] = (),
        clearance: Clearance | None = None,
    ) -> None:
        self._robot, self._keeps, self._clearance = robot, tuple(keeps), clearance
        self._limit = np.where(counts, tau_max, np.inf)
        self._weighs = robot.has_inertia and bool(np.isfinite(self._limit).any())
        self._arm = ArmSession(robot.chain.constants())

    def effort(self, places: FloatArray) -> FloatArray:
        """The largest share of a torque limit that holds the arm at rest at each place, (k,).

        Args:
            places: Joint positions, (k, nv) [rad or m].
        """
        if not self._weighs:
            return np.zeros(len(places))
        arm, n = self._arm, self._robot.nv
        share = np.empty(len(places))
        for k, q in enumerate(places):
            arm.dynamics(q)
            share[k] = float((np.abs(arm.K.kinematics.h[:n]) / self._limit).max())
        return share

    def clearance(self, places: FloatArray) -> FloatArray:
        """The least distance from the scene and from what points are kept from, (k,) [m, of a cone rad].

        Args:
            places: Joint positions, (k, nv) [rad or m].
        """
        free = np.full(len(places), np.inf)
        for keep in self._keeps:
            for k, q in enumerate(places):
                free[k] = min(free[k], keep.distance(self._robot.pose(q, keep.frame)))
        return free if self._clearance is None else np.minimum(free, self._clearance(places))

    def at(self, places: FloatArray, effort: float = HELD) -> BoolArray:
        """Whether the arm may be at each place, (k,).

        Args:
            places: Joint positions, (k, nv) [rad or m].
            effort: The largest share of a torque limit that may hold it.
        """
        good: BoolArray = (self.effort(places) <= effort) & (self.clearance(places) > 0.0)
        return good
