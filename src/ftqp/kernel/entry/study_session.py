"""The session of a study: task values, solutions and self-motions of one arm, in bulk."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import Call, bound, rooms
from ftqp.kernel.entry.threads import share_out
from ftqp.kernel.layout.enums import CurveEnd
from ftqp.kernel.layout.other_records import GOAL_SIZE
from ftqp.kernel.layout.record import check_joints, dtype, load_chain

TOLERANCE = 1e-12
"""Error of a solution that counts as none [m], where the characteristic length is at most one metre. Some
thousand times the rounding of a pose."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TracedCurve:
    """A self-motion as it was traced.

    Attributes:
        q: Its points, unwrapped, (k, nv) [rad or m].
        parts: Arc lengths of the segments that end in each point, (k,); the first is that which closes it.
        end: How it ended.
        winding: Turns of each joint on one round, (nv,).
        length: Its arc length [rad or m].
        least: The smallest singular value of the task's Jacobian on it [m].
        crossed: Whether it passes a crossing with itself.
    """

    q: FloatArray
    parts: FloatArray
    end: CurveEnd
    winding: IntArray
    length: float
    least: float
    crossed: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpreadCurves:
    """Self-motions of many goals, each as points at equal arc lengths.

    Attributes:
        q: Points, (goals, curves, points, nv) [rad or m].
        counts: How many curves were found for each goal, (goals,); negative where there was no room for more.
        ends: How each ended, a ``CurveEnd``, (goals, curves).
        lengths: Arc lengths, (goals, curves) [rad or m].
        least: Smallest singular values, (goals, curves) [m].
        crossed: Whether a curve passes a crossing with itself, (goals, curves).
        winding: Turns of each joint on one round, (goals, curves, nv).
    """

    q: FloatArray
    counts: IntArray
    ends: IntArray
    lengths: FloatArray
    least: FloatArray
    crossed: Any
    winding: IntArray


