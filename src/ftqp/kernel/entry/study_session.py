"""The session of a study: task values, solutions and self-motions of one arm, in bulk.

Configurations are (k, nv) or (nv,) [rad or m]; lengths are in metres.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import Call, bound, rooms, share_out
from ftqp.kernel.layout.enums import CurveEnd
from ftqp.kernel.layout.other_records import GOAL_SIZE
from ftqp.kernel.layout.record import check_joints, dtype, load_chain

TOLERANCE = 1e-12
"""Error of a solution that counts as none [m], where the characteristic length is at most one metre. Some
thousand times the rounding of a pose."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TracedCurve:
    """A self-motion as it was traced."""

    q: FloatArray  # Its points, unwrapped, (k, nv) [rad or m]
    parts: FloatArray  # Arc lengths of the segments that end in each point, (k,); the first one closes it
    end: CurveEnd
    winding: IntArray  # Turns of each joint on one round, (nv,)
    length: float  # Its arc length [rad or m]
    least: float  # The smallest singular value of the task's Jacobian on it [m]
    crossed: bool  # Whether it passes a crossing with itself


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpreadCurves:
    """Self-motions of many goals, each as points at equal arc lengths."""

    q: FloatArray  # Points, (goals, curves, points, nv) [rad or m]
    counts: IntArray  # How many curves each goal has, (goals,); negative where there was no room for more
    ends: IntArray  # How each ended, a ``CurveEnd``, (goals, curves)
    lengths: FloatArray  # Arc lengths, (goals, curves) [rad or m]
    least: FloatArray  # Smallest singular values, (goals, curves) [m]
    crossed: Any  # Whether a curve passes a crossing with itself, (goals, curves)
    winding: IntArray  # Turns of each joint on one round, (goals, curves, nv)


