"""What becomes of one motion to a goal when joints lock and nobody tells the law."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from scipy.integrate import DOP853, Radau, solve_ivp
from scipy.optimize import brentq

from ftqp.analysis.goals import goal_study
from ftqp.analysis.outcomes.limit_cycle import cycle_through
from ftqp.analysis.outcomes.unaware_law import UnawareLaw
from ftqp.analysis.outcomes.verdicts import NEAR, SLOW, Rest, goal_ahead, rest_ahead, singularity_ahead
from ftqp.analysis.outcomes.weights import weights_inverse
from ftqp.core.checks import BoolArray, FloatArray, frozen, non_negative, positive
from ftqp.core.errors import InputError
from ftqp.kernel.layout.endings import Ending
from ftqp.model.robot import Robot

TOLERANCE = 1e-10
"""Of a step of an end that is reported."""
STEPS, STIFF_STEPS = 400, 2000
"""Of the explicit method and of the L-stable one that follows."""
LOOKS = 4
"""Steps from one look at how it may end to the next."""
LONG_WAY = 60.0
"""A motion that went further without rest has none [rad]."""
LONGEST = 1.0
"""Of a step, in s."""
FLAT = 1e-9
"""Least over largest singular value from which a start is singular."""
SUCCESS = 1e-2
"""The |e| that counts as correct within a horizon [unit lengths]."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """The end of a motion after a failure that nobody was told of.

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
        W: Weights of the joint rates, (nv, nv) or its diagonal (nv,), positive definite; None is the
            identity.
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
    speed = positive("gain", gain, "1/s")
    end = None if horizon is None else positive("horizon", horizon, "s")
    q = robot.angles(q0)
    unit = 6.0 * robot.length / robot.nv
    healthy = UnawareLaw(study.free, M, (), speed, limit)
    if healthy.flatness(q) < FLAT:
        raise InputError(
            f"q0 is singular: the task rows {', '.join(study.rows)} do not move independently there; "
            "expected a regular start, move a joint a little"
        )
    q = _moved_on(healthy, q, share)
    return _Run(UnawareLaw(study.free, M, which, speed, limit), unit, study.turning, speed, end).outcome(q)


def locked_joints(robot: Robot, locked: str | int | Sequence[str | int]) -> tuple[int, ...]:
    """The indices of the joints that lock, or none.

    Args:
        robot: The arm.
        locked: By name or index, one or several.

    Raises:
        InputError: There is no such joint, or all are named.
    """
    given = [locked] if isinstance(locked, str | int | np.integer) else list(locked)
    which = tuple(sorted({robot.joint(joint) for joint in given}))
    if len(which) == robot.nv:
        raise InputError(f"locked names all {robot.nv} joints of {robot.name}; leave one that moves")
    return which


def _moved_on(law: UnawareLaw, q: FloatArray, share: float) -> FloatArray:
    """The configuration after a share of the healthy motion's distance.

    A healthy arm takes its error straight to zero, |e| = |e_0| exp(-kappa t), unless it meets a singularity:
    one that lies before the wanted error ends the way.
    """
    if share == 0.0:
        return q

    def size(y: FloatArray) -> float:
        return float(np.linalg.norm(law.error(y)))

    whole = size(q)
    wanted = max(1.0 - share, 1e-9) * whole
    solver = DOP853(law.scaled, 0.0, np.append(q, 0.0), 1e3, rtol=TOLERANCE, atol=TOLERANCE)
    done, missed = 0.0, "it is not there in the steps it was given"
    for step in range(1, STEPS + 1):
        solver.step()
        if solver.status == "failed":
            missed = "it meets a singularity"
            break
        left = size(solver.y[:-1])
        if left <= wanted:
            return _where(solver, lambda y: size(y[:-1]) - wanted)[:-1]
        done = 1.0 - left / whole
        met = singularity_ahead(law, solver.y[:-1]) if step % LOOKS == 0 else None
        if met is not None and size(met.q) > wanted:
            done, missed = 1.0 - size(met.q) / whole, "it meets a singularity"
            break
    raise InputError(
        f"at is {share:g}, but the healthy arm does only {done:.5g} of the motion's distance: {missed}; "
        "choose a smaller at, another q0 or a goal within reach"
    )


def _where(solver: DOP853, crossed: Callable[[FloatArray], float]) -> FloatArray:
    """The state within the last step of a solver at which a function of it is zero."""
    way = solver.dense_output()
    return np.asarray(way(brentq(lambda s: crossed(way(s)), solver.t_old, solver.t)))