class StudySession:
    """Compiled studies of one arm and one set of task rows.

    Args:
        constants: Those of the chain, by the argument names of ``load_chain``.
        rows: Which of x, y, z, rx, ry, rz count, by index, (m,).
        length: What angular rows are multiplied by [m].
        q_min: Where curves end, (nv,) [rad or m]; -inf without an end.
        q_max: The same above.
        wraps: Joints whose values count modulo one turn, (nv,).
        step: Largest step of a traced curve [rad or m].
        axis: Whether rx and ry are the shortest turn of the tool's z axis, along the goal's x and y axes;
            derivatives of A are not known then.

    Attributes:
        S: The rooms ``state``, ``kinematics``, ``chain``, ``ahead``, ``scene`` and ``study``.
    """

    def __init__(
        self,
        constants: dict[str, Any],
        rows: Sequence[int],
        length: float,
        *,
        q_min: Any,
        q_max: Any,
        wraps: Any,
        step: float = 0.05,
        axis: bool = False,
    ) -> None:
        self.nv, self.m = len(constants["mass"]), len(rows)
        check_joints(self.nv)
        self.memory = np.zeros(1, dtype("study"))
        self.S: Any = rooms(self.memory)
        load_chain(self.S, **constants)
        study = self.S.study
        study.m, study.turns, study.length = self.m, any(row > 2 for row in rows), length
        study.rows[: self.m], study.axis = rows, axis
        study.q_min[: self.nv], study.q_max[: self.nv], study.wraps[: self.nv] = q_min, q_max, wraps
        study.step, study.tolerance = step, TOLERANCE * max(1.0, length)
        self.aim(np.eye(4))

    def aim(self, pose: Any) -> None:
        """Make a pose, (4, 4), the goal."""
        self.S.study.goal[:] = packed_goals(pose)[0]

    def hold(self, joints: Sequence[int] = ()) -> None:
        """Let these joints stand still, and no others."""
        self.S.study.held[: self.nv] = np.isin(np.arange(self.nv), joints)

    def copy(self) -> "StudySession":
        """A session of its own that holds the same."""
        other = StudySession.__new__(StudySession)
        other.nv, other.m = self.nv, self.m
        other.memory = self.memory.copy()
        other.S = rooms(other.memory)
        return other

    def bind(self, name: str, *things: Any) -> Call:
        """An entry point on this record, further first arguments given; see ``bound``."""
        return bound(name, self.memory, *things)

    def values(self, q: Any, *, rates: bool = False) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """e, (k, m), A and D = -de/dq, (k, m, nv), and with ``rates`` H[l] = dA/dq_l, (k, nv, m, nv).

        Args:
            q: Configurations, (k, nv) [rad or m].
            rates: Whether H is asked for; without it H is empty.
        """
        q = np.ascontiguousarray(q, dtype=np.float64)
        k, m, n = len(q), self.m, self.nv
        e, A, D = np.empty((k, m)), np.empty((k, m, n)), np.empty((k, m, n))
        H = np.empty((k if rates else 0, n, m, n))
        self.bind("study_values", k, q, e, A, D, H, int(rates))()
        return e, A, D, H

    def keep_clear(self, room: Any) -> None:
        """Count on bodies that are to be kept apart from now on.

        Args:
            room: The room of a planner that keeps them apart, (1,).
        """
        self.memory["scene"] = room

    def clearances(self, q: Any) -> FloatArray:
        """The least distance of two bodies that are to be kept apart, (k,) [m]; inf without any.

        Args:
            q: Configurations, (k, nv) [rad or m].
        """
        q = np.ascontiguousarray(q, dtype=np.float64)
        found = np.empty(len(q))
        self.bind("study_clearances", len(q), q, found)()
        return found

    def solutions(
        self, starts: Any, goals: Any = None, *, bounded: bool = False, near: bool = False
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Configurations brought to the goal: q, (k, nv), the error left, (k,) [m], and sigma_min, (k,) [m].

        Args:
            starts: Where to start, (k, nv) [rad or m].
            goals: One goal each, (k, 4, 4); None is the goal of the session.
            bounded: Whether joints stop at the limits.
            near: Whether the starts are so near that plain Newton steps do.
        """
        q = np.array(starts, dtype=np.float64, order="C")
        goal = self.S.study.goal[None].copy() if goals is None else packed_goals(goals)
        left = np.empty((len(q), 2))
        before = self.S.study.goal.copy()
        self.bind("study_solutions", len(q), q, len(goal), goal, left, int(bounded), int(near))()
        self.S.study.goal[:] = before
        return q, left[:, 0].copy(), left[:, 1].copy()

    def curve(self, start: Any, most: int = 100_000) -> TracedCurve:
        """The self-motion through a solution.

        Args:
            start: The solution, (nv,) [rad or m].
            most: Points at most.
        """
        path, parts = np.empty((most, self.nv)), np.empty(most)
        q = np.ascontiguousarray(start, dtype=np.float64)
        rows = self.bind("study_curve", q, path, most, parts)()
        study = self.S.study
        return TracedCurve(
            q=path[:rows].copy(),
            parts=parts[:rows].copy(),
            end=CurveEnd(int(study.closed)),
            winding=study.winding[: self.nv].copy(),
            length=float(study.arc),
            least=float(study.least),
            crossed=bool(study.crossed),
        )

    def self_motions(
        self, starts: Any, *, quiet: int, curves: int = 64, most: int = 100_000
    ) -> list[TracedCurve]:
        """All self-motions of the session's goal that are found from the starts.

        Args:
            starts: Joint values to start from, (k, nv) [rad or m].
            quiet: It ends when so many solutions in a row lay on known curves.
            curves: Curves at most.
            most: Points at most, of all curves together.
        """
        path, parts, firsts = np.empty((most, self.nv)), np.empty(most), np.zeros(curves + 1, np.int64)
        goal = self.S.study.goal.reshape(1, GOAL_SIZE).copy()
        found = _Many(self, goal, starts, quiet, curves, 0)
        found.call(self, path, parts, firsts, 0, 1)
        count = int(found.counts[0])
        if count < 0:
            raise InputError(
                f"a goal has more than {curves} self-motions or {most} points of them; take a larger step"
            )
        return [
            TracedCurve(
                q=path[firsts[j] : firsts[j + 1]].copy(),
                parts=parts[firsts[j] : firsts[j + 1]].copy(),
                end=CurveEnd(int(found.facts[0, j, 0])),
                winding=found.windings[0, j].copy(),
                length=float(found.facts[0, j, 1]),
                least=float(found.facts[0, j, 2]),
                crossed=bool(found.facts[0, j, 3]),
            )
            for j in range(count)
        ]

    def spread_curves(
        self,
        goals: Any,
        starts: Any,
        *,
        points: int,
        quiet: int,
        curves: int,
        most: int = 20_000,
        threads: int | None = None,
    ) -> SpreadCurves:
        """All self-motions of many goals, each as points at equal arc lengths, on all cores.

        The result does not depend on how goals are shared out.

        Args:
            goals: Poses, (k, 4, 4).
            starts: Joint values to start from for each goal, (s, nv) [rad or m].
            points: Points of a curve.
            quiet: A goal is done when so many solutions in a row lay on known curves.
            curves: Curves of a goal at most.
            most: Points of a goal's curves at most.
            threads: How many; None is ``thread_count``.
        """
        found = _Many(self, packed_goals(goals), starts, quiet, curves, points)

        def work(first: int, last: int) -> None:
            path, parts = np.empty((most, self.nv)), np.empty(most)
            found.call(self.copy(), path, parts, np.zeros(curves + 1, np.int64), first, last)

        share_out(work, len(found.counts), threads)
        return SpreadCurves(
            q=found.q,
            counts=found.counts,
            ends=found.facts[..., 0].astype(np.int64),
            lengths=found.facts[..., 1],
            least=found.facts[..., 2],
            crossed=found.facts[..., 3] != 0.0,
            winding=found.windings,
        )

    def __getstate__(self) -> dict[str, Any]:
        return {"nv": self.nv, "m": self.m, "memory": self.memory}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.nv, self.m = state["nv"], state["m"]
        self.memory = state["memory"].copy()
        self.S = rooms(self.memory)


def packed_goals(poses: Any) -> FloatArray:
    """Goals as the kernel takes them, (k, 12), from poses (4, 4) or (k, 4, 4)."""
    return np.ascontiguousarray(
        np.asarray(poses, dtype=np.float64).reshape(-1, 4, 4)[:, :3].reshape(-1, GOAL_SIZE)
    )


class _Many:
    """Arrays of the self-motions of many goals, and the call that fills them."""

    def __init__(
        self, session: StudySession, goals: FloatArray, starts: Any, quiet: int, curves: int, points: int
    ) -> None:
        k, n = len(goals), session.nv
        self._goals = goals
        self._starts = np.ascontiguousarray(starts, dtype=np.float64)
        self.q = np.full((k, curves, points, n), np.nan)
        self.counts = np.zeros(k, np.int64)
        self.facts = np.zeros((k, curves, 4))
        self.windings = np.zeros((k, curves, n), np.int64)
        arrays = (self._goals, self._starts, self.q, self.counts, self.facts, self.windings)
        self._things = (k, len(self._starts), quiet, curves, points, *arrays)

    def call(
        self,
        session: StudySession,
        path: FloatArray,
        parts: FloatArray,
        firsts: IntArray,
        first: int,
        last: int,
    ) -> None:
        """Fill in the goals ``first`` to ``last - 1``."""
        things = path, len(path), parts, firsts, first, last
        session.bind("study_self_motions", *self._things, *things)()
