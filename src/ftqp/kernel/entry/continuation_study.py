"""Continuations after failures from Python: many pairs of joint and instant on one path, on all cores."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import rooms, share_out
from ftqp.kernel.entry.study_session import StudySession, packed_goals
from ftqp.kernel.layout.other_records import FACTS, FAILED_JOINTS
from ftqp.kernel.layout.record import dtype

EXACT_ERROR = 1e-5
"""An error from which on an exact continuation is lost [m, rad]."""
WEIGHT, CAUTION = 1e4, 0.5
"""Of a bounded continuation: of the task in its QP, and how much of the way to a limit a sample may take."""
LOCKED = -1.0
"""The share of a joint that is locked. A convention: shares of joints that move are positive."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Continuations:
    """How many continuations end; see ``Survival``."""

    status: IntArray  # A ``Survival`` each, (k,)
    sample: IntArray  # The first sample that was lost, or the last one of the path, (k,)
    position: FloatArray  # The largest error of position, up to where it was lost, (k,) [m]
    rotation: FloatArray  # The same of rotation, (k,) [rad]
    margin: FloatArray  # The least distance of a moving joint from its limits, (k,) [rad or m]; inf without
    hurry: FloatArray  # The largest share of a speed limit, (k,)
    clearance: FloatArray  # The least distance of two bodies that are kept apart, (k,) [m]; inf without


class ContinuationStudy:
    """Continuations along one path, whose samples are (N + 1, 4, 4) goals at a distance of ``dt`` [s]."""

    def __init__(
        self,
        session: StudySession,
        goals: Any,
        dt: float,
        *,
        q_min: Any,
        q_max: Any,
        v_max: Any,
        a_max: Any,
        near: float = 2e-3,
        turned: float = 2e-2,
    ) -> None:
        self._session = session.copy()
        self._goals = packed_goals(goals)
        self._memory = np.zeros(1, dtype("continuation"))
        self._tolerances = near, turned
        C: Any = rooms(self._memory)
        n = session.nv
        C.dt, C.weight, C.caution, C.share = dt, WEIGHT, CAUTION, LOCKED
        C.q_min[:n], C.q_max[:n], C.v_max[:n], C.a_max[:n] = q_min, q_max, v_max, a_max

    def runs(
        self,
        q: Any,
        samples: Any,
        failed: Any,
        *,
        speed: Any = None,
        bounded: bool = False,
        whole: bool = False,
        share: float | None = None,
        threads: int | None = None,
        path: FloatArray | None = None,
    ) -> Continuations:
        """How continuations end, on all cores; the result does not depend on how they are shared out.

        They begin at q, (k, n), at samples, (k,), as one joint fails, (k,), or two, (k, 2), -1 for none: at a
        ``speed`` of theirs they brake, else they are locked at once; with a ``share`` of their speed limits
        left they go on. They are ``bounded`` by QPs and then, where ``whole``, followed to the end although
        lost; else the joints left must be as many as rows. The samples of one that is alone go into ``path``.
        """
        q, samples = np.ascontiguousarray(q, dtype=np.float64), np.ascontiguousarray(samples, dtype=np.int64)
        k, last = len(q), len(self._goals) - 1
        joints, speeds = np.full((k, FAILED_JOINTS), -1, np.int64), np.zeros((k, FAILED_JOINTS))
        failed = np.asarray(failed, dtype=np.int64).reshape(k, -1)
        joints[:, : failed.shape[1]] = failed
        if speed is not None:
            speeds[:, : failed.shape[1]] = np.asarray(speed, dtype=np.float64).reshape(k, -1)
        self._check(q, samples, joints, exact=not bounded)
        facts = np.zeros((k, FACTS))
        given = self._goals, q, samples, joints, speeds, facts, path
        things = k, last + 1, int(path is not None), int(bounded), *given

        def work(first: int, last: int) -> None:
            session, memory = self._session.copy(), self._memory.copy()
            C: Any = rooms(memory)
            C.near, C.turned = self._tolerances if bounded else (EXACT_ERROR, EXACT_ERROR)
            C.whole, C.share = whole, LOCKED if share is None else share
            session.bind("continuations", memory, *things, first, last)()

        share_out(work, k, threads)
        status, sample, position, rotation, margin, hurry, clearance = facts.T.copy()
        return Continuations(
            status=status.astype(np.int64), sample=sample.astype(np.int64), position=position,
            rotation=rotation, margin=np.where(margin > 1e299, np.inf, margin), hurry=hurry,
            clearance=clearance,
        )  # fmt: skip

    def motion(self, q: Any, sample: int, failed: Any, *, speed: Any = None, **how: Any) -> FloatArray:
        """The samples of one continuation, as in ``runs``, (N + 1 - sample, n), NaN behind its end."""
        path = np.full((len(self._goals), self._session.nv), np.nan)
        speed = None if speed is None else np.atleast_1d(speed)[None]
        one = np.asarray(q)[None], [sample], np.atleast_1d(failed)[None]
        self.runs(*one, speed=speed, threads=1, path=path, **how)
        path[0] = q
        return path[: len(self._goals) - sample]

    def tracks(
        self, starts: Any, speeds: Any, threads: int | None = None
    ) -> tuple[FloatArray, IntArray, FloatArray]:
        """Motions along the path from starts, (k, n), at self-motion speeds of each sample, (k, N) [rad/s].

        q (k, N + 1, n), NaN behind the last sample that was reached; last samples (k,); errors (k,) [m].
        """
        starts, speeds = np.asarray(starts, dtype=np.float64), np.array(speeds, dtype=np.float64, order="C")
        count, samples = len(starts), len(self._goals)
        if starts.shape != (count, self._session.nv) or speeds.shape != (count, samples - 1):
            raise InputError(
                f"starts have shape {starts.shape} and speeds {speeds.shape}, expected (k, "
                f"{self._session.nv}), (k, {samples - 1})"
            )
        q, facts = np.full((count, samples, self._session.nv), np.nan), np.zeros((count, 2))
        q[:, 0] = starts

        def work(first: int, last: int) -> None:
            session, memory = self._session.copy(), self._memory.copy()
            things = count, samples, self._goals, speeds, q, facts, first, last
            session.bind("self_speed_tracks", memory, *things)()

        share_out(work, count, threads)
        return q, facts[:, 0].astype(np.int64), facts[:, 1].copy()

    def _check(self, q: FloatArray, samples: IntArray, failed: IntArray, *, exact: bool) -> None:
        n, m, k, last = self._session.nv, self._session.m, len(q), len(self._goals) - 1
        if q.shape != (k, n) or samples.shape != (k,):
            raise InputError(f"q has shape {q.shape} and samples {samples.shape}, expected (k, {n}), (k,)")
        if k and not (samples.min() >= 0 and samples.max() <= last):
            raise InputError(f"samples are {samples.min()} to {samples.max()}, expected 0 to {last}")
        if k and not (failed.min() >= -1 and failed.max() < n):
            raise InputError(f"failed has joints {failed.min()} to {failed.max()}, expected -1 to {n - 1}")
        count = (failed >= 0).sum(axis=1) - ((failed[:, 0] == failed[:, 1]) & (failed[:, 0] >= 0))
        if exact and (n - count != m).any():
            raise InputError(
                f"{n} joints with {count.max(initial=0)} locked leave not as many as {m} rows; bound them"
            )
