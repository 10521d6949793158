"""Whether the rest of a task can be done by the joints that a failure leaves, by a search of its own."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
import pinocchio as pin

from ftqp.checker.claim_laws import errors, rotation_vectors
from ftqp.checker.joint_health import health
from ftqp.checker.model_file import ModelFile
from ftqp.checker.motion_laws import stands
from ftqp.checker.trace import ROWS, Failure, Rest, Strictness, Trace
from ftqp.core.checks import BoolArray, FloatArray

PERIOD: Final = 0.01
"""The motion is looked for every so many seconds, or every tick where ticks are longer [s]."""
STEPS: Final = 8
"""Newton steps at most from sample to sample."""
NEAR: Final = 1e-7
"""The motion is on its target to this [m and rad]."""
SPEED, ACCELERATION, TORQUE = 0.5, 0.5, 0.7
"""Shares of the limits that the motion keeps to."""
ROOM: Final = 0.02
"""Distance that it keeps from the ends of a range, as a share of it."""
LEAST: Final = 1e-3
"""A task is singular where a unit of motion along it takes more than 1/LEAST of the joints."""
KEPT: Final = 0.9
"""Share of its velocity that an arm keeps from sample to sample in what the task leaves free, ..."""
PULLED: Final = 0.3
"""... where a posture draws it, with up to this share of its speed limits."""


def followable(arm: ModelFile, q: FloatArray, target: FloatArray, rows: Sequence[str], dt: float) -> float:
    """How long a target is certain to be within reach, speed and strength of an arm that starts at rest [s].

    The joints are led along the target by the least change that keeps to it, J+ e, again and again. While
    that motion keeps to a half of the limits of speed and acceleration, to 70 % of the torques and away from
    the ends of the joints' ranges, it is a witness: the target can be followed; else nothing is said.
    """
    every = max(1, round(PERIOD / dt))
    reached = followed(arm, q, np.zeros(len(q)), target[::every], rows, every * dt)
    return len(target) * dt if reached == len(target[::every]) else max(0, reached - 1) * every * dt


def followed(
    arm: ModelFile,
    q: FloatArray,
    v: FloatArray,
    target: FloatArray,
    rows: Sequence[str],
    h: float,
    *,
    moves: BoolArray | None = None,
    drawn_to: FloatArray | None = None,
    shares: tuple[float, float, float] = (SPEED, ACCELERATION, TORQUE),
) -> int:
    """How many samples of a target the joints follow by the least change, within shares of their limits."""
    wanted = np.array([row in rows for row in ROWS])
    data = arm.model.createData()
    low, high = _inner(arm)
    free = np.ones(len(q), dtype=np.bool_) if moves is None else moves
    low, high = np.where(free, low, -np.inf), np.where(free, high, np.inf)
    at, before = np.array(q, dtype=np.float64), np.where(free, v, 0.0)
    for k, pose in enumerate(target):
        guess = at
        if drawn_to is not None and k:
            pull = np.where(free, np.clip(drawn_to - at, -PULLED * arm.v_max, PULLED * arm.v_max), 0.0)
            guess = at + h * (KEPT * before + (1.0 - KEPT) * pull)
        after = _solved(arm, data, guess, pose, wanted, free)
        if after is None or (after < low).any() or (after > high).any():
            return k
        now = (after - at) / h
        if k and not (
            (np.abs(now) <= shares[0] * arm.v_max)[free].all()
            and (np.abs(now - before) <= h * shares[1] * arm.a_max)[free].all()
            and _strong(arm, at, before, (now - before) / h, shares[2])
        ):
            return k
        at, before = after, now if k else before
    return len(target)


def _inner(arm: ModelFile) -> tuple[FloatArray, FloatArray]:
    """The ranges of the joints without their ends."""
    with np.errstate(invalid="ignore"):
        width = np.where(np.isfinite(arm.q_max - arm.q_min), ROOM * (arm.q_max - arm.q_min), 0.0)
    return arm.q_min + width, arm.q_max - width


def _strong(arm: ModelFile, q: FloatArray, v: FloatArray, a: FloatArray, share: float) -> bool:
    """Whether the joints carry a motion with a part of their torques."""
    if not arm.has_masses:
        return True
    tau = arm.torques(q[None], v[None], a[None])[0]
    return bool((np.abs(tau) <= share * arm.tau_max).all())


def _solved(
    arm: ModelFile, data: Any, q: FloatArray, target: FloatArray, wanted: Any, free: Any
) -> FloatArray | None:
    """The posture near q with its tip on a target; None where there is none, or the task is singular."""
    at = q.copy()
    for _ in range(STEPS):
        tip, J = arm.tip_and_jacobian(data, at)
        error = np.concatenate([target[:3, 3] - tip[:3, 3], pin.log3(target[:3, :3] @ tip[:3, :3].T)])
        error = error[wanted]
        if np.abs(error).max() < NEAR:
            return at
        J = J[wanted][:, free]
        U, sigma, V = np.linalg.svd(J, full_matrices=False)
        if len(sigma) < len(error) or sigma[-1] < LEAST * max(sigma[0], 1.0):
            return None
        at = at.copy()
        at[free] += V.T @ ((U.T @ error) / sigma)
    return None


COMES_BACK: Final = 1.0
"""In the search the tip comes back to its target within so long after a failure, which is the least that has
to be left [s]. A convention."""
PULLS: Final = 5
"""Random postures that the search is drawn to, one after the other, where the task leaves joints free."""
SLOWED: Final = 4.0
"""A path that waits for its arm is searched so many times as slowly."""
SHARES: Final = (0.8, 0.8, 0.9)
"""Of the limits of speed, acceleration and torque, that the search keeps to: a motion that needs them nearly
whole would have to be found exactly. Guesses: with a half of speed and acceleration, `ftqp campaign safety`
finds motions for too few of the arms that do finish."""
STOPS: Final = ("STOPPING", "STOPPED")
"""An arm that was stopped does not go on, and says so."""


def recovery(arm: ModelFile, run: Trace, strict: Strictness) -> FloatArray:
    """By how much the end of a task that is possible is missed, at the last tick, (K, 1); 0 if stopped."""
    result = np.zeros((len(run.status), 1))
    if run.rest is not None and run.rest.feasible and not run.rest.stopped:
        result[-1] = run.rest.missed
    return result


def rest_after(arm: ModelFile, run: Trace, strict: Strictness) -> Rest | None:
    """What is left of a task after locks and weakened joints that were reported.

    The search begins where the arm is when the locked joints stand and the planner knows. From there the
    tip comes back to its target in ``COMES_BACK``, by a quintic that begins as fast as the tip is, and
    follows it to the end, within ``SHARES`` of the limits of speed, acceleration and torque and 2 % away
    from the ends of the ranges. Where the task leaves joints free, postures draw these one by one.
    """
    k = _begins(arm, run, strict)
    if k is None:
        return None
    target, h = _left(run, k)
    if len(target) * h < COMES_BACK:
        return None
    _, limits = health(arm, run)
    left = replace(arm, **{name: values[k] for name, values in limits.items()})
    moves = np.ones(len(arm.names), dtype=np.bool_)
    for failure in run.failures:
        moves[failure.joint] &= failure.kind != "locked"
    q, v = run.q[k], np.where(moves, run.v[k], 0.0)
    aimed = _coming_back(left, q, v, target, h)
    last = max(run.failures, key=lambda failure: failure.since)
    return Rest(
        joint=last.joint,
        since=_share(run, last),
        feasible=any(
            followed(left, q, v, aimed, run.rows, h, moves=moves, drawn_to=posture, shares=SHARES)
            == len(aimed)
            for posture in _drawn_to(left, q, int(moves.sum()) > len(run.rows))
        ),
        missed=_missed(arm, run, k),
        stopped=run.status[-1] in STOPS,
    )


def _begins(arm: ModelFile, run: Trace, strict: Strictness) -> int | None:
    """The tick from which the joints left have the task for themselves."""
    k, t = 0, run.t
    for failure in run.failures:
        counts = failure.kind in ("locked", "degraded") and np.isfinite(failure.reported_at)
        if not counts or np.isfinite(failure.until):
            return None
        there = t > max(failure.reported_at, failure.since)
        if failure.kind == "locked":
            there &= stands(arm, run, strict, failure)
        if not there.any():
            return None
        k = max(k, int(np.argmax(there)))
    return k if run.failures else None


def _left(run: Trace, k: int) -> tuple[FloatArray, float]:
    """What is left of the target from a tick on, (N, 4, 4) [m], and the time between two samples [s]."""
    if run.path is not None:
        return run.path[int(run.progress[k] / run.path_dt) :], SLOWED * run.path_dt
    every = max(1, round(PERIOD / run.dt))
    return run.target[k::every], every * run.dt


def _coming_back(arm: ModelFile, q: FloatArray, v: FloatArray, target: FloatArray, h: float) -> FloatArray:
    """The target, and before it a way to it that begins where and as fast as the tip is, (N, 4, 4) [m]."""
    tip, J = arm.tip_and_jacobian(arm.model.createData(), q)
    off = np.concatenate([tip[:3, 3] - target[0, :3, 3], pin.log3(tip[:3, :3] @ target[0, :3, :3].T)])
    after = target[min(1, len(target) - 1)]
    turned = rotation_vectors((after[:3, :3] @ target[0, :3, :3].T)[None])[0]
    rate = J @ v - np.concatenate([after[:3, 3] - target[0, :3, 3], turned]) / h
    result = target.copy()
    for k in range(min(len(target), int(COMES_BACK / h))):
        s = k * h / COMES_BACK
        place = 1.0 - 10.0 * s**3 + 15.0 * s**4 - 6.0 * s**5
        speed = COMES_BACK * (s - 6.0 * s**3 + 8.0 * s**4 - 3.0 * s**5)
        away = place * off + speed * rate
        result[k, :3, 3] += away[:3]
        result[k, :3, :3] = pin.exp3(away[3:]) @ target[k, :3, :3]
    return result


def _drawn_to(arm: ModelFile, q: FloatArray, several: bool) -> Iterator[FloatArray]:
    """Postures, one after the other: that of the arm, the middle of the ranges, and random ones."""
    yield q
    if not several:
        return
    low = np.where(np.isfinite(arm.q_min), arm.q_min, q - np.pi)
    high = np.where(np.isfinite(arm.q_max), arm.q_max, q + np.pi)
    yield 0.5 * (low + high)
    generator = np.random.default_rng(PULLS)
    for _ in range(PULLS):
        yield generator.uniform(low, high)


def _missed(arm: ModelFile, run: Trace, k: int) -> float:
    """By how much the arm misses the end of its task, as a share of the tolerance, or of the path.

    The search takes ``SLOWED`` times the time of the path that is left at tick k. Where the run ends sooner,
    the arm is given that time, too, in which it goes on at the pace that it has in the end. What a search
    does in 4.1 s nobody can ask for in 2.4 s: of `ftqp campaign safety` episode 376 has done 0.76 of its path
    then, on its way past a singularity with the acceleration of a bend, and all of it after 3.0 s (``--replay
    376 --set scenario.simulation.duration=3.0``). An arm that stands in the end is given nothing. One that
    would only come to stand later is not seen; a longer run sees it.
    """
    position, rotation = errors(arm, run)
    share = max(position[-1] / run.tolerance[0], rotation[-1] / run.tolerance[1]) - 1.0
    if run.path is not None:
        length = run.path_dt * (len(run.path) - 1)
        time = max(0.0, SLOWED * (length - run.progress[k]) - run.dt * (len(run.progress) - 1 - k))
        pace = max(0.0, run.progress[-1] - run.progress[-2]) / run.dt
        share = max(share, 1.0 - (run.progress[-1] + time * pace + run.path_dt) / length)
    return max(0.0, float(share))


def _share(run: Trace, failure: Failure) -> float:
    """At which share of the motion a joint failed."""
    if run.path is not None:
        k = min(int(failure.since / run.dt), len(run.progress) - 1)
        return float(run.progress[k] / (run.path_dt * (len(run.path) - 1)))
    moved = np.flatnonzero((run.target[1:] != run.target[:-1]).any(axis=(1, 2)))
    return min(1.0, failure.since / (run.dt * (moved[-1] + 1))) if moved.size else 1.0
