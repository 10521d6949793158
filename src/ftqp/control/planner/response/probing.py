"""Probing: small self-motions that show whether joints that stand could still move."""

import logging
from math import pi, sqrt
from typing import Final, final

import numpy as np

from ftqp.control.drive.joint_drive import Drive
from ftqp.control.planner.settings import Settings
from ftqp.control.task.resolvers import Resolver
from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.core.errors import InputError
from ftqp.faults.detection.detector import Detector
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.criteria import Criterion
from ftqp.kernel.layout.enums import HEALTHY, VELOCITY
from ftqp.kernel.layout.thresholds import LEAST_SPEED
from ftqp.model.robot import Robot

_LOG = logging.getLogger("ftqp")
FARTHEST: Final = 2e-3
"""The joint that moves most is moved so far to either side [rad or m] ..."""
LEAST_SHARE: Final = 0.6
"""... one that moves by this share of it counts as probed ..."""
DURATION: Final = 0.2
"""... in one motion there and back of so long [s]. They belong together, so that the reference is above the
0.03 rad/s of a standstill for 40 ms, longer than SHOWN (docs/theory/detection.md, "Probing")."""
SHOWN: Final = 0.03
"""A joint whose reference moved fast enough for so long has shown whether it works [s]."""
LEFT_ALONE: Final = 10.0
"""A joint that a probing did not move is left alone for so long [s]."""
OF_LIMIT: Final = 0.5
"""Share of the acceleration limits that it takes at most, because task and limits need the rest."""
SLOWEST_SERVO: Final = 30.0
"""Bandwidth of a servo of which nothing is said [rad/s]."""
BEYOND_FRICTION: Final = 10.0
"""A joint is probed where its loop asks for so many times its friction if it does not move. With 2, joints
that friction may hold were probed, too; 10 is a guess."""
PEAK: Final = 0.75 * sqrt(3.0)
"""Largest value of sin x (1 - cos x), exactly: that at x = 2 pi/3."""
SHARPEST: Final = 2.74
"""Largest |d2/dx2| of sin x (1 - cos x): exactly that of 2 sin 2x - sin x, rounded up."""


@final
class Probing:
    """Moves joints that stand by 1 to 2 mrad along self-motions, by the objective of the QP.

    The reference sways by s(t) = A sin x (1 - cos x)/1.3, x = 2 pi t/T, along a direction z of the null space
    of the task rows: it begins and ends at rest where it was. The objective, whose null-space part comes to
    rest where x_0 = 0, is that of x - x_0, with the scheme's own gains k_v on velocity and k_q on posture

        x_0 = z (s'' + k_v s' + k_q s)                        acceleration level
        x_0 = z (s'(after the step) + k_v s' + k_q s)         velocity level

    so that task, limits and failed joints come first, as always.

    Source: docs/theory/detection.md, "Probing".
    """

    def __init__(
        self,
        session: Session,
        robot: Robot,
        criterion: Criterion,
        after: float,
        *,
        drive: Drive,
        friction: FloatArray,
    ) -> None:
        K, n = session.K, robot.nv
        if n <= int(K.task.m):
            raise InputError(
                f"probe_after of the detector is {after:g} s, but {robot.name} has {n} joints for "
                f"{int(K.task.m)} task rows and no self-motion to probe them by; leave it out, or give the "
                "task fewer rows"
            )
        self._K, self._robot, self._after = K, robot, after
        self._friction, self._push = friction, _push(drive, float(K.feedback.stiffness))
        if robot.has_inertia and not friction.any():
            _LOG.warning(
                "Joints that stand are probed, but no friction is known, and one that sticks seems locked; "
                "calibrate the detector, or give the robot its friction."
            )
        self._dt = float(K.state.dt)
        self._v, self._code = K.state.v_command[:n], K.faults.code[:n]
        self._idle, self._moving = np.zeros(n), np.zeros(n)
        self._swing = _sway(criterion, self._dt, level=int(K.state.level))
        self._at = 0
        self._direction: FloatArray | None = None
        self._aims: IntArray = np.zeros(0, dtype=np.int64)
        self._told: set[int] = set()

    def rest(self) -> None:
        """No probing now, and every joint is as one that has just moved."""
        self._idle[:] = self._moving[:] = 0.0
        self._stop()

    def _stop(self) -> None:
        self._direction = None
        self._K.criteria.sways = 0

    def look(self, suspect: int | None) -> None:
        """After a tick: what the next one is to be drawn to."""
        dt, idle, moving = self._dt, self._idle, self._moving
        fast = np.abs(self._v) >= LEAST_SPEED
        moving += dt
        moving[~fast] = 0.0
        idle += dt
        idle[moving >= SHOWN] = 0.0
        if self._direction is not None:
            self._go_on()
            return
        if suspect is not None and not fast[suspect] and idle[suspect] >= 0.0:
            idle[suspect] = max(idle[suspect], self._after)
        if idle.max() >= self._after and not self._K.watch.latched:
            self._begin()

    def _begin(self) -> None:
        """Choose a direction for the joints that have stood for too long."""
        late = np.flatnonzero((self._idle >= self._after) & (self._code == HEALTHY))
        late = late[np.argsort(-self._idle[late], kind="stable")]
        self._idle[self._code != HEALTHY] = 0.0
        null = self._null_space()
        for i in late:
            z = None if null is None else _through(null, int(i), late)
            if z is None:
                self._give_up(int(i))
                continue
            size = np.abs(z)
            n = len(size)
            most = float((OF_LIMIT * self._K.limits.a_max[:n] / np.maximum(size, 1e-9)).min())
            far = min(FARTHEST, most * PEAK / SHARPEST * (DURATION / (2.0 * pi)) ** 2)
            self._direction = far * z
            self._aims = late[size[late] >= LEAST_SHARE]
            self._at = 0
            self._go_on()
            return

    def _go_on(self) -> None:
        """Draw the next tick to its part of the motion, or end it."""
        assert self._direction is not None
        if self._at == len(self._swing) or self._K.watch.latched:
            self._stop()
            for i in self._aims:
                if self._idle[i] > self._after:
                    self._give_up(int(i))
            return
        criteria, n = self._K.criteria, len(self._direction)
        working = self._code == HEALTHY
        criteria.sway[:n] = np.where(working, self._swing[self._at] * self._direction, 0.0)
        criteria.sways = 1
        self._at += 1

    def _give_up(self, i: int) -> None:
        """Leave a joint alone for a while that no self-motion moves, or that friction holds."""
        self._idle[i] = -LEFT_ALONE
        if i not in self._told:
            self._told.add(i)
            _LOG.info("%s cannot be probed: no self-motion moves it far enough.", self._robot.joints[i])

    def _sticky(self) -> BoolArray:
        """Joints that friction may hold against what their loop asks for where they do not move, (n,)."""
        if not self._friction.any() or not self._robot.has_inertia:
            return np.zeros(len(self._v), dtype=bool)
        M = self._robot.mass_matrix(self._K.state.q_command[: len(self._v)])
        asked: FloatArray = np.diag(M) * self._push
        return np.asarray(BEYOND_FRICTION * self._friction > asked)

    def _null_space(self) -> FloatArray | None:
        """The projection onto self-motions of joints that work and have room, (n, n); None for none.

        A joint that friction may hold stays where it is, whoever is probed.
        """
        K, n, m = self._K, len(self._v), int(self._K.task.m)
        q, limits = K.state.q_command[:n], K.limits
        room = np.minimum(limits.q_max[:n] - q, q - limits.q_min[:n])
        free = np.flatnonzero((self._code == HEALTHY) & (room > FARTHEST) & ~self._sticky())
        if len(free) <= m:
            return None
        basis = np.linalg.svd(K.qp.A[:m, free])[2][m:]
        null = np.zeros((n, n))
        null[np.ix_(free, free)] = basis.T @ basis
        return null


