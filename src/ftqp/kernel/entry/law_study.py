"""The point-to-point law on any arm from Python: runs after failures, and lines of the healthy arm."""

from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.kernel.entry.session import rooms
from ftqp.kernel.entry.study_session import StudySession, packed_goals
from ftqp.kernel.layout.law_room import law_dtype


class LawStudy:
    """Runs and lines of one arm with one goal.

    Args:
        session: Studies of the arm with the goal set; it is copied.
        M: The inverse of the weights, (n, n).
        unit: The mean length of a link [m].
        tolerance: Of a step of a run [rad or m].
    """

    def __init__(self, session: StudySession, M: FloatArray, unit: float, *, tolerance: float = 1e-5) -> None:
        self._session = session.copy()
        self._law = np.zeros(1, law_dtype(session.capacity))
        L: Any = rooms(self._law)
        n = session.nv
        L.M[:n, :n], L.unit, L.tolerance = M, unit, tolerance

    def runs(self, starts: FloatArray, locked: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Endings (R,), ends (R, n) [rad or m] and the |e| there (R,) [m].

        Args:
            starts: Configurations at the failure, (R, n) [rad or m].
            locked: The joint that does not move, (R,).
        """
        q, which = np.array(starts, dtype=np.float64, order="C"), np.array(locked, dtype=np.int64)
        endings, sizes = np.zeros(len(q), np.int64), np.zeros(len(q))
        arrays = (q, which, endings, sizes)
        self._session.bind("study_runs", self._law)(len(q), *(array.ctypes.data for array in arrays))
        return endings, q, sizes

    def lines(self, starts: FloatArray, poses: FloatArray, twist: FloatArray) -> tuple[FloatArray, IntArray]:
        """Configurations at the nodes, (C, K + 1, n), NaN after a failure, and the last node of each (C,).

        Args:
            starts: Configurations at the first pose, (C, n) [rad or m].
            poses: Poses of the nodes, (K + 1, 4, 4).
            twist: Motion of the task rows from a node to the next, (m,) [m].
        """
        starts, goals = np.ascontiguousarray(starts), packed_goals(poses)
        wanted = np.ascontiguousarray(twist)
        K = len(goals) - 1
        q, done = np.full((len(starts), K + 1, self._session.nv), np.nan), np.zeros(len(starts), np.int64)
        kept = self._session.S.study.goal.copy()
        arrays = (starts, goals, wanted, q, done)
        self._session.bind("study_lines", self._law)(len(starts), K, *(array.ctypes.data for array in arrays))
        self._session.S.study.goal[:] = kept
        return q, done
