"""Studies of a planar arm from Python: runs after failures, and straight lines of the healthy arm."""

from typing import Any

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.kernel.compiled.kernel import load
from ftqp.kernel.entry.session import rooms
from ftqp.kernel.entry.table import EXACT
from ftqp.kernel.layout.planar_memory import planar_dtype

Intervals = tuple[tuple[float, float], ...]
"""Circular intervals (low, high) [rad]."""


class PlanarStudy:
    """Memory of one planar arm and one goal.

    Lengths are in mean link lengths, so that tolerances mean the same for every arm.

    Args:
        link: Lengths of the links, (n,), their mean 1.
        M: The inverse of the weights, (n, n), its mean diagonal 1.
        goal: Where the tip is to go, (2,).
    """

    def __init__(self, link: FloatArray, M: FloatArray, goal: FloatArray) -> None:
        self._n = len(link)
        self._memory = np.zeros(1, planar_dtype(self._n))
        P = self._P = rooms(self._memory)
        P.link[:], P.M[:], P.goal[:] = link, M, goal

    def runs(
        self,
        starts: FloatArray,
        locked: IntArray,
        *,
        tolerance: float = 1e-5,
        horizon: float = np.inf,
        success: float = 0.0,
        gain: float = 1.0,
        v_max: float = np.inf,
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """Endings (R,), ends (R, n) [rad], and way [rad], time of success [s] and steps, (R, 3).

        Args:
            starts: Configurations at the failure, (R, n) [rad].
            locked: Which joints do not move, bit i for joint i, (R,).
            tolerance: Of a step [rad].
            horizon: Runs end then [s]; it counts where ``success`` is given.
            success: The |e| that counts as correct, in mean link lengths; 0 asks for the rest instead.
            gain: K_e [1/s].
            v_max: The largest commanded speed of the tip, in mean link lengths per second.
        """
        P, count = self._P, len(starts)
        P.tolerance, P.horizon, P.success = tolerance, horizon, success
        P.slowness, P.per_speed = 1.0 / gain, 1.0 / v_max
        starts, locked = np.ascontiguousarray(starts), np.ascontiguousarray(locked, dtype=np.int64)
        endings, ends, facts = np.zeros(count, np.int64), np.zeros((count, self._n)), np.zeros((count, 3))
        if count:
            self._call("planar_runs", count, [count], (starts, locked, endings, ends, facts))
        return endings, ends, facts

    def lines(
        self, starts: FloatArray, steps: int, boxes: "list[list[Intervals]]", *, by_joints: bool, keep: bool
    ) -> tuple[FloatArray, BoolArray, FloatArray, BoolArray]:
        """Shares inside (C, n + 1), failed (C,), nodes (C, steps + 1, n) and whether inside there.

        Args:
            starts: Configurations, (C, n) [rad].
            steps: Equal parts of each line.
            boxes: For each box, for each joint, its intervals; at most two boxes of two intervals each.
            by_joints: Whether lengths are those of the joints' way; else those of the tip's.
            keep: Whether nodes are wanted; without, they come back empty.
        """
        P, count, n = self._P, len(starts), self._n
        P.box[:] = -10.0
        P.boxes, P.by_joints = len(boxes), by_joints
        for b, box in enumerate(boxes):
            for i, intervals in enumerate(box):
                for k, (low, high) in enumerate(intervals):
                    full = high - low >= 2.0 * np.pi
                    P.box[b, i, k] = 0.5 * (low + high), 10.0 if full else 0.5 * (high - low)
        kept = count if keep else 0
        starts = np.ascontiguousarray(starts)
        inside, failed = np.zeros((count, n + 1)), np.zeros(count, np.int64)
        nodes = np.zeros((kept, steps + 1, n))
        within = np.zeros((kept, steps + 1, n + 1), np.int8)
        if count:
            self._call("planar_lines", count, [count, steps, keep], (starts, inside, failed, nodes, within))
        return np.clip(inside, 0.0, 1.0), failed != 0, nodes, within != 0

    def _call(self, name: str, count: int, numbers: list[Any], arrays: tuple[Any, ...]) -> None:
        table = np.array([*numbers, *(array.ctypes.data for array in arrays)], dtype=np.int64)
        load(EXACT[name], self._n)(self._memory.ctypes.data, table.ctypes.data, 0, count)