def _through(null: FloatArray, i: int, others: IntArray) -> FloatArray | None:
    """A self-motion, largest component 1, that moves joint i and as many of the others as are found."""
    best = _scaled(null[:, i])
    if best is None or abs(best[i]) < LEAST_SHARE:
        return None
    count = np.count_nonzero(np.abs(best[others]) >= LEAST_SHARE)
    for j in others:
        beside = _scaled(null[:, j])
        if beside is None or abs(best[j]) >= LEAST_SHARE:
            continue
        for sign in (1.0, -1.0):
            both = _scaled(best + sign * beside)
            if both is None or abs(both[i]) < LEAST_SHARE:
                continue
            more = np.count_nonzero(np.abs(both[others]) >= LEAST_SHARE)
            if more > count:
                best, count = both, more
    return best


def _scaled(z: FloatArray) -> FloatArray | None:
    """z over its largest component; None where there is hardly any."""
    most = float(np.abs(z).max())
    return z / most if most > 1e-6 else None


def swing(steps: int) -> FloatArray:
    """A motion by 1 to either side and back, at rest at its ends, after each of so many steps."""
    x = 2.0 * pi * np.arange(1, steps + 1) / steps
    found: FloatArray = np.sin(x) * (1.0 - np.cos(x)) / PEAK
    return found


def _sway(criterion: Criterion, dt: float, *, level: int) -> FloatArray:
    """x_0 of a motion by 1 to either side, one number a tick."""
    s = np.concatenate([np.zeros(2), swing(max(round(DURATION / dt), 4))])
    k_v = k_q = 0.0
    if criterion.norm > 0.0:
        k_v, k_q = criterion.norm_v / criterion.norm, criterion.norm_q / criterion.norm
    elif criterion.inertia > 0.0:
        k_v = criterion.inertia_v / criterion.inertia
    after, before = np.diff(s)[1:] / dt, np.diff(s)[:-1] / dt
    moved = after if level == VELOCITY else (after - before) / dt
    found: FloatArray = moved + k_v * before + k_q * s[1:-1]
    return found


def _push(drive: Drive, stiffness: float) -> float:
    """The acceleration that a joint's loop asks for when it stands while it is probed the least [rad/s2]."""
    far = LEAST_SHARE * FARTHEST
    if drive.kind == "torque":
        return stiffness * stiffness * far
    wn = SLOWEST_SERVO if drive.slowest is None else drive.slowest
    if drive.kind == "velocity":
        return wn * 2.0 / PEAK * (2.0 * pi / DURATION) * far
    return wn * wn * far


def probing_of(session: Session, given: Settings, detector: Detector) -> Probing | None:
    """The probing that a detector asks for, or None."""
    after, known = detector.probe_after, detector.calibration
    if after is None:
        return None
    if isinstance(given.scheme, Resolver):
        raise InputError(
            f"probe_after of the detector is {after:g} s, but the closed form {given.scheme.name!r} has no "
            "objective to probe by; take a scheme with a QP, such as mvn, or leave it out"
        )
    friction = given.robot.coulomb if known is None else known.coulomb
    return Probing(session, given.robot, given.criterion, after, drive=given.drive, friction=friction)
