"""Blocks: many ticks in closed loop at once, on an arm that does exactly what it is told."""

from collections.abc import Callable
from typing import final

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import BRAKING, LOCKED
from ftqp.kernel.layout.thresholds import STILL_SAMPLES
from ftqp.model.robot import Robot


@final
class Blocks:
    """Ticks of one planner led by the clock, run in compiled code; each is what ``Planner.step`` does.

    Args:
        session: The planner's.
        tick: The planner's compiled tick.
        robot: The arm.
    """

    def __init__(self, session: Session, tick: Callable[..., int], robot: Robot) -> None:
        n = robot.nv
        self._K = session.K
        self._state = np.zeros(2 * n)
        self._q, self._v = self._state[:n], self._state[n:]
        self._tick, self._inertia = tick, int(robot.has_inertia)
        self._block = session.bind("block")

    @property
    def q(self) -> FloatArray:
        """Joint positions after the last block, (nv,) [rad or m]; belongs to this object."""
        return self._q

    @property
    def v(self) -> FloatArray:
        """Joint velocities after the last block, (nv,) [rad/s or m/s]; belongs to this object."""
        return self._v

    def run(
        self, q: FloatArray, v: FloatArray, targets: FloatArray, rows: FloatArray, places: IntArray
    ) -> int:
        """Make a tick for each target: how many were made, fewer where a step would have raised.

        None is made while the planner takes a failed joint to be elsewhere than it is, or does not know yet
        that it stands: that joint does not do what it is told.

        Args:
            q: Joint positions at the first tick, (nv,) [rad or m].
            v: Joint velocities there, (nv,) [rad/s or m/s].
            targets: Packed targets, (K, 29).
            rows: Rows of numbers, (K, width), contiguous; the fields of ``BLOCK_FIELDS`` are filled in.
            places: Where each of them begins in a row, (11,).
        """
        if self._K.faults.working < len(q) and not self._is_settled():
            return 0
        self._q[:], self._v[:] = q, v
        packed = np.ascontiguousarray(targets)
        return self._block(
            self._tick,
            self._q,
            self._v,
            packed,
            self._state.ctypes.data,
            0,
            len(packed),
            self._inertia,
            rows.ctypes.data,
            rows.shape[1],
            places.ctypes.data,
        )

    def _is_settled(self) -> bool:
        """Whether the planner's failed joints are where they are measured, and known to stand if locked."""
        feedback, code = self._K.feedback, self._K.faults.code
        if not feedback.active:
            return True
        known = np.all(feedback.still[code == LOCKED] >= STILL_SAMPLES) and not np.any(code == BRAKING)
        return bool(feedback.exact and known)
