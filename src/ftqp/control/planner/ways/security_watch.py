"""Looks ahead, beside the ticks, at what the loss of each joint would cost, and leads the null space."""

import logging
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Final, NamedTuple, final

import numpy as np

from ftqp.control.paths.path import Path
from ftqp.control.planner.planner_view import PlannerView
from ftqp.control.planner.stages import CLOCK, LED, Stage
from ftqp.control.planner.target import Targets
from ftqp.control.planner.ways.n_minus_one import Loss, NMinusOne, Security
from ftqp.control.planner.what_ifs import WhatIfs
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.core.errors import InputError
from ftqp.core.pose import rotation_exp, rotation_vector, transform
from ftqp.faults.kinds import Locked
from ftqp.kernel.entry.rollouts import Batch, beliefs_of
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import SLACK, TARGET_POSE, TARGET_TWIST, Status
from ftqp.kernel.layout.free_memory import free_dtype
from ftqp.kernel.layout.record import record_dtype
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
ASIDE: Final = 0.15
"""Postures so far to both sides along a self-motion are compared with the present one [rad or m]. A guess
that `python benchmarks/bench_security.py` has not contradicted."""
AHEAD: Final = 0.6
"""The null space is led to a posture so far along it [rad or m]. A guess that the same benchmark has not
contradicted."""
WORTH: Final = 0.01
"""It is led only where that lowers the sum of the costs by so much, one for a joint that would be lost
altogether: an arm at rest stays at rest. A guess that the same benchmark has not contradicted."""
CORRECTIONS: Final = 3
"""Newton steps that put the tip back where it is after a step aside."""
DAMPED: Final = 1e-6
"""Their damping, so that a singular posture makes no endless step."""
DECADES: Final = 4.0
"""A lock costs nothing where it leaves a tenth of the tolerance, and one at this many powers of ten more; the
costs of joints add up. A guess that the same benchmark has not contradicted."""


class _Now(NamedTuple):
    """What is looked at: the tick, joints, speeds and limits, directions to the sides, and targets ahead."""

    tick: int
    q: FloatArray
    v: FloatArray
    low: FloatArray
    high: FloatArray
    working: BoolArray
    sides: FloatArray
    targets: Targets


class _Seen(NamedTuple):
    """What was found: of the present posture, and the posture to lead to, or None."""

    security: Security
    lead: FloatArray | None


