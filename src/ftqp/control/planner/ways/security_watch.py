"""Looks ahead, beside the ticks, at what the loss of each joint would cost, and leads the null space."""

import logging
import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, final
from weakref import WeakSet

import numpy as np

from ftqp.control.paths.path import Path
from ftqp.control.planner.planner_view import PlannerView
from ftqp.control.planner.rollout_setup import RolloutSetup
from ftqp.control.planner.stages import CLOCK, LED, Stage
from ftqp.control.planner.target import Targets
from ftqp.control.planner.ways.n_minus_one import Loss, NMinusOne, Security
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.clock import give_way
from ftqp.core.pose import rotation_exp, rotation_vector, transform
from ftqp.faults.belief import fault_record
from ftqp.faults.kinds import Locked
from ftqp.kernel.entry.rollouts import Batch, drive_some
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import SLACK, TARGET_POSE, TARGET_TWIST
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
ASIDE: Final = 0.15
"""Postures so far to both sides along a self-motion are compared with the present one [rad or m]."""
AHEAD: Final = 0.6
"""The null space is led to a posture so far along it [rad or m]."""
WORTH: Final = 0.01
"""It is led only where that lowers the sum of the costs by so much, one for a joint that would be lost
altogether: an arm at rest stays at rest."""
CORRECTIONS: Final = 3
"""Newton steps that put the tip back where it is after a step aside."""
DAMPED: Final = 1e-6
"""Their damping, so that a singular posture makes no endless step."""
DECADES: Final = 4.0
"""A lock costs nothing where it leaves a tenth of the tolerance, and one at this many powers of ten more; the
costs of joints add up."""
AT_ONCE: Final = 200
"""So many ticks are worked out at once: 0.2 ms in which the thread holds Python's lock."""


class _Now(NamedTuple):
    """What is looked at: the tick, joints, speeds and limits, the target and the tip, and the path ahead."""

    tick: int
    q: FloatArray
    v: FloatArray
    low: FloatArray
    high: FloatArray
    working: BoolArray
    packed: FloatArray
    tip: FloatArray
    path: tuple[Path, float] | None


class _Seen(NamedTuple):
    """What was found: of the present posture, and the posture to lead to, or None."""

    security: Security
    lead: FloatArray | None


@dataclass(slots=True)
class _Look:
    """One look, which may take several portions.

    Attributes:
        now: What is looked at.
        what_ifs: What every arm begins with; a copy that nobody else writes into.
        lost: The joints that are locked in thought.
        sides: Directions along self-motions, (k, nv).
        batch: Every start with every lock, the present posture first, then those aside; None before the
            first portion.
        done: So many arms of it were rolled out.
    """

    now: _Now
    what_ifs: RolloutSetup
    lost: tuple[int, ...]
    sides: FloatArray
    batch: Batch | None = None
    done: int = 0


