"""One curve of rests, by predictor and corrector: docs/theory/unidentified-failures.md, "Rest"."""

from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.analysis.circular_intervals import TURN
from ftqp.analysis.goals import GoalStudy
from ftqp.analysis.rest.linearisation import still_joints
from ftqp.control.inverse_kinematics.posture_search import SPAN_BY_LENGTH
from ftqp.core.checks import BoolArray, FloatArray

LARGEST_TURN = 0.7
"""Largest change of a joint in a step of ``solved`` [rad or m]."""


@final
class RestEquations:
    """Psi(z) = [M A' mu - beta e_i; gamma e - alpha a_i; two norms] = 0, z = (q, mu, beta, alpha, gamma).

    M is W^-1. M A' mu = beta e_i says that the arm can command joint i alone, gamma e = alpha a_i that it
    does. The norms L^2 mu'mu + beta^2 and alpha^2 + gamma^2 are 1, L the characteristic length. n + m + 2
    equations for n + m + 3 unknowns: rests are curves. beta is 0 where A is singular, gamma where joint i
    does not move the tip; (mu, beta) and (alpha, gamma) count up to their signs. Joints that never move the
    tip and are not commanded stand at their neutral values, which replaces their rows.
    Source: docs/theory/unidentified-failures.md, "Rest".
    """

    def __init__(self, study: GoalStudy, M: FloatArray, i: int) -> None:
        self.study, self.i = study, i
        self.M = M * (len(M) / np.trace(M))
        self.n, self.m = study.robot.nv, study.m
        self.size = self.n + self.m + 3
        self._still = still_joints(study, M)
        self._stand = study.robot.neutral[self._still]

    def values(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Psi, (k, n + m + 2), and its derivative, (k, n + m + 2, n + m + 3)."""
        n, m, i, k = self.n, self.m, self.i, len(z)
        mu, (beta, alpha, gamma) = z[:, n : n + m], z[:, n + m :].T
        e, A, D, H = self.study.free.values(z[:, :n], rates=True)
        MAt = self.M @ np.swapaxes(A, 1, 2)
        square = self.study.robot.length**2
        psi = np.empty((k, n + m + 2))
        psi[:, :n] = np.einsum("kia,ka->ki", MAt, mu)
        psi[:, i] -= beta
        psi[:, n : n + m] = gamma[:, None] * e - alpha[:, None] * A[:, :, i]
        psi[:, -2] = square * (mu * mu).sum(axis=1) + beta * beta - 1.0
        psi[:, -1] = alpha * alpha + gamma * gamma - 1.0
        d = np.zeros((k, n + m + 2, self.size))
        d[:, :n, :n] = np.swapaxes(np.einsum("klan,ka->kln", H, mu) @ self.M, 1, 2)
        d[:, :n, n : n + m] = MAt
        d[:, i, n + m] = -1.0
        turned = np.swapaxes(H[:, :, :, i], 1, 2)
        d[:, n : n + m, :n] = -gamma[:, None, None] * D - alpha[:, None, None] * turned
        d[:, n : n + m, n + m + 1] = -A[:, :, i]
        d[:, n : n + m, n + m + 2] = e
        d[:, -2, n : n + m] = 2.0 * square * mu
        d[:, -2, n + m] = 2.0 * beta
        psi[:, self._still] = z[:, self._still] - self._stand
        d[:, self._still] = 0.0
        d[:, self._still, self._still] = 1.0
        d[:, -1, n + m + 1] = 2.0 * alpha
        d[:, -1, n + m + 2] = 2.0 * gamma
        return psi, d

    def started(self, q: FloatArray) -> FloatArray:
        """Unknowns near configurations, (k, n + m + 3): the best multipliers there."""
        q = q.copy()
        q[:, self._still] = self._stand
        e, A, _, _ = self.study.free.values(q)
        mu = np.linalg.pinv(self.M @ np.swapaxes(A, 1, 2))[:, :, self.i]
        size = np.sqrt(self.study.robot.length**2 * (mu * mu).sum(axis=1) + 1.0)
        a = A[:, :, self.i]
        alpha = (a * e).sum(axis=1) / np.maximum((a * a).sum(axis=1), 1e-12)
        both = np.hypot(alpha, 1.0)
        return np.column_stack([q, mu / size[:, None], 1.0 / size, alpha / both, 1.0 / both])

    def solved(self, z: FloatArray, *, held: bool, iterations: int = 60) -> tuple[FloatArray, BoolArray]:
        """Unknowns brought to a rest by damped Gauss-Newton steps, and which of them got there, (k,)."""
        z = z.copy()
        columns = np.ones(self.size)
        columns[self.i] = 0.0 if held else 1.0
        damping = np.full(len(z), 1e-2)
        psi, d = self.values(z)
        cost = (psi * psi).sum(axis=1)
        open_ = np.arange(len(z))
        for _ in range(iterations):
            open_ = open_[cost[open_] > 1e-24]
            if not len(open_):
                break
            J = d[open_] * columns
            normal = J @ np.swapaxes(J, 1, 2)
            scale = np.trace(normal, axis1=1, axis2=2) / normal.shape[1]
            normal += (damping[open_] * np.minimum(cost[open_], 1.0) * scale + 1e-15 * scale)[
                :, None, None
            ] * np.eye(normal.shape[1])
            y = np.linalg.solve(normal, psi[open_][:, :, None])
            step = -(np.swapaxes(J, 1, 2) @ y)[:, :, 0]
            largest = np.abs(step[:, : self.n]).max(axis=1)
            step *= np.minimum(1.0, LARGEST_TURN / np.maximum(largest, 1e-300))[:, None]
            trial = z[open_] + step
            psi_new, d_new = self.values(trial)
            cost_new = (psi_new * psi_new).sum(axis=1)
            better = cost_new < cost[open_]
            won = open_[better]
            z[won], psi[won], d[won], cost[won] = (
                trial[better],
                psi_new[better],
                d_new[better],
                cost_new[better],
            )
            damping[won] *= 0.2
            damping[open_[~better]] *= 8.0
        return z, np.asarray(cost < 1e-20)


STEP = 0.04
"""Largest step, in joints and multipliers together."""
LEAST_STEP = 1e-6
"""Shortest step; where it does not do, the curve is lost."""
BRANCH_STEP = 1e-4
"""A change of orientation within so short a step is a branch point."""
STRAIGHT = 0.99
"""Cosine of the turn of the tangent, 8 degrees, from which a step is halved."""
FAR = 10.0
"""A sliding joint without limits is not followed beyond so many reaches of the arm."""
CORRECTIONS = 8
"""Newton steps back onto the curve at most."""
RESIDUAL = 1e-11
"""Largest residual of a point of a curve."""
MOST_POINTS = 20_000
"""Points of a curve at most."""
FIRST_CLOSURE = 5
"""Points before which a curve is not looked at for closing."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TracedRests:
    """A curve of rests as it was traced."""

    # Its points, (k, n + m + 3), see ``RestEquations``; of a closed curve the last is the first again
    z: FloatArray
    closed: bool  # Whether it comes back to its start
    branches: tuple[int, ...]  # Indices of points behind which another curve crosses this one


@final
class RestTracer:
    """Traces curves of rests of one set of equations."""

    def __init__(self, equations: RestEquations) -> None:
        self._equations = equations
        self._n = equations.n
        robot = equations.study.robot
        self._turns = ~robot.chain.prismatic
        far = FAR * SPAN_BY_LENGTH * robot.length
        self._low = np.where(self._turns, -np.inf, np.maximum(robot.limits.q_min, -far))
        self._high = np.where(self._turns, np.inf, np.minimum(robot.limits.q_max, far))

    def trace(self, start: FloatArray) -> TracedRests | None:
        """The curve through a rest; None where no direction can be found there."""
        first = self._tangent(start, None)
        if first is None:
            return None
        ahead, ends, branches = self._follow(start, first)
        if ends == "closed":
            return TracedRests(z=np.array(ahead), closed=True, branches=tuple(branches))
        back, _, more = self._follow(start, -first)
        points = np.array(back[:0:-1] + ahead)
        shift = len(back) - 1
        both = [shift + k for k in branches] + [shift - k - 1 for k in more]
        return TracedRests(z=points, closed=False, branches=tuple(sorted(both)))

    def between(self, one: FloatArray, other: FloatArray, share: float) -> FloatArray:
        """The point of the curve beside a share of the chord between two neighbours."""
        chord = other - one
        z = self._corrected(one + share * chord, chord / np.linalg.norm(chord))
        return one + share * chord if z is None else z

    def distances(self, z: FloatArray, q: FloatArray) -> FloatArray:
        """How far configurations on a curve are from one, whole turns left out, (k,) [rad or m]."""
        away = z[:, : self._n] - q
        away = np.where(self._turns, away - TURN * np.round(away / TURN), away)
        return np.asarray(np.linalg.norm(away, axis=1))

    def _follow(self, start: FloatArray, first: FloatArray) -> tuple[list[FloatArray], str, list[int]]:
        points, branches = [start], list[int]()
        t, h, side = first, STEP, self._side(start, first)
        while len(points) < MOST_POINTS:
            here = points[-1]
            z = self._corrected(here + h * t, t)
            ahead = None if z is None else self._tangent(z, t)
            if z is None or ahead is None or not self._holds(here, z, t, ahead, h):
                h *= 0.5
                if h < LEAST_STEP:
                    return points, "lost", branches
                continue
            now = self._side(z, ahead)
            if now * side < 0.0:
                if h > BRANCH_STEP:
                    h *= 0.5
                    continue
                branches.append(len(points) - 1)
            if len(points) >= FIRST_CLOSURE:
                closing = self._closing(start, here, z, first, h)
                if closing is not None:
                    points.append(closing)
                    return points, "closed", branches
            points.append(z)
            if ((z[: self._n] < self._low) | (z[: self._n] > self._high)).any():
                return points, "left", branches
            t, side = ahead, now
            h = min(STEP, 1.5 * h)
        return points, "unfinished", branches

    def _holds(self, here: FloatArray, z: FloatArray, t: FloatArray, ahead: FloatArray, h: float) -> bool:
        moved = float(np.linalg.norm(z - here))
        return bool(t @ ahead > STRAIGHT and 0.5 * h < moved < 1.5 * h)

    def _tangent(self, z: FloatArray, last: FloatArray | None) -> FloatArray | None:
        """The direction of the curve, along the last one."""
        _, d = self._equations.values(z[None])
        if last is None:
            _, sigma, rows = np.linalg.svd(d[0])
            t = rows[-1]
            if sigma[-1] < 1e-9 * sigma[0]:
                return None
        else:
            right = np.zeros(self._equations.size)
            right[-1] = 1.0
            try:
                t = np.linalg.solve(np.vstack([d[0], last]), right)
            except np.linalg.LinAlgError:
                return None
        size = float(np.linalg.norm(t))
        return None if not np.isfinite(size) or size < 1e-12 else np.asarray(t / size)

    def _corrected(self, z: FloatArray, t: FloatArray) -> FloatArray | None:
        """The point of the curve in the plane across t, or None."""
        for _ in range(CORRECTIONS):
            psi, d = self._equations.values(z[None])
            if not np.isfinite(psi).all():
                return None
            if np.abs(psi).max() < RESIDUAL:
                return z
            try:
                step = np.linalg.solve(np.vstack([d[0], t]), np.append(-psi[0], 0.0))
            except np.linalg.LinAlgError:
                return None
            z = z + step
        return None

    def _side(self, z: FloatArray, t: FloatArray) -> float:
        """The sign of det [dPsi; t]: it changes at a branch point."""
        _, d = self._equations.values(z[None])
        return float(np.linalg.slogdet(np.vstack([d[0], t]))[0])

    def _closing(
        self, start: FloatArray, here: FloatArray, z: FloatArray, first: FloatArray, h: float
    ) -> FloatArray | None:
        """The start as the curve gets to it, by whole turns and signs of multipliers, or None."""
        n = self._n
        for sign, other in ((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)):
            flips = np.ones(self._equations.size)
            flips[n:-2], flips[-2:] = sign, other
            end, along = flips * start, flips * first
            end[:n] += TURN * np.where(self._turns, np.round((here[:n] - start[:n]) / TURN), 0.0)
            w, d = end - here, z - here
            share = float(w @ d) / float(d @ d)
            beside = float(w @ w) - share * share * float(d @ d)
            agree = abs(float(along @ d)) / float(np.linalg.norm(d))
            if w @ w < 4.0 * h * h and -0.01 < share < 1.01 and beside < 0.09 * h * h and agree > 0.9:
                return end
        return None