class StudySession:
    """Compiled studies of one arm and one set of task rows, by their index, (m,), in the rooms of ``S``.

    ``constants`` go by the names of ``load_chain``; angular rows are multiplied by ``length``. Curves
    take steps of at most ``step`` and end at q_min and q_max; joints that ``wraps`` count modulo one
    turn. With ``axis`` rx and ry are the shortest turn of the tool's z axis, along the goal's x and y axes,
    and derivatives of A are not known.
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
        nv, m = len(constants["mass"]), len(rows)
        check_joints(nv)
        self._begin(nv, m, np.zeros(1, dtype("study")))
        load_chain(self.S, **constants)
        study = self.S.study
        study.m, study.turns, study.length = m, any(row > 2 for row in rows), length
        study.rows[:m], study.axis = rows, axis
        study.q_min[:nv], study.q_max[:nv], study.wraps[:nv] = q_min, q_max, wraps
        study.step, study.tolerance = step, TOLERANCE * max(1.0, length)
        self.aim(np.eye(4))

    def _begin(self, nv: int, m: int, memory: Any) -> None:
        self.nv, self.m, self.memory = nv, m, memory
        self.S: Any = rooms(memory)

    def aim(self, pose: Any) -> None:
        """Make a pose, (4, 4), the goal."""
        self.S.study.goal[:] = packed_goals(pose)[0]

    def hold(self, joints: Sequence[int] = ()) -> None:
        """Let these joints stand still, and no others."""
        self.S.study.held[: self.nv] = np.isin(np.arange(self.nv), joints)

    def copy(self) -> "StudySession":
        """A session of its own that holds the same."""
        return copy(self)

    def bind(self, name: str, *things: Any) -> Call:
        """An entry point on this record, further first arguments given; see ``bound``."""
        return bound(name, self.memory, *things)

    def values(self, q: Any, *, rates: bool = False) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """e, (k, m), A and D = -de/dq, (k, m, nv), and with ``rates`` H[l] = dA/dq_l, (k, nv, m, nv)."""
        q = np.ascontiguousarray(q, dtype=np.float64)
        k, m, n = len(q), self.m, self.nv
        e, A, D = np.empty((k, m)), np.empty((k, m, n)), np.empty((k, m, n))
        H = np.empty((k if rates else 0, n, m, n))
        self.bind("study_values", k, q, e, A, D, H, int(rates))()
        return e, A, D, H

    def keep_clear(self, room: Any) -> None:
        """Count on bodies that are to be kept apart from now on, by the room of a planner, (1,)."""
        self.memory["scene"] = room

    def clearances(self, q: Any) -> FloatArray:
        """The least distance of two bodies that are to be kept apart, (k,) [m]; inf without any."""
        q = np.ascontiguousarray(q, dtype=np.float64)
        found = np.empty(len(q))
        self.bind("study_clearances", len(q), q, found)()
        return found

    def solutions(
        self, starts: Any, goals: Any = None, *, bounded: bool = False, near: bool = False
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Configurations brought to the goal: q, (k, nv), the error left, (k,) [m], and sigma_min, (k,) [m].

        Each start has a goal of its own, (k, 4, 4), or that of the session. ``bounded``: joints stop at the
        limits; ``near``: the starts are so near that plain Newton steps do.
        """
        q = np.array(starts, dtype=np.float64, order="C")
        before = self.S.study.goal.copy()
        goal = before[None] if goals is None else packed_goals(goals)
        left = np.empty((len(q), 2))
        self.bind("study_solutions", len(q), q, len(goal), goal, left, int(bounded), int(near))()
        self.S.study.goal[:] = before
        return q, left[:, 0].copy(), left[:, 1].copy()

    def curve(self, start: Any, most: int = 100_000) -> TracedCurve:
        """The self-motion through a solution, of so many points at most."""
        path, parts = np.empty((most, self.nv)), np.empty(most)
        q = np.ascontiguousarray(start, dtype=np.float64)
        rows = self.bind("study_curve", q, path, most, parts)()
        study = self.S.study
        return TracedCurve(
            q=path[:rows].copy(), parts=parts[:rows].copy(), end=CurveEnd(int(study.closed)),
            winding=study.winding[: self.nv].copy(), length=float(study.arc), least=float(study.least),
            crossed=bool(study.crossed),
        )  # fmt: skip

    def self_motions(
        self, starts: Any, *, quiet: int, curves: int = 64, most: int = 100_000
    ) -> list[TracedCurve]:
        """All self-motions of the session's goal that are found from the starts, (k, nv).

        It ends when ``quiet`` solutions in a row lay on known curves; ``most`` points are those of all.
        """
        goal = self.S.study.goal.reshape(1, GOAL_SIZE).copy()
        found = _Found(self, goal, starts, quiet, curves, 0)
        path, parts, firsts = found.fill(self, most, 0, 1)
        count = int(found.counts[0])
        if count < 0:
            raise InputError(
                f"a goal has more than {curves} self-motions or {most} points of them; take a larger step"
            )
        return [
            TracedCurve(
                q=path[firsts[j] : firsts[j + 1]].copy(), parts=parts[firsts[j] : firsts[j + 1]].copy(),
                end=CurveEnd(int(end)), winding=found.windings[0, j].copy(), length=float(length),
                least=float(least), crossed=bool(crossed),
            )
            for j, (end, length, least, crossed) in enumerate(found.facts[0, :count])
        ]  # fmt: skip

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
        """All self-motions of many goals, (k, 4, 4), each as points at equal arc lengths, on all cores.

        The result does not depend on how goals are shared out. The other arguments are as in
        ``self_motions``, of each goal.
        """
        found = _Found(self, packed_goals(goals), starts, quiet, curves, points)

        def work(first: int, last: int) -> None:
            found.fill(self.copy(), most, first, last)

        share_out(work, len(found.counts), threads)
        ends, lengths, least, crossed = np.moveaxis(found.facts, -1, 0)
        return SpreadCurves(
            q=found.q, counts=found.counts, ends=ends.astype(np.int64), lengths=lengths, least=least,
            crossed=crossed != 0.0, winding=found.windings,
        )  # fmt: skip

    def __getstate__(self) -> dict[str, Any]:
        return {"nv": self.nv, "m": self.m, "memory": self.memory}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._begin(state["nv"], state["m"], state["memory"].copy())


def packed_goals(poses: Any) -> FloatArray:
    """Goals as the kernel takes them, (k, 12), from poses (4, 4) or (k, 4, 4)."""
    return np.ascontiguousarray(
        np.asarray(poses, dtype=np.float64).reshape(-1, 4, 4)[:, :3].reshape(-1, GOAL_SIZE)
    )


class _Found:
    """Self-motions of many goals."""

    def __init__(
        self, session: StudySession, goals: FloatArray, starts: Any, quiet: int, curves: int, points: int
    ) -> None:
        k, n = len(goals), session.nv
        self._curves = curves
        self.q = np.full((k, curves, points, n), np.nan)
        self.counts, self.facts = np.zeros(k, np.int64), np.zeros((k, curves, 4))
        self.windings = np.zeros((k, curves, n), np.int64)
        starts = np.ascontiguousarray(starts, dtype=np.float64)
        arrays = goals, starts, self.q, self.counts, self.facts, self.windings
        self._things = k, len(starts), quiet, curves, points, *arrays

    def fill(
        self, session: StudySession, most: int, first: int, last: int
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Fill in the goals ``first`` to ``last - 1``: points, parts and first rows of the last one."""
        path, parts = np.empty((most, session.nv)), np.empty(most)
        firsts = np.zeros(self._curves + 1, np.int64)
        session.bind("study_self_motions", *self._things, path, most, parts, firsts, first, last)()
        return path, parts, firsts