@final
class _Run:
    """One motion and its record."""

    def __init__(
        self, law: UnawareLaw, unit: float, turning: BoolArray, gain: float, horizon: float | None
    ) -> None:
        self._law, self._unit, self._turning, self._gain, self._horizon = law, unit, turning, gain, horizon
        self._path: list[FloatArray] = []
        self._t: list[float] = []
        self._errors: list[float] = []
        self._way = 0.0

    def _note(self, q: FloatArray, t: float) -> float:
        """Put a configuration on record; |e| there."""
        if self._path:
            self._way += float(np.linalg.norm(q - self._path[-1]))
        self._path.append(q.copy())
        self._t.append(t)
        self._errors.append(float(np.linalg.norm(self._law.error(q))))
        return self._errors[-1]

    def outcome(self, q: FloatArray) -> Outcome:
        """Drive it to its end."""
        self._note(q, 0.0)
        if self._horizon is not None:
            return self._until(q, self._horizon)
        found = self._look(q)
        if found is None:
            found = self._explicit(q)
        cycle = None if found is not None else self._cycle()
        if found is None and cycle is None and self._way <= LONG_WAY:
            found = self._implicit(self._path[-1])
            cycle = None if found is not None else self._cycle()
        if found is not None:
            return self._ended(found)
        if cycle is not None:
            return cycle
        if self._way > LONG_WAY:
            reason = f"The arm went {self._way:.0f} rad without rest; its returns do not settle to a cycle."
        else:
            reason = f"The arm neither came to rest nor went {LONG_WAY:.0f} rad in the steps it was given."
        return self._said(Ending.UNRESOLVED, self._path[-1], reason)

    def _cycle(self) -> Outcome | None:
        """The outcome of a cycle that the motion is on, or comes to."""
        cycle = cycle_through(self._law, self._path[-1], self._turning)
        if cycle is None:
            return None
        low, high = cycle.error_range
        return self._said(
            Ending.NONE, cycle.q,
            f"The arm does not come to rest: it returns to the same configuration every "
            f"{cycle.period:.6g} s, the error between {low:.6g} and {high:.6g} m.",
            period=cycle.period, error_range=cycle.error_range,
        )  # fmt: skip

    def _look(self, q: FloatArray) -> Rest | None:
        """How it may end from here."""
        v, size = self._law.rates(q)
        rate = float(np.linalg.norm(v))
        if size < NEAR * self._unit and (found := goal_ahead(self._law, q, self._unit)) is not None:
            return found
        if rate / (0.5 + rate) < SLOW:
            return rest_ahead(self._law, q, self._unit)
        return singularity_ahead(self._law, q)

    def _explicit(self, q: FloatArray) -> Rest | None:
        """By an explicit method in s."""
        solver = DOP853(
            self._law.scaled, 0.0, np.append(q, 0.0), 1e6, max_step=LONGEST, rtol=TOLERANCE, atol=TOLERANCE
        )
        for step in range(1, STEPS + 1):
            solver.step()
            if solver.status != "running":
                return singularity_ahead(self._law, self._path[-1])
            self._note(solver.y[:-1], float(solver.y[-1]))
            if step % LOOKS == 0 and (found := self._look(solver.y[:-1])) is not None:
                return found
            if self._way > LONG_WAY:
                return None
        return None

    def _implicit(self, q: FloatArray) -> Rest | None:
        """By an L-stable method in real time with gain 1, for creeping next to singularities."""
        solver = Radau(
            self._law.real, 0.0, q, 1e9, jac=self._law.slopes, rtol=1e2 * TOLERANCE, atol=1e2 * TOLERANCE
        )
        t = self._t[-1]
        for step in range(1, STIFF_STEPS + 1):
            solver.step()
            if solver.status != "running":
                return singularity_ahead(self._law, self._path[-1])
            t += (solver.t - solver.t_old) / self._law.kappa(self._errors[-1])
            self._note(solver.y, t)
            if step % LOOKS == 0 and (found := self._look(solver.y)) is not None:
                return found
            if self._way > LONG_WAY:
                return None
        return None

    def _until(self, q: FloatArray, T: float) -> Outcome:
        """What is reached within a time."""
        bound = SUCCESS * self._unit

        def near(t: float, y: FloatArray) -> float:
            return float(np.linalg.norm(self._law.error(y))) - bound

        def motion(t: float, y: FloatArray) -> FloatArray:
            v, size = self._law.rates(y)
            return np.asarray(v * self._law.kappa(size))

        near.terminal = True  # type: ignore[attr-defined]
        way = solve_ivp(motion, (0.0, T), q, method="LSODA", rtol=1e-9, atol=1e-9, events=near)
        for k in range(1, len(way.t)):
            self._note(way.y[:, k], float(way.t[k]))
        if way.status == 1 or self._errors[-1] < bound:
            reason = f"The error fell below {bound:.3g} m after {self._t[-1]:.4g} s."
            return self._said(Ending.CORRECT, self._path[-1], reason)
        reason = f"After {T:.4g} s the error was still {self._errors[-1]:.4g} m."
        return self._said(Ending.UNRESOLVED, self._path[-1], reason)

    def _ended(self, found: Rest) -> Outcome:
        """The outcome of a rest."""
        size = float(np.linalg.norm(self._law.error(found.q)))
        if found.ending == Ending.SINGULAR:
            return self._said(
                found.ending, found.q,
                f"A singular configuration takes the arm in, {size:.4g} m from the goal: "
                "behind it the law points back.",
            )  # fmt: skip
        rate = found.rate * self._law.kappa(size)
        if found.ending == Ending.CORRECT:
            reason = f"The arm comes to rest at the goal; there the error falls with {rate:.4g} per second."
        elif found.curve:
            reason = (
                f"The arm comes to rest {size:.4g} m from the goal, at one of a curve of rest configurations."
            )
        else:
            reason = f"The arm comes to rest {size:.4g} m from the goal, where all eigenvalues are stable."
        return self._said(found.ending, found.q, reason, rate=rate)

    def _said(
        self,
        ending: Ending,
        q: FloatArray,
        reason: str,
        *,
        rate: float | None = None,
        period: float | None = None,
        error_range: tuple[float, float] | None = None,
    ) -> Outcome:
        """The outcome with the record so far."""
        return Outcome(
            kind=ending.name.lower(), q=frozen(np.asarray(q).copy()),
            error=float(np.linalg.norm(self._law.error(np.asarray(q)))), rate=rate, period=period,
            error_range=error_range, path=frozen(np.array(self._path)), t=frozen(np.array(self._t)),
            errors=frozen(np.array(self._errors)), reason=reason,
        )  # fmt: skip
