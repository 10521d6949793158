"""Continuations after failures from Python: many pairs of joint and instant on one path, on all cores."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.session import rooms
from ftqp.kernel.entry.study_session import StudySession, packed_goals
from ftqp.kernel.entry.threads import share_out
from ftqp.kernel.layout.other_records import FACTS, FAILED_JOINTS
from ftqp.kernel.layout.record import dtype

EXACT_ERROR = 1e-5
"""An error from which on an exact continuation is lost [m, rad]."""
LOCKED = -1.0
"""The share of a joint that is locked. A convention: shares of joints that move are positive."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Continuations:
    """How many continuations end; see ``Survival``.

    Attributes:
        status: A ``Survival`` each, (k,).
        sample: The first sample that was lost, or the last one of the path, (k,).
        position: The largest error of position, up to where it was lost, (k,) [m].
        rotation: The same of rotation, (k,) [rad].
        margin: The least distance of a joint that moves from its limits, (k,) [rad or m]; inf without limits.
        hurry: The largest share of a speed limit, (k,).
        clearance: The least distance of two bodies that are to be kept apart, (k,) [m]; inf without any.
    """

    status: IntArray
    sample: IntArray
    position: FloatArray
    rotation: FloatArray
    margin: FloatArray
    hurry: FloatArray
    clearance: FloatArray