@final
class SecurityWatch:
    """Locks each joint in thought and rolls the arm out, in a thread, so many times a second.

    It begins at one tick and is taken at the tick where the next one begins, whatever the machine: the same
    ticks have the same answers. Beside the present posture those a little to both sides along each
    self-motion are rolled out, and the null space is led to the side that costs less.

    Args:
        settings: How far, how often.
        session: The planner's; its criterion needs a term that leads to a posture, where it is led.
        robot: The arm.
        dt: The sampling period [s].
        what_ifs: Says what other arms like this one begin with, as believed when it is called.

    Attributes:
        security: What was found last; None before the first time.

    Source: docs/theory/ways-out.md, "N-1 on line".
    """

    def __init__(
        self,
        settings: NMinusOne,
        session: Session,
        robot: Robot,
        dt: float,
        what_ifs: Callable[[], WhatIfs],
    ) -> None:
        self._settings, self._session, self._robot, self._dt = settings, session, robot, dt
        self._make = what_ifs
        self._view = PlannerView(session, robot)
        self._every = max(1, round(1.0 / (settings.rate * dt)))
        self._ticks = max(2, round(settings.horizon / dt))
        self._pool = ThreadPoolExecutor(1)
        self._running: Future[_Seen] | None = None
        self._what_ifs: WhatIfs | None = None
        self._belief = b""
        self._rooms: dict[int, dict[str, Any]] = {}
        self._path: tuple[Path, float] | None = None
        self._count = 0
        task = session.K.task
        self._rows = tuple(int(row) for row in task.rows[: int(task.m)])
        self.security: Security | None = None

    @property
    def stage(self) -> Stage:
        """Its part in a planner's life."""
        return Stage(ticks=(CLOCK, *LED), before=self.look, begin=lambda *_: self._forget())

    def _forget(self) -> None:
        if self._running is not None:
            self._running.exception()
        self._running, self._count, self.security = None, 0, None
        if self._path is not None:
            self._path = self._path[0], 0.0

    def foresee(self, path: Path | None, at: float) -> None:
        """What the tip will follow, from a time of it on [s]; None goes on with the target's twist."""
        self._path = None if path is None else (path, at)

    def _know(self) -> None:
        """Make sure that other arms like this one begin with what is believed now."""
        scene = self._session.K.scene
        belief = self._view.belief + (scene.place.tobytes() if scene.pairs > 0 else b"")
        if self._what_ifs is not None and self._belief == belief:
            return
        self._what_ifs, self._belief = self._make(), belief
        task = self._what_ifs.session.K.task
        task.mode, task.sets = SLACK, 0
        working, chain = self._view.working, self._robot.chain
        self._rooms = {
            i: self._what_ifs.believing((Locked(name),))
            for i, name in enumerate(self._robot.joints)
            if working[i] and i >= chain.floating and chain.lead[i] == i  # joints with a motor of their own
        }

    def look(self) -> None:
        """Before a tick: take what was found, and look again, where it is time."""
        due = self._count % self._every == 0
        self._count += 1
        running = self._running
        if running is not None and (running.done() if not self._settings.waits else due):
            self._running = None
            error = running.exception()
            if error is None:
                self._take(running.result())
            else:  # the arm goes on without being looked after
                _LOG.warning("what a lock would cost is not known: %.200r", error)
        if due and self._running is None and self._view.is_reset:
            self._know()
            self._running = self._pool.submit(self._seen, self._now())
        if self._path is not None:
            self._path = self._path[0], self._path[1] + self._dt

    def _take(self, seen: _Seen) -> None:
        self.security = seen.security
        if self._settings.leads:
            n = self._robot.nv
            posture = self._session.K.criteria.posture
            posture[:n] = self._view.command.q if seen.lead is None else seen.lead

    def _now(self) -> _Now:
        """The present state, copied in the thread of the ticks."""
        command, K = self._view.command, self._session.K
        packed = np.array(K.task.target)
        limits = self._view.limits
        return _Now(
            int(K.state.ticks), command.q, command.v, limits.q_min, limits.q_max, self._view.working,
            self._sides(command.q), self._targets(packed),
        )  # fmt: skip

    def _sides(self, q: FloatArray) -> FloatArray:
        """Directions along self-motions to both sides, (k, nv), the largest entry 1; none where not led."""
        working = np.asarray(self._view.working)
        if not self._settings.leads:
            return np.zeros((0, len(q)))
        A = self._robot.jacobian(q)[np.array(self._rows)][:, working]
        null = np.linalg.svd(A)[2][A.shape[0] :]
        sides = np.zeros((2 * len(null), len(q)))
        for k, along in enumerate(null):
            sides[2 * k, working] = along / np.abs(along).max()
            sides[2 * k + 1] = -sides[2 * k]
        return sides

    def _targets(self, packed: FloatArray) -> Targets:
        """Targets to the end of the horizon."""
        t = self._dt * np.arange(self._ticks)
        if self._path is not None:
            path, at = self._path
            sample = path.sample(np.minimum(at + t, path.duration))
            ends = (at + t > path.duration)[:, None]
            return Targets(
                sample.pose, np.where(ends, 0.0, sample.twist), np.where(ends, 0.0, sample.acceleration)
            )
        pose = packed[TARGET_POSE : TARGET_POSE + 16].reshape(4, 4)
        twist = packed[TARGET_TWIST : TARGET_TWIST + 6]
        if not np.isfinite(pose).all() or np.linalg.det(pose[:3, :3]) < 0.5:
            pose, twist = self._view.tip.pose, np.zeros(6)
        if not twist.any():
            return Targets(np.repeat(pose[None], self._ticks, axis=0))
        poses = np.array(
            [transform(rotation_exp(twist[3:] * s) @ pose[:3, :3], pose[:3, 3] + twist[:3] * s) for s in t]
        )
        return Targets(poses, np.repeat(twist[None], self._ticks, axis=0))

    def _seen(self, now: _Now) -> _Seen:
        """Roll out, in the thread beside: every lock from here, and from a little to each side."""
        low, high = now.low, now.high
        starts = np.array([(now.q, now.v), *(self._aside(now, side) for side in now.sides)])
        joints = list(self._rooms)
        batch = self._rolled(starts, now, joints)
        shape = len(starts), len(joints)
        position, rotation = batch.position_error.reshape(shape), batch.rotation_error.reshape(shape)
        losses = tuple(self._loss(batch, k, self._robot.joints[i]) for k, i in enumerate(joints))
        security = Security(tick=now.tick, horizon=self._settings.horizon, losses=losses)
        if len(starts) == 1 or not joints:
            return _Seen(security, None)
        off = np.maximum(position / self._settings.tolerance, rotation / self._settings.rotation_tolerance)
        off[batch.clearance.reshape(shape) <= 0.0] = np.inf
        costs = np.clip((np.log10(np.maximum(off, 1e-9)) + 1.0) / DECADES, 0.0, 1.0).sum(axis=1)
        k = int(np.argmin(costs[1:]))
        if costs[1 + k] > costs[0] - WORTH:
            return _Seen(security, None)
        return _Seen(security, np.clip(now.q + AHEAD * now.sides[k], low, high))

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

    def _rolled(self, starts: FloatArray, now: _Now, joints: list[int]) -> Batch:
        """What becomes of every start and lock, the locks of the first start first."""
        what_ifs = self._what_ifs
        assert what_ifs is not None
        n, arms = self._robot.nv, len(starts) * len(joints)
        events = np.array(
            [(0, k % len(joints), joints[k % len(joints)]) for k in range(arms)], dtype=np.int64
        )
        batch = Batch(
            q=np.repeat(starts[:, 0], len(joints), axis=0), v=np.repeat(starts[:, 1], len(joints), axis=0),
            targets=now.targets.packed,
            beliefs=beliefs_of(what_ifs.session.capacity, list(self._rooms.values())),
            events=events.reshape(-1, 3), starts=np.arange(arms + 1, dtype=np.int64),
            skipped=np.zeros(arms, dtype=np.int64), returns=True, every=0,
            position_error=np.zeros(arms), rotation_error=np.zeros(arms), clearance=np.full(arms, np.inf),
            counts=np.zeros((arms, len(Status)), dtype=np.int64), first_bad=np.full(arms, -1, dtype=np.int64),
            trace=np.zeros((arms, 0, n)),
        )  # fmt: skip
        if arms:
            capacity = what_ifs.session.capacity
            shop = np.zeros(1, record_dtype(capacity)), np.zeros(1, free_dtype(capacity))
            what_ifs.session.bind("rollout", batch.record(), *shop, 0, arms)()
        return batch

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


def scheme_led(scheme: Any, plan: Any, n_minus_one: NMinusOne | None) -> Any:
    """The scheme, or one that can be led where none is named."""
    leads = n_minus_one is not None and n_minus_one.leads and plan is None
    return "rmp" if leads and scheme is None else scheme


def refuse_led(n_minus_one: NMinusOne, criterion: Any, scheme: str, plan: Any) -> None:
    """Refuse a null space that cannot be led, or that is led already.

    Raises:
        InputError: The scheme leads to no posture, or a plan leads.
    """
    if not n_minus_one.leads:
        return
    if plan is not None:
        raise InputError(
            "plan and n_minus_one both lead the null space; take NMinusOne(leads=False) beside it"
        )
    if not getattr(criterion, "norm_q", 0.0) > 0.0:
        raise InputError(
            f"scheme {scheme!r} leads to no posture, so that n_minus_one cannot lead it; use rmp, dlsm or a "
            "mix with one of them, or NMinusOne(leads=False)"
        )
