"""One curve of rests, traced by predictor and corrector through folds and singularities.

Source: docs/theory/unidentified-failures.md, "Rest".
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from ftqp.analysis.circular_intervals import TURN
from ftqp.analysis.rest.rest_equations import RestEquations
from ftqp.control.inverse_kinematics.arm_study import SPAN_BY_LENGTH
from ftqp.core.checks import FloatArray

STEP = 0.04
"""Largest step, in joints and multipliers together."""
LEAST_STEP = 1e-6
"""Shortest step; where it does not do, the curve is lost."""
BRANCH_STEP = 1e-4
"""A change of orientation within so short a step is a branch point."""
LARGEST_TURN = 0.99
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
        """The curve through a rest; None where no direction can be told there."""
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
        return bool(t @ ahead > LARGEST_TURN and 0.5 * h < moved < 1.5 * h)

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