@final
class SecurityWatch:
    """Locks each joint in thought and rolls the arm out, in a thread, so many times a second.

    A tick hands a portion of a look over, no larger than the budget, and takes what was found: where the
    settings say ``waits``, at the tick where the next portion is due, whatever the machine, so that the same
    ticks have the same answers; else at the first tick that has it. Beside the present posture those a little
    to both sides along each self-motion are rolled out, and the null space is led to the side that costs
    less. The thread works on copies alone, and a forked process makes one of its own.

    Source: docs/theory/ways-out.md, "N-1 on line".
    """

    def __init__(
        self,
        settings: NMinusOne,
        session: Session,
        robot: Robot,
        dt: float,
        what_ifs: Callable[[], RolloutSetup],
    ) -> None:
        self._settings, self._session, self._robot, self._dt = settings, session, robot, dt
        self._make = what_ifs
        self._view = PlannerView(session, robot)
        self._every = max(1, round(1.0 / (settings.rate * dt)))
        self._ticks = max(2, round(settings.horizon / dt))
        self._pool: ThreadPoolExecutor | None = None
        self._running: Future[_Seen | None] | None = None
        self._look: _Look | None = None
        self._what_ifs: RolloutSetup | None = None
        self._belief = b""
        self._path: tuple[Path, float] | None = None
        self._count = 0
        task = session.K.task
        self._rows = tuple(int(row) for row in task.rows[: int(task.m)])
        self._found: Security | None = None
        _WATCHING.add(self)

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(ticks=(CLOCK, *LED), before=self.look, begin=lambda *_: self._forget())

    @property
    def security(self) -> Security | None:
        """What was found last, and how old it is; None before the first time."""
        found = self._found
        ticks = int(self._session.K.state.ticks)
        return None if found is None else replace(found, age=(ticks - found.tick) * self._dt)

    def forked(self) -> None:
        """In a process that was forked off: the thread stayed behind, and its look is begun anew."""
        self._pool = self._running = None
        if self._look is not None:
            self._look = replace(self._look, batch=None, done=0)

    def _forget(self) -> None:
        """What is under way is left to itself: it works on copies."""
        self._running = self._look = self._found = None
        self._count = 0
        self._thread().submit(give_way)  # so that no tick waits for the thread to begin
        if self._path is not None:
            self._path = self._path[0], 0.0

    def foresee(self, path: Path | None, at: float) -> None:
        """What the tip will follow, from a time of it on [s]; None goes on with the target's twist."""
        self._path = None if path is None else (path, at)

    def _know(self) -> RolloutSetup:
        """What other arms like this one begin with, as it is believed now."""
        scene = self._session.K.scene
        scene_state = np.array([scene.laid, scene.version]).tobytes() + scene.place.tobytes()
        belief = self._view.belief + (scene_state if scene.pairs > 0 else b"")
        if self._what_ifs is None or self._belief != belief:
            self._what_ifs, self._belief = self._make(), belief
            task = self._what_ifs.session.K.task
            task.mode, task.sets = SLACK, 0
            self._what_ifs.commands.given.has_posture = 0  # each returns to its own start
        return self._what_ifs

    def _thread(self) -> ThreadPoolExecutor:
        """Of this process."""
        if self._pool is None:
            self._pool = ThreadPoolExecutor(1)
        return self._pool

    def look(self) -> None:
        """Before a tick: take what was found, and look on, where it is time."""
        due = self._count % self._every == 0
        self._count += 1
        running = self._running
        if running is not None and (due if self._settings.waits else running.done()):
            self._running = None
            error = running.exception()
            if error is not None:  # the arm goes on without being looked after
                _LOG.warning("what a lock would cost is not known: %.200r", error)
            seen = None if error is not None else running.result()
            if seen is not None:
                self._take(seen)
            if error is not None or seen is not None:
                self._look = None
        if due and self._running is None and self._view.is_reset:
            if self._look is None:
                self._look = self._begun()
            self._running = self._thread().submit(self._seen, self._look)
        if self._path is not None:
            self._path = self._path[0], self._path[1] + self._dt

    def _take(self, seen: _Seen) -> None:
        self._found = seen.security
        if self._settings.leads:
            n = self._robot.nv
            posture = self._session.K.criteria.posture
            posture[:n] = self._view.command.q if seen.lead is None else seen.lead

    def _begun(self) -> _Look:
        """A look that begins now: all that it needs, copied in the thread of the ticks."""
        command, limits, chain = self._view.command, self._view.limits, self._robot.chain
        working, K = self._view.working, self._session.K
        now = _Now(
            int(K.state.ticks), command.q, command.v, limits.q_min, limits.q_max, working,
            np.array(K.task.target), self._view.tip.pose, self._path,
        )  # fmt: skip
        lost = tuple(  # joints with a motor of their own
            i for i in range(chain.floating, self._robot.nv) if working[i] and chain.lead[i] == i
        )
        return _Look(now, self._know(), lost, np.zeros((0, self._robot.nv)))

    def _sides(self, now: _Now) -> FloatArray:
        """Directions along self-motions to both sides, (k, nv), the largest entry 1; none where not led."""
        working = np.asarray(now.working)
        if not self._settings.leads:
            return np.zeros((0, len(now.q)))
        A = self._robot.jacobian(now.q)[np.array(self._rows)][:, working]
        null = np.linalg.svd(A)[2][A.shape[0] :]
        sides = np.zeros((2 * len(null), len(now.q)))
        for k, along in enumerate(null):
            sides[2 * k, working] = along / np.abs(along).max()
            sides[2 * k + 1] = -sides[2 * k]
        return sides

    def _seen(self, look: _Look) -> _Seen | None:
        """Roll out a portion, in the thread beside: what was found, or None where more is to be done."""
        now = look.now
        if look.batch is None:
            look.sides, starts = self._sides(now), [np.stack([now.q, now.v])]
            for side in look.sides:
                starts.append(self._aside(now, side))
                give_way()
            look.batch = self._batch(look, np.array(starts))
        self._roll_on(look)
        batch, joints = look.batch, look.lost
        if look.done < len(batch.q):
            return None
        shape = 1 + len(look.sides), len(joints)
        position, rotation = batch.position_error.reshape(shape), batch.rotation_error.reshape(shape)
        losses = tuple(self._loss(batch, k, self._robot.joints[i]) for k, i in enumerate(joints))
        security = Security(tick=now.tick, horizon=self._settings.horizon, losses=losses)
        if not len(look.sides) or not joints:
            return _Seen(security, None)
        off = np.maximum(position / self._settings.tolerance, rotation / self._settings.rotation_tolerance)
        off[batch.clearance.reshape(shape) <= 0.0] = np.inf
        costs = np.clip((np.log10(np.maximum(off, 1e-9)) + 1.0) / DECADES, 0.0, 1.0).sum(axis=1)
        k = int(np.argmin(costs[1:]))
        if costs[1 + k] > costs[0] - WORTH:
            return _Seen(security, None)
        return _Seen(security, np.clip(now.q + AHEAD * look.sides[k], now.low, now.high))

    def _aside(self, now: _Now, side: FloatArray) -> FloatArray:
        """A posture a little to one side with the tip where it is and as fast, and its speeds, (2, nv)."""
        q = np.clip(now.q + ASIDE * side, now.low, now.high)
        wanted, robot = self._robot.pose(now.q), self._robot
        rows, at = np.array(self._rows), now.working
        for _ in range(CORRECTIONS):
            T = robot.pose(q)
            e = np.concatenate([wanted[:3, 3] - T[:3, 3], rotation_vector(wanted[:3, :3] @ T[:3, :3].T)])[
                rows
            ]
            A = robot.jacobian(q)[rows][:, at]
            q[at] += A.T @ np.linalg.solve(A @ A.T + DAMPED * np.eye(len(A)), e)
        v, A = now.v.copy(), robot.jacobian(q)[rows][:, at]
        wrong = robot.jacobian(now.q)[rows] @ now.v - robot.jacobian(q)[rows] @ v
        v[at] += A.T @ np.linalg.solve(A @ A.T + DAMPED * np.eye(len(A)), wrong)
        return np.stack([np.clip(q, now.low, now.high), v])

    def _batch(self, look: _Look, starts: FloatArray) -> Batch:
        """Every start with every lock, the locks of the first start first."""
        joints, arms = look.lost, len(starts) * len(look.lost)
        locks = [fault_record(i, Locked(self._robot.joints[i])) for i in joints] or [fault_record(0, None)]
        events = np.array([(0, k % len(joints), 0) for k in range(arms)], dtype=np.int64)
        times = self._dt * np.arange(self._ticks, dtype=np.float64)
        return Batch.begun(
            np.repeat(starts[:, 0], len(joints), axis=0), np.repeat(starts[:, 1], len(joints), axis=0),
            targets_ahead(look.now.path, look.now.packed, look.now.tip, times), 0,
            faults=np.concatenate(locks), events=events.reshape(-1, 3),
            starts=np.arange(arms + 1, dtype=np.int64),
        )  # fmt: skip

    def _roll_on(self, look: _Look) -> None:
        """What becomes of the next arms of a look, as many as the budget has."""
        batch, setup = look.batch, look.what_ifs
        assert batch is not None
        last = min(look.done + max(1, self._settings.budget // self._ticks), len(batch.q))
        if last > look.done:
            drive_some(setup.session, setup.commands, setup.samples, batch.record(), look.done, last)
        look.done = last

    def _loss(self, batch: Batch, k: int, joint: str) -> Loss:
        """What the lock of arm k of a batch costs."""
        given, first = self._settings, int(batch.first_bad[k])
        off, turned = float(batch.position_error[k]), float(batch.rotation_error[k])
        clear = float(batch.clearance[k])
        return Loss(
            joint=joint, position_error=off, rotation_error=turned, clearance=clear,
            survived=off <= given.tolerance and turned <= given.rotation_tolerance and clear > 0.0,
            after=given.horizon if first < 0 else first * self._dt,
        )  # fmt: skip


_WATCHING: Final[WeakSet[SecurityWatch]] = WeakSet()
"""Those of this process."""


def _forked() -> None:
    for watch in list(_WATCHING):
        watch.forked()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)


def targets_ahead(
    path: tuple[Path, float] | None, packed: FloatArray, tip: FloatArray, t: FloatArray
) -> FloatArray:
    """Targets along a path, or along the twist of the last target, packed, (T, 29)."""
    if path is None:
        return _along_twist(packed, tip, t)
    way, at = path
    parts = []
    for part in np.split(t, range(AT_ONCE, len(t), AT_ONCE)):
        sample = way.sample(np.minimum(at + part, way.duration))
        ends = (at + part > way.duration)[:, None]
        twist, acceleration = np.where(ends, 0.0, sample.twist), np.where(ends, 0.0, sample.acceleration)
        parts.append(Targets(sample.pose, twist, acceleration).packed)
        give_way()
    return np.concatenate(parts)


def _along_twist(packed: FloatArray, tip: FloatArray, t: FloatArray) -> FloatArray:
    pose = packed[TARGET_POSE : TARGET_POSE + 16].reshape(4, 4)
    twist = packed[TARGET_TWIST : TARGET_TWIST + 6]
    if not np.isfinite(pose).all() or np.linalg.det(pose[:3, :3]) < 0.5:
        pose, twist = tip, np.zeros(6)
    if not twist.any():
        return Targets(np.repeat(pose[None], len(t), axis=0)).packed
    poses = []
    for k, s in enumerate(t):
        poses.append(transform(rotation_exp(twist[3:] * s) @ pose[:3, :3], pose[:3, 3] + twist[:3] * s))
        if k % AT_ONCE == 0:
            give_way()
    return Targets(np.array(poses), np.repeat(twist[None], len(t), axis=0)).packed
