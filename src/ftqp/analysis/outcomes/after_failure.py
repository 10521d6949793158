"""What becomes of one motion to a goal when joints lock and nobody tells the law."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, final

import numpy as np
from scipy.optimize import brentq

from ftqp.analysis.goals import GoalStudy, goal_study
from ftqp.analysis.outcomes.unaware_law import UnawareLaw, locked_joints, weights_inverse
from ftqp.analysis.rest.linearisation import reduced_jacobians, weighted_inverse
from ftqp.core.checks import BoolArray, FloatArray, frozen, non_negative, positive
from ftqp.core.errors import InputError
from ftqp.kernel.entry.law_study import Followed, LawStudy
from ftqp.kernel.layout.enums import Ending
from ftqp.kernel.layout.other_records import LONG_WAY
from ftqp.model.robot import Robot

RETURNS = 400
"""To the section, at most."""
SAME = 1e-6
"""Two returns so near each other are the same [rad]."""
AROUND = 0.5
"""The section reaches so far from its point [rad]."""
LONGEST = 100.0
"""Of a stretch on which returns are looked for, in units of the law's time constant."""
STRETCHES = 400
"""That are looked at, at most."""
SAMPLES = 2000
"""Of a round, at least, for its errors."""
NEVER = 1e-300
"""An |e| that no motion falls below [m]: it is followed for all of its time."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cycle:
    """A closed orbit."""

    q: FloatArray  # A configuration on it, (n,) [rad]
    period: float  # [s]
    error_range: tuple[float, float]  # The smallest and the largest |e| on it [m]


def cycle_through(
    study: LawStudy, law: UnawareLaw, locked: int, q: FloatArray, turning: BoolArray, clock: dict[str, Any]
) -> Cycle | None:
    """The cycle that a motion from q comes to; None where returns do not settle.

    The section is the plane through q across the motion; joints that turn count modulo one turn. A cycle is
    certified where two returns in a row agree within SAME.
    """
    n, across = len(q), law.rates(q)[0]
    if not np.linalg.norm(across) > 0.0:
        return None

    def away(y: FloatArray) -> FloatArray:
        d = y[..., :n] - q
        return np.asarray(np.where(turning, (d + np.pi) % (2.0 * np.pi) - np.pi, d))

    def ahead(y: FloatArray) -> FloatArray:
        d = y[..., :n] - q
        return np.asarray(np.where(turning, np.sin(d), d) @ across)

    here, last, returns = q, None, 0
    rows = np.empty((0, n + 2))
    for _ in range(STRETCHES):
        way = study.follow(here, locked, horizon=LONGEST / clock["gain"], success=NEVER, **clock)
        time, gone = rows[-1, n:] if len(rows) else (0.0, 0.0)
        new = np.column_stack([way.path, time + way.t, gone + way.s])
        rows = np.vstack([rows if last is None else rows[_before(rows, last) :], new])
        side = ahead(new)
        for k in np.flatnonzero((side[:-1] < 0.0) & (side[1:] >= 0.0)):
            if np.abs(away(new[k])).max() > AROUND:
                continue
            found = crossing(law, new[k, :-1], new[k + 1, :-1], new[k + 1, -1] - new[k, -1], ahead)
            if last is not None and np.abs(away(found) - away(last)).max() < SAME:
                some = rows[_before(rows, last) : _before(rows, found) + 2]
                return Cycle(q=found[:n], period=float(found[n] - last[n]), error_range=_errors(law, some))
            last, returns = found, returns + 1
        if returns >= RETURNS or len(new) < 2:
            return None
        here = way.path[-1]
    return None


def _before(rows: FloatArray, state: FloatArray) -> int:
    """The last row of a motion on record, (q, t, s) each, that is not later than a state (q, t)."""
    return max(0, int(np.searchsorted(rows[:, -2], state[-1], side="right")) - 1)


def _errors(law: UnawareLaw, rows: FloatArray) -> tuple[float, float]:
    """The smallest and the largest |e| of a motion that is on record, (q, t, s) each, (k, n + 2)."""
    states, count = [rows[:, :-1]], SAMPLES // len(rows)
    if count:
        share = np.linspace(0.0, 1.0, count + 2)[:, None]
        for first, last in pairwise(rows):
            states.append(law.between(first[:-1], last[:-1], last[-1] - first[-1], share))
    sizes = law.sizes(np.vstack(states)[:, :-1])
    return float(sizes.min()), float(sizes.max())


def crossing(
    law: UnawareLaw, begin: FloatArray, end: FloatArray, length: float, side: Callable[[FloatArray], Any]
) -> FloatArray:  # fmt: skip
    """The state (q, t) between two of a motion where a function of it is zero, (n + 1,)."""
    share = brentq(lambda x: float(side(law.between(begin, end, length, x))), 0.0, 1.0, xtol=1e-12)
    return law.between(begin, end, length, share)


FLAT = 1e-9
"""Least over largest singular value from which a start is singular."""
SUCCESS = 1e-2
"""The |e| that counts as correct within a horizon [unit lengths]."""
NEUTRAL = 1e-6
"""A rest whose slowest eigenvalue has a real part this small belongs to a curve of rests [1/s]."""
ROUNDING = 1e-5
"""Least over largest singular value below which slopes are lost in rounding ..."""
BEFORE = 1e-3
"""... and are those of a place so far before the rest [rad]."""
APART = 0.02
"""Of the configurations on record, in s."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """The end of a motion after a failure that nobody noticed.

    Attributes:
        kind: ``correct``: at rest at the goal; ``erroneous``: at rest elsewhere; ``none``: no rest, a limit
            cycle or a rotation; ``singular``: taken in by a singularity; ``unresolved``: no verdict.
        q: Where it ends, or a configuration on its cycle, (nv,) [rad or m].
        error: |e| there [m], angular rows times the characteristic length.
        rate: The exponent with which the rest is approached at last [1/s]; None without rest.
        period: Of the cycle [s]; None without one.
        error_range: The smallest and the largest |e| of the cycle [m]; None without one.
        path: The way of the joints from the failure on, (k, nv) [rad or m].
        t: Its times, (k,) [s].
        errors: |e| on it, (k,) [m].
        reason: A sentence on how this is known.
    """

    kind: str
    q: FloatArray
    error: float
    rate: float | None
    period: float | None
    error_range: tuple[float, float] | None
    path: FloatArray
    t: FloatArray
    errors: FloatArray
    reason: str


def outcome(
    robot: Robot,
    goal: Any,
    q0: Any,
    locked: str | int | Sequence[str | int],
    rows: Any = "position",
    W: Any = None,
    *,
    at: float = 0.0,
    horizon: float | None = None,
    gain: float = 1.0,
    v_max: float | None = None,
) -> Outcome:
    """Where a motion to a goal ends after joints have locked, when the law goes on as if nothing had.

    Joint limits do not count: the law knows none. Nor need the goal be within reach.
    Source: docs/theory/after-a-failure.md.

    Args:
        robot: The arm.
        goal: A point, (2,) or (3,) [m], or a pose, (4, 4).
        q0: Where the motion begins, (nv,) or (nq,) [rad or m].
        locked: The joint that locks, by name or index, or several.
        rows: ``"position"``, ``"pose"``, or names of task rows.
        W: Weights of the joint rates, positive definite, (nv, nv) or diagonal (nv,); None is the identity.
        at: The share of the healthy motion's distance that is done when the joints lock, 0 to 1.
        horizon: How long the motion is looked at [s]: it is correct where |e| has fallen below a hundredth of
            the mean link; None, the default, asks where it ends.
        gain: K_e of the law, > 0 [1/s]; larger is faster on the same way.
        v_max: The largest commanded speed of the task, > 0 [m/s]; None is no limit. The way is the same.

    Raises:
        InputError: The start is singular, the healthy arm meets a singularity before ``at``, W is not
            positive definite, there is no such joint, all are locked, or a number is out of its range.
    """
    study = goal_study(robot, goal, rows)
    which = locked_joints(robot, locked)
    M = weights_inverse(W, robot.nv)
    share = non_negative("at", at)
    if share > 1.0:
        raise InputError(f"at is {share:g}, expected a share of the motion from 0 to 1")
    limit = np.inf if v_max is None else positive("v_max", v_max, "m/s")
    clock: dict[str, Any] = {"gain": positive("gain", gain, "1/s"), "v_max": limit}
    end = None if horizon is None else positive("horizon", horizon, "s")
    q = robot.angles(q0)
    sigma = np.linalg.svd(study.free.values(q[None])[1][0], compute_uv=False)
    if not sigma[-1] >= FLAT * sigma[0]:
        raise InputError(
            f"q0 is singular: the task rows {', '.join(study.rows)} do not move independently there; "
            "expected a regular start, move a joint a little"
        )
    motion = _Motion(study, M, which, clock)
    q = motion.moved_on(q, share)
    return motion.ended(q) if end is None else motion.until(q, end)


@final
class _Motion:
    """A motion after a lock, and what there is to say of it."""

    def __init__(self, study: GoalStudy, M: FloatArray, which: Sequence[int], clock: dict[str, Any]) -> None:
        self._study, self._M, self._which, self._clock = study, M, list(which), clock
        self._unit = 6.0 * study.robot.length / study.robot.nv
        self._kernel = LawStudy(study.free, M, self._unit)
        self._law = UnawareLaw(study, M, which, **clock)
        self._locked = sum(1 << i for i in which)

    def _size(self, q: FloatArray) -> float:
        return float(self._law.sizes(q))

    def moved_on(self, q: FloatArray, share: float) -> FloatArray:
        """The configuration after a share of the way, straight to zero error; a singularity ends it."""
        if share == 0.0:
            return q
        whole = self._size(q)
        wanted = max(1.0 - share, 1e-9) * whole
        run = self._kernel.follow(q, 0, success=wanted)
        if run.ending == Ending.CORRECT:
            k = int(np.argmax(run.errors < wanted))
            y, length = np.column_stack([run.path, run.t])[k - 1 : k + 1], run.s[k] - run.s[k - 1]
            healthy = UnawareLaw(self._study, self._M, ())
            found = crossing(healthy, y[0], y[1], length, lambda y: self._law.sizes(y[:-1]) - wanted)
            return np.asarray(found[:-1])
        met = run.ending == Ending.SINGULAR
        missed = "it meets a singularity" if met else "it is not there in the steps it was given"
        raise InputError(
            f"at is {share:g}, but the healthy arm does only {1.0 - self._size(run.q) / whole:.5g} of the "
            f"motion's distance: {missed}; choose a smaller at, another q0 or a goal within reach"
        )

    def until(self, q: FloatArray, T: float) -> Outcome:
        """What is reached within a time."""
        bound = SUCCESS * self._unit
        run = self._kernel.follow(q, self._locked, horizon=T, success=bound, **self._clock)
        end = min(run.arrived, T, run.t[-1])
        last = [np.interp(end, run.t, column) for column in run.path.T]
        kept = run.t < end
        path, t = np.vstack([run.path[kept], last]), np.append(run.t[kept], end)
        errors = np.append(run.errors[kept], self._size(path[-1]))
        if run.ending == Ending.CORRECT or errors[0] < bound:
            ending, reason = Ending.CORRECT, f"The error fell below {bound:.3g} m after {end:.4g} s."
        else:
            ending, reason = Ending.UNRESOLVED, f"After {end:.4g} s the error was still {errors[-1]:.4g} m."
        return _outcome(ending, path[-1], errors[-1], (path, t, errors), reason)

    def ended(self, q: FloatArray) -> Outcome:
        """Where it ends."""
        run = self._kernel.follow(q, self._locked, **self._clock)
        row = np.unique((run.s / APART).astype(np.int64), return_index=True)[1]
        record = run.path[row], run.t[row], run.errors[row]
        size = self._size(run.q)
        if run.ending in (Ending.NONE, Ending.UNRESOLVED):
            return self._without_rest(run, size, record)
        if run.ending == Ending.SINGULAR:
            reason = (
                f"A singular configuration takes the arm in, {size:.4g} m from the goal: "
                "behind it the law points back."
            )
            return _outcome(run.ending, run.q, size, record, reason)
        slowest = self._rate(run)
        curve = run.ending == Ending.ERRONEOUS and slowest < NEUTRAL
        rate = 0.0 if curve else slowest * self._law.kappa(size)
        if run.ending == Ending.CORRECT:
            reason = f"The arm comes to rest at the goal; there the error falls with {rate:.4g} per second."
        elif curve:
            reason = (
                f"The arm comes to rest {size:.4g} m from the goal, at one of a curve of rest configurations."
            )
        else:
            reason = f"The arm comes to rest {size:.4g} m from the goal, where all eigenvalues are stable."
        return _outcome(run.ending, run.q, size, record, reason, rate=rate)

    def _rate(self, run: Followed) -> float:
        """The slowest eigenvalue at a rest [1/s at gain 1]; at the goal, nil ones of self-motion aside."""
        q = run.q
        A = self._study.free.values(q[None])[1][0]
        sigma = np.linalg.svd(A, compute_uv=False)
        if run.ending == Ending.CORRECT:
            free = np.setdiff1d(np.arange(len(q)), self._which)
            fall = np.sort(np.linalg.eigvals((weighted_inverse(A, self._M) @ A)[np.ix_(free, free)]).real)
            return float(fall[max(0, len(free) - len(A))])
        if sigma[-1] < ROUNDING * sigma[0]:
            away = run.path[-1] - q
            q = q + BEFORE * away / max(float(np.linalg.norm(away)), 1e-300)
        slopes = reduced_jacobians(self._study, self._M, q[None], self._which)[0]
        return float(-np.linalg.eigvals(slopes).real.max())

    def _without_rest(self, run: Followed, size: float, record: Any) -> Outcome:
        """A cycle that the motion is on, or comes to; else it is not known what becomes of it."""
        turning = self._study.turning
        cycle = cycle_through(self._kernel, self._law, self._locked, run.q, turning, self._clock)
        if cycle is not None:
            low, high = cycle.error_range
            reason = (
                f"The arm does not come to rest: it returns to the same configuration every "
                f"{cycle.period:.6g} s, the error between {low:.6g} and {high:.6g} m."
            )
            return _outcome(
                Ending.NONE, cycle.q, self._size(cycle.q), record, reason,
                period=cycle.period, error_range=cycle.error_range,
            )  # fmt: skip
        if run.ending == Ending.NONE:
            reason = f"The arm went {run.way:.0f} rad without rest; its returns do not settle to a cycle."
        else:
            reason = f"The arm neither came to rest nor went {LONG_WAY:.0f} rad in the steps it was given."
        return _outcome(Ending.UNRESOLVED, run.q, size, record, reason)


def _outcome(
    ending: Ending,
    q: FloatArray,
    error: float,
    record: tuple[FloatArray, FloatArray, FloatArray],
    reason: str,
    *,
    rate: float | None = None,
    period: float | None = None,
    error_range: tuple[float, float] | None = None,
) -> Outcome:
    """The outcome with the record of the way."""
    path, t, errors = record
    return Outcome(
        kind=ending.name.lower(), q=frozen(q.copy()), error=float(error), rate=rate, period=period,
        error_range=error_range, path=frozen(path), t=frozen(t), errors=frozen(errors), reason=reason,
    )  # fmt: skip
