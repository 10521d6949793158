"""A motion tried on a planner of its own: the same ticks as the arm would make, in thought."""

from collections.abc import Sequence
from typing import Any, Final, NamedTuple, final

import numpy as np

from ftqp.control.inverse_kinematics.motion_validity import HELD, MotionValidity
from ftqp.control.planner.planner_view import JointState, PlannerView
from ftqp.control.planner.ways.joint_tracker import JointTracker
from ftqp.control.references.jerk_limit import Motion, State
from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.enums import FALLBACK, INVALID_INPUT, STOPPED, STOPPING
from ftqp.kernel.layout.thresholds import AT_REST, RISE_TIME

OFF = (FALLBACK, STOPPING, STOPPED, INVALID_INPUT)
"""Statuses of a tick with which a motion has failed."""
ARRIVED = 1e-3
"""A joint so near to its place has arrived [rad or m]: the tolerance of ``GoTo``, by convention."""
AS_GOOD_AS_THERE = 1e-4
"""One that is so near to it, and rests, is not tried any longer [rad or m]: what is left is the decay of an
error. By convention, a tenth of the former."""
TAIL, LONGEST = 1.0, 60.0
"""So much longer than planned a motion may take [s], and so long until one is planned. A convention."""
BORNE_AT = 25
"""What the base bears on a motion is looked at in so many places."""
LOOKED_AT = 0.05
"""Places of a motion where it is asked whether the arm may be there are so far apart [rad or m]."""
NEAR: Final = 0.6
"""A joint goes no farther than this to it [rad or m] ..."""
ROUNDS, SAMPLES, SHRINK = 4, 32, 0.5
"""... and it is the best of so many samples round the best one so far, in so many rounds, the next of which
is so much narrower."""
BASE_SHARE: Final = 0.25
"""What the base bears on the way there, as a share of what it bears where the arm brakes on the spot, is a
quarter of a torque limit's whole share. A convention."""
LEAST_BORNE: Final = np.array([10.0, 1.0])
"""The force and torque [N, N m] below which that share is not distinguished: a kilogram's. A convention."""
CHOICE: Final = 6
"""For so many of the postures that need least, and are clear, the way there is looked at ..."""
ON_THE_WAY: Final = 12
"""... in so many places."""
ROOM_SHARE: Final = 0.1
"""A joint with less than this share of its range to its nearer limit counts as near it: half of what a torque
limit's whole share counts, at the limit. A convention."""


class Tried(NamedTuple):
    """What a motion came to.

    Attributes:
        q: The joints on the way, (k, nv) [rad or m], from the begin to the end.
        time: How long it took [s].
        arrives: Whether it came to rest at its end, without a stop.
        clearance: The least distance from what it must not meet [m].
        passes: Whether the arm may be everywhere on it.
        near: Whether it comes too near to something.
        borne: The largest force and torque that the base bears on it, (2,) [N, N m].
    """

    q: FloatArray
    time: float
    arrives: bool
    clearance: float
    passes: bool
    near: bool
    borne: FloatArray


