"""The point-to-point law on any arm from Python: runs after failures, and lines of the healthy arm."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.kernel.entry.session import rooms
from ftqp.kernel.entry.study_session import StudySession
from ftqp.kernel.layout.enums import Ending
from ftqp.kernel.layout.record import memory

Intervals = tuple[tuple[float, float], ...]
"""Intervals (low, high) of a joint [rad or m]."""

COARSE, FINE = 1e-5, 1e-9
"""Of a step of a run that counts as another one, and of one that is followed [rad or m]."""
ANY, CLOSE = 0.05, 1e-6
"""How near such a run must be to one of many ends that is taken for its own [rad or m]."""
STEPS = 1000
"""Of a coarse run before it goes on by a method for stiff equations; fine ones are shorter and have more."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Followed:
    """One run, from the failure to its end."""

    ending: Ending
    q: FloatArray  # The rest, or where it was given up, (n,) [rad or m]
    way: float  # Of all joints together [rad or m]
    arrived: float  # When |e| fell below the bound asked for [s]; 1e300 where it did not
    path: FloatArray  # Configurations on its way, (k, n) [rad or m]
    s: FloatArray  # Where they are on the orbit, dq/ds = v / (1/2 + |v|), (k,)
    t: FloatArray  # Their times, (k,) [s]
    errors: FloatArray  # |e| at them, (k,) [m]


class LawStudy:
    """Runs and lines of one arm with one goal; M is the inverse of the weights, ``unit`` a link [m]."""

    def __init__(self, session: StudySession, M: FloatArray, unit: float) -> None:
        self._session = session.copy()
        self._law = memory("law")
        L, n = self._rooms(), session.nv
        L.M[:n, :n], L.unit, L.plain = M, unit, np.array_equal(M, np.eye(n))

    def _rooms(self) -> Any:
        return rooms(self._law)

    def copy(self) -> "LawStudy":
        """A study of its own of the same: one for each thread."""
        return copy(self)

    def runs(self, starts: FloatArray, locked: IntArray, **options: float) -> tuple[Any, Any, Any]:
        """Endings (R,), ends (R, n) [rad or m], and way [rad or m], time of success [s] and steps, (R, 3).

        Of configurations at the failure, (R, n), and the joints that do not move, bit i for joint i, (R,).
        The options are those of ``_ask``.
        """
        self._ask(COARSE, ANY, **options)
        return self._run(starts, locked, np.empty((0, self._session.nv + 3)))

    def follow(self, start: FloatArray, locked: int, *, most: int = 60_000, **options: float) -> Followed:
        """One run with its way, of ``most`` rows: where there are more, they are further apart."""
        self._ask(FINE, CLOSE, **options)
        trace = np.empty((most, self._session.nv + 3))
        endings, ends, facts = self._run(start[None], np.array([locked]), trace)
        way = trace[: self._rooms().rows]
        return Followed(
            ending=Ending(int(endings[0])), q=ends[0], way=float(facts[0, 0]), arrived=float(facts[0, 1]),
            path=way[:, :-3].copy(), s=way[:, -3].copy(), t=way[:, -2].copy(), errors=way[:, -1].copy(),
        )  # fmt: skip

    def _ask(
        self,
        tolerance: float,
        close: float,
        *,
        horizon: float = np.inf,
        success: float = 0.0,
        gain: float = 1.0,
        v_max: float = np.inf,
    ) -> None:
        """What runs are asked: the tolerance of a step, and how close an end is that a run takes for its own.

        Runs end at ``horizon`` [s] where ``success`` is given, the |e| that counts as correct [m]; 0 asks for
        the rest instead. ``gain`` is K_e [1/s], ``v_max`` the largest commanded speed of the tip [m/s].
        """
        L = self._rooms()
        L.tolerance, L.close, L.horizon, L.success = tolerance, close, horizon, success
        L.slowness, L.per_speed = 1.0 / gain, 1.0 / v_max
        L.most = round(STEPS * (COARSE / tolerance) ** (1.0 / 3.0))

    def _run(self, starts: FloatArray, locked: IntArray, trace: FloatArray) -> tuple[Any, Any, Any]:
        starts, locked = np.ascontiguousarray(starts), np.ascontiguousarray(locked, dtype=np.int64)
        count = len(starts)
        endings, ends, facts = np.zeros(count, np.int64), np.zeros(starts.shape), np.zeros((count, 3))
        if count:
            things = count, len(trace), starts, locked, endings, ends, facts, trace, 0, count
            self._session.bind("study_runs", self._law, *things)()
        return endings, ends, facts

    def lines(
        self,
        starts: FloatArray,
        steps: int,
        box: Sequence[Intervals],
        *,
        circular: Any = True,
        keep: bool = False,
    ) -> tuple[FloatArray, BoolArray, FloatArray, BoolArray]:
        """Shares inside (C, n + 1), failed (C,), nodes (C, steps + 1, n) and whether inside there.

        Of lines from configurations, (C, n), in equal parts; the box has intervals for each joint, whose
        values count modulo one turn where it is ``circular``. Without ``keep`` nodes come back empty.
        """
        L, count, n = self._rooms(), len(starts), self._session.nv
        turns = np.broadcast_to(circular, n).astype(np.int64)
        L.intervals = max(len(intervals) for intervals in box)
        box_of = np.full((n, L.intervals, 2), -10.0)
        for i, intervals in enumerate(box):
            for k, (low, high) in enumerate(intervals):
                full = high - low >= (2.0 * np.pi if turns[i] else np.inf)
                box_of[i, k] = 0.0 if full else 0.5 * (low + high), 0.5 * (high - low)
                if full:
                    box_of[i, k, 1] = 20.0 if turns[i] else 1e300
        kept = count if keep else 0
        starts = np.ascontiguousarray(starts)
        inside, failed = np.zeros((count, n + 1)), np.zeros(count, np.int64)
        nodes = np.zeros((kept, steps + 1, n))
        within = np.zeros((kept, steps + 1, n + 1), np.int8)
        if count:
            things = (count, steps, int(keep), starts, box_of, turns, inside, failed, nodes, within, 0, count)
            self._session.bind("study_lines", self._law, *things)()
        return np.clip(inside, 0.0, 1.0), failed != 0, nodes, within != 0

    def __getstate__(self) -> dict[str, Any]:
        return {"session": self._session, "law": self._law}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._session = state["session"].copy()
        self._law = memory("law")
        self._law[:] = state["law"]