class ContinuationStudy:
    """Continuations along one path.

    Args:
        session: Studies of the arm with the task's rows; it is copied.
        goals: Poses of all samples, (N + 1, 4, 4).
        dt: The time between samples [s].
        q_min: Lowest positions, (n,) [rad or m].
        q_max: Highest positions, (n,) [rad or m].
        v_max: Largest speeds, (n,) [rad/s or m/s].
        a_max: Decelerations with which a joint that fails brakes, (n,) [rad/s2 or m/s2].
        near: The error of position from which on a bounded continuation is lost [m].
        turned: The same of rotation [rad].
        weight: Of the task in the QP of a bounded continuation.
        caution: The share of the way to a limit that one sample of a bounded continuation may take.
    """

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
        weight: float = 1e4,
        caution: float = 0.5,
    ) -> None:
        self._session = session.copy()
        self._goals = packed_goals(goals)
        self._memory = np.zeros(1, dtype("continuation"))
        self._tolerances = near, turned
        C: Any = rooms(self._memory)
        n = session.nv
        C.dt, C.weight, C.caution, C.share = dt, weight, caution, LOCKED
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
    ) -> Continuations:
        """How continuations end, on all cores; the result does not depend on how they are shared out.

        Args:
            q: Configurations at the failure, (k, n) [rad or m].
            samples: Samples of the failures, (k,).
            failed: The joint that fails, (k,), or two of them, (k, 2), -1 for none.
            speed: With which they begin to brake, of the shape of ``failed``; None locks them at once.
            bounded: Whether by bounded QPs; else the joints left must be as many as rows.
            whole: Whether a bounded continuation that is lost is followed to the end all the same.
            share: What is left of the speed limit of joints that are degraded; None: they are locked.
            threads: How many; None is ``thread_count``.
        """
        call = self._call(q, samples, failed, speed, None, exact=not bounded)
        entry = "bounded_continuations" if bounded else "exact_continuations"

        def work(first: int, last: int) -> None:
            session, memory = self._session.copy(), self._prepared(bounded, whole, share)
            session.bind(entry, memory, *call.things, first, last)()

        share_out(work, len(call.q), threads)
        facts = call.facts
        return Continuations(
            status=facts[:, 0].astype(np.int64),
            sample=facts[:, 1].astype(np.int64),
            position=facts[:, 2].copy(),
            rotation=facts[:, 3].copy(),
            margin=np.where(facts[:, 4] > 1e299, np.inf, facts[:, 4]),
            hurry=facts[:, 5].copy(),
            clearance=facts[:, 6].copy(),
        )

    def motion(
        self,
        q: Any,
        sample: int,
        failed: Any,
        *,
        speed: Any = None,
        bounded: bool = False,
        whole: bool = False,
        share: float | None = None,
    ) -> FloatArray:
        """The samples of one continuation from the failure on, (N + 1 - sample, n), NaN behind its end.

        Args:
            q: The configuration at the failure, (n,) [rad or m].
            sample: Of the failure.
            failed: The joint that fails, or two of them.
            speed: As in ``runs``.
            bounded: As in ``runs``.
            whole: As in ``runs``.
            share: As in ``runs``.
        """
        path = np.full((len(self._goals), self._session.nv), np.nan)
        speeds = None if speed is None else np.atleast_1d(speed)[None]
        call = self._call(
            np.asarray(q)[None], [sample], np.atleast_1d(failed)[None], speeds, path, exact=not bounded
        )
        entry = "bounded_continuations" if bounded else "exact_continuations"
        session, memory = self._session.copy(), self._prepared(bounded, whole, share)
        session.bind(entry, memory, *call.things, 0, 1)()
        path[0] = q
        return path[: len(self._goals) - sample]

    def tracks(
        self, starts: Any, speeds: Any, threads: int | None = None
    ) -> tuple[FloatArray, IntArray, FloatArray]:
        """Motions along the path at given self-motion speeds: q, last samples and largest errors.

        Args:
            starts: Configurations at the first sample, (k, n) [rad or m].
            speeds: Self-motion speed at each sample, (k, N) [rad/s].
            threads: How many; None is ``thread_count``.

        Returns:
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

    def _prepared(self, bounded: bool, whole: bool, share: float | None) -> Any:
        memory = self._memory.copy()
        C: Any = rooms(memory)
        C.near, C.turned = self._tolerances if bounded else (EXACT_ERROR, EXACT_ERROR)
        C.whole, C.share = whole, LOCKED if share is None else share
        return memory

    def _call(
        self, q: Any, samples: Any, failed: Any, speed: Any, path: FloatArray | None, *, exact: bool
    ) -> "_Call":
        """The arrays of a call."""
        call = _Call(self._goals, q, samples, failed, speed, path)
        n, m, k, last = self._session.nv, self._session.m, len(call.q), len(self._goals) - 1
        if call.q.shape != (k, n) or call.samples.shape != (k,):
            raise InputError(
                f"q has shape {call.q.shape} and samples {call.samples.shape}, expected (k, {n}), (k,)"
            )
        if k and not (call.samples.min() >= 0 and call.samples.max() <= last):
            raise InputError(
                f"samples are {call.samples.min()} to {call.samples.max()}, expected 0 to {last}"
            )
        if k and not (call.failed.min() >= -1 and call.failed.max() < n):
            raise InputError(
                f"failed has joints {call.failed.min()} to {call.failed.max()}, expected -1 to {n - 1}"
            )
        if exact:
            count = (call.failed >= 0).sum(axis=1) - (
                (call.failed[:, 0] == call.failed[:, 1]) & (call.failed[:, 0] >= 0)
            )
            if (n - count != m).any():
                raise InputError(
                    f"{n} joints with {count.max(initial=0)} locked leave not as many as {m} rows; bound them"
                )
        return call


class _Call:
    """The arrays of continuations, and all that their entry points take but which."""

    def __init__(
        self, goals: FloatArray, q: Any, samples: Any, failed: Any, speed: Any, path: FloatArray | None
    ) -> None:
        self.q = np.ascontiguousarray(q, dtype=np.float64)
        k = len(self.q)
        self.samples = np.ascontiguousarray(samples, dtype=np.int64)
        self.failed = np.full((k, FAILED_JOINTS), -1, np.int64)
        given = np.asarray(failed, dtype=np.int64).reshape(k, -1)
        self.failed[:, : given.shape[1]] = given
        self._speed = np.zeros((k, FAILED_JOINTS))
        if speed is not None:
            self._speed[:, : given.shape[1]] = np.asarray(speed, dtype=np.float64).reshape(k, -1)
        self.facts = np.zeros((k, FACTS))
        self.things = (
            k, len(goals), int(path is not None), goals, self.q, self.samples, self.failed, self._speed,
            self.facts, path,
        )  # fmt: skip
