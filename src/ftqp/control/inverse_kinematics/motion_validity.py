"""Where an arm may stand: its motors hold it, and the scene is clear."""

from typing import Any, Final, Protocol, final

import numpy as np

from ftqp.control.scene.placed_shapes import Clearance
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.kernel.entry.session import ArmSession
from ftqp.kernel.layout.thresholds import STRONG
from ftqp.model.robot import Robot

HELD: Final = STRONG
"""A motor may need this share of its torque limit to hold the arm at rest. Two per cent are left to the
feedback."""
NEARER: Final = 1e-3
"""Bodies may be nearer than a planner keeps them by so much [m], so that an arm that rests as near as it gets
may go away from there. A convention, far below what anybody keeps."""


class Surrounded(Protocol):
    """What knows how near an arm is to itself and to its scene; an ``ftqp.Planner`` does."""

    @property
    def clearance(self) -> Clearance | None:
        """How far the arm keeps; None where it keeps clear of nothing."""

    def distances(self, q: Any) -> dict[tuple[str, str], FloatArray]:
        """The distance of each pair of bodies at postures (S, nv), (S,) each [m]."""


@final
class MotionValidity:
    """Asks of places whether the arm may stand there."""

    def __init__(
        self,
        robot: Robot,
        tau_max: FloatArray,
        counts: BoolArray,
        surrounded: Surrounded | None = None,
    ) -> None:
        self._robot = robot
        kept = None if surrounded is None else surrounded.clearance
        self._surrounded = None if kept is None else surrounded
        self._least = 0.0 if kept is None else kept.keep - NEARER
        self._limit = np.where(counts, tau_max, np.inf)
        self._weighs = robot.has_inertia and bool(np.isfinite(self._limit).any())
        self._arm = ArmSession(robot.chain.constants())

    def effort(self, places: FloatArray) -> FloatArray:
        """The largest share of a torque limit that holds the arm at rest at each place, (k,)."""
        if not self._weighs:
            return np.zeros(len(places))
        arm, n = self._arm, self._robot.nv
        share = np.empty(len(places))
        for k, q in enumerate(places):
            arm.dynamics(q)
            share[k] = float((np.abs(arm.K.kinematics.h[:n]) / self._limit).max())
        return share

    def distances(self, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The least distance of two bodies, (k,) [m]; the same, less what they have to be apart."""
        apart = np.full(len(places), np.inf)
        if self._surrounded is not None:
            for distance in self._surrounded.distances(places).values():
                apart = np.minimum(apart, distance)
        return apart, apart - self._least
