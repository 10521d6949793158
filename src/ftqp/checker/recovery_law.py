"""Whether the rest of a task can be done by the joints that a failure leaves, by a search of its own."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np
import pinocchio as pin

from ftqp.checker.joint_health import health
from ftqp.checker.lock_law import stands
from ftqp.checker.model_file import ModelFile
from ftqp.checker.reference_motion import PERIOD, followed
from ftqp.checker.tip_errors import errors, rotation_vectors
from ftqp.checker.trace import Failure, Rest, Strictness, Trace
from ftqp.core.checks import FloatArray

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
    """By how much the end of a task is missed that the joints left can do, at the last tick, (K, 1).

    An arm that was stopped misses nothing: it says that it does not go on.
    """
    result = np.zeros((len(run.status), 1))
    if run.rest is not None and run.rest.feasible and not run.rest.stopped:
        result[-1] = run.rest.missed
    return result


def rest_after(arm: ModelFile, run: Trace, strict: Strictness) -> Rest | None:
    """What is left of a task after locks and weakened joints that the planner was told of.

    The search begins where the arm is when the locked joints stand and the planner knows. From there the
    tip comes back to its target in ``COMES_BACK``, by a quintic that begins as fast as the tip is, and
    follows it to the end, within ``SHARES`` of the limits of speed, acceleration and torque and 2 % away
    from the ends of the ranges. Where the task leaves joints free, these are drawn to one posture after the
    other.
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
        told = failure.kind in ("locked", "degraded") and np.isfinite(failure.told)
        if not told or np.isfinite(failure.until):
            return None
        there = t > max(failure.told, failure.since)
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