@final
class Trial:
    """Tries motions from one state of an arm, on a planner of its own."""

    def __init__(self, twin: Any, own: PlannerView, passable: MotionValidity) -> None:
        self._twin, self._view, self._own, self.passable = twin, twin.view(), own, passable
        self._start = own.command

    def joints(self, places: Sequence[FloatArray]) -> Tried:
        """Go to a place, or come to rest and go through several in one motion, as ``GoTo`` does."""
        twin, view = self._twin, self._view
        twin.reset(self._start.q, self._start.v)
        motion = JointTracker(twin, places[-1])
        if len(places) > 1:
            motion.seek(places[-1], places=np.array(places))
        (q, v, a), trace, arrives, t, longest = self._start, [self._start], True, 0.0, LONGEST
        while t < longest and arrives:
            step, t = motion.step(q, v), t + twin.dt
            q, v, a = view.command
            trace.append(JointState(q, v, a))
            arrives = step.code not in OFF
            if longest == LONGEST and not motion.is_searching:
                longest = t + motion.left + TAIL
            if (
                not motion.is_searching
                and motion.left <= 0.0
                and self._rests_within(AS_GOOD_AS_THERE, motion)
            ):
                break
        later = motion.decay(self._off(motion))
        return self._judged(trace, arrives and self._rests_within(ARRIVED, motion), later)

    def _rests_within(self, off: float, motion: JointTracker) -> bool:
        """Whether the joints that work rest so near to the motion's goal."""
        return self._off(motion) <= off and self._view.pace <= AT_REST

    def _off(self, motion: JointTracker) -> float:
        return float(np.abs(motion.way)[self._view.working].max(initial=0.0))

    def _judged(self, trace: list[JointState], arrives: bool, later: float) -> Tried:
        q, v, a = (np.array(part) for part in zip(*trace, strict=True))
        places = thinned(q, LOOKED_AT)
        efforts, (clear, room) = self.passable.effort(places), self.passable.distances(places)
        most = max(HELD, float(efforts[0]))
        near = bool((room <= min(0.0, float(room[0]) - 1e-9)).any())
        some = np.unique(np.linspace(0, len(q) - 1, BORNE_AT, dtype=np.int64))
        return Tried(
            q, (len(q) - 1) * self._twin.dt + later, arrives, float(clear.min()),
            bool((efforts <= most).all()) and not near, near,
            self.passable.base_wrenches(q[some], v[some], a[some]).max(axis=0),
        )  # fmt: skip

    def halt_posture(self, stand: FloatArray) -> FloatArray:
        """The posture near by that needs the least of the motors and the base and is away from limits, (nv,).

        effort(q) + 0.5 max(0, 1 - room(q)/0.1) + 0.125 (force/force_0 + torque/torque_0) is made small, with
        the largest share of a torque limit that holds the arm at rest, the least share of a range to a limit,
        and the largest force and torque that the base bears on the way there, beside those of braking on the
        spot. The same arm gets the same posture.
        Source: docs/theory/ways-out.md; Chen 2020.
        """
        generator = np.random.default_rng(0)
        own, passable = self._own, self.passable
        working, low, high = own.working, own.limits.q_min, own.limits.q_max
        box_low, box_high = np.maximum(low, stand - NEAR), np.minimum(high, stand + NEAR)
        ranged = working & np.isfinite(low) & np.isfinite(high)

        def costs(places: FloatArray) -> FloatArray:
            room = np.minimum(places - low, high - places)[:, ranged] / (high - low)[ranged]
            near = np.maximum(0.0, 1.0 - room.min(axis=1, initial=1.0) / ROOM_SHARE)
            found: FloatArray = passable.effort(places) + 0.5 * near
            found[passable.distances(places)[1] <= 0.0] = np.inf
            return found

        seen, cost, width = stand[None], costs(stand[None]), 1.0
        for _ in range(ROUNDS):
            drawn = generator.uniform(-1.0, 1.0, (SAMPLES, len(stand)))
            places = seen[np.argmin(cost)] + width * NEAR * drawn
            places = np.where(working, np.clip(places, box_low, box_high), stand)
            seen, cost = np.vstack([seen, places]), np.append(cost, costs(places))
            width *= SHRINK
        first = self._borne(stand)
        chosen = [0, *(int(k) for k in np.argsort(cost[1:], kind="stable")[:CHOICE] + 1)]
        for k in chosen:
            borne = self._borne(seen[k]) if k else first
            cost[k] += 0.5 * BASE_SHARE * float((borne / np.maximum(first, LEAST_BORNE)).sum())
        best: FloatArray = seen[min(chosen, key=lambda k: cost[k])]
        return best

    def _borne(self, end: FloatArray) -> FloatArray:
        """The largest force and torque that the base bears on the way to a posture, (2,) [N, N m]."""
        start, working, limits = self._start, self._own.working, self._own.limits
        nominal = self._twin.robot.limits
        jerk = np.minimum(nominal.a_max / RISE_TIME, nominal.j_max)
        now = State(*(part[working] for part in start))
        motion = Motion(int(working.sum())) if working.any() else None
        rows = np.tile(np.array([start.q, 0.0 * start.v, 0.0 * start.v]), (ON_THE_WAY, 1, 1))
        if motion is not None:
            motion.plan(now, end[working], limits.v[working], limits.a[working], jerk[working])
            for row, t in zip(rows, np.linspace(0.0, motion.duration, ON_THE_WAY), strict=True):
                row[:, working] = motion.at(float(t))
        borne: FloatArray = self.passable.base_wrenches(*rows.transpose(1, 0, 2)).max(axis=0)
        return borne


def thinned(q: FloatArray, apart: float) -> FloatArray:
    """Rows that are so far apart in some joint, the first and the last one among them."""
    kept = [0]
    for k in range(1, len(q)):
        if np.abs(q[k] - q[kept[-1]]).max() >= apart:
            kept.append(k)
    if kept[-1] != len(q) - 1:
        kept.append(len(q) - 1)
    return q[kept]


def corners(q: FloatArray, off: float) -> FloatArray:
    """Rows between which straight ways are nowhere farther from q than so much in any joint.

    Source: Ramer 1972.
    """
    kept, parts = {0, len(q) - 1}, [(0, len(q) - 1)]
    while parts:
        a, b = parts.pop()
        if b - a < 2:
            continue
        way = q[b] - q[a]
        share = np.clip((q[a : b + 1] - q[a]) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        away = np.abs(q[a] + share[:, None] * way - q[a : b + 1]).max(axis=1)
        k = a + int(np.argmax(away))
        if away[k - a] > off:
            kept.add(k)
            parts += [(a, k), (k, b)]
    return q[sorted(kept)]
