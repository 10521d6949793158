"""The range of a joint of an arm with several joints to spare: the other joints are asked at each value."""

from typing import Any, final

import numpy as np
from scipy.optimize import minimize

from ftqp.analysis.circular_intervals import TURN, WHOLE, CircularIntervals
from ftqp.analysis.goals import GoalStudy
from ftqp.core.checks import FloatArray

VALUES = 180
"""Values of a joint that are asked."""
STARTS = 16
"""Starts of the other joints at each, beside the solutions of its neighbours."""
HALVINGS = 12
"""Halvings of the last step before an end, and then SQP and Newton steps take over."""
MISSED = 8
"""Known configurations outside the intervals of the scan from which their ends are pushed out."""
PUSHED = 8
"""Configurations that SQP then starts from, of those found from so many ..."""
MORE_STARTS = 64
"""... starts of the other joints."""
BETWEEN = 6
"""Values between the start and the end of SQP that must be reached, too ..."""
NARROW = 1e-3
"""... where these are farther apart [rad or m]."""
SQP = 100
"""Iterations of SQP at most."""
ROUGH = 1e-9
"""Error with which a result of SQP counts as at the goal [m]."""
NEWTON = 30
"""Newton steps at an end at most."""
AT_LIMIT = 1e-8
"""A joint so near its limit stays there [rad or m]."""
FAR = 0.3
"""An end does not lie so far from where halving left it [rad or m]."""


def scanned_range(study: GoalStudy, i: int, solutions: FloatArray) -> CircularIntervals:
    """The values of joint i with which the other joints bring the tip to the goal."""
    turns = bool(study.turning[i])
    low, high = WHOLE if turns else (study.robot.limits.q_min[i], study.robot.limits.q_max[i])
    if not np.isfinite(low + high):
        low, high = solutions[:, i].min() - 1.0, solutions[:, i].max() + 1.0
    values = np.linspace(low, high, VALUES, endpoint=not turns)
    others = _Others(study, i)
    found = others.scan(values)
    reached = np.array([q is not None for q in found])
    if reached.all():
        return CircularIntervals.of([(low, high)], circular=turns)
    pairs = [(float(a), float(a)) for a in solutions[:, i] if not reached.any()]
    last = len(values) - 1
    for k in np.flatnonzero(reached):
        before, after = (k - 1) % len(values), (k + 1) % len(values)
        begin = end = float(values[k])
        if (turns or k > 0) and not reached[before]:
            begin = others.end(found[k], float(values[before]) - (TURN if k == 0 else 0.0))
        if (turns or k < last) and reached[after]:
            end = float(values[after]) + (TURN if k == last else 0.0)
        elif turns or k < last:
            end = others.end(found[k], float(values[after]) + (TURN if k == last else 0.0))
        pairs.append((begin, end))
    for _ in range(MISSED):
        covered = CircularIntervals.of(pairs, circular=turns)
        outside = covered.margin(solutions[:, i]) < -AT_LIMIT
        if not outside.any():
            break
        q = solutions[np.argmax(outside)]
        pairs.append((others.pushed_end(q, -1.0), others.pushed_end(q, 1.0)))
    return CircularIntervals.of(pairs, circular=turns)


@final
class _Others:
    """The other joints of an arm one of whose joints is asked for."""

    def __init__(self, study: GoalStudy, i: int) -> None:
        self._study, self._i = study, i
        self._session = study.limited.copy()
        self._session.hold([i])
        self._starts = study.starts(STARTS, limited=True)

    def at(self, value: float, near: FloatArray | None) -> FloatArray | None:
        """A configuration at the goal with the joint there, or None; a near one is tried first."""
        for starts in ([] if near is None else [near[None]]) + [self._starts]:
            begin = starts.copy()
            begin[:, self._i] = value
            q, errors, _ = self._session.solutions(begin, bounded=True)
            done = errors <= self._study.tolerance
            if done.any():
                return np.asarray(q[np.argmax(done)])
        return None

    def _all_at(self, value: float) -> FloatArray:
        """Configurations at the goal with the joint there, from many starts, (k, nv)."""
        begin = self._study.starts(MORE_STARTS, limited=True)
        begin[:, self._i] = value
        q, errors, _ = self._session.solutions(begin, bounded=True)
        return np.asarray(q[errors <= self._study.tolerance])

    def scan(self, values: FloatArray) -> list[FloatArray | None]:
        """Configurations at the values, from neighbour to neighbour, there and back."""
        found: list[FloatArray | None] = []
        near = None
        for value in values:
            near = self.at(float(value), near)
            found.append(near)
        near = found[0]
        for k in range(len(values) - 1, -1, -1):
            if found[k] is None and near is not None:
                found[k] = self.at(float(values[k]), near)
            near = found[k]
        return found

    def end(self, inside: FloatArray | None, outside: float) -> float:
        """The end of the range between a configuration and a value that is not reached."""
        assert inside is not None
        way = float(np.sign(outside - inside[self._i]))
        last = self._halved(inside, outside)
        many = [last, *self._all_at(float(inside[self._i]))[:PUSHED]]
        return self._best_end(many, way)

    def pushed_end(self, q: FloatArray, way: float) -> float:
        """The end that SQP finds from a configuration, and from others with the same value of the joint."""
        return self._best_end([q, *self._all_at(float(q[self._i]))[:PUSHED]], way)

    def _best_end(self, starts: list[FloatArray], way: float) -> float:
        """The farthest end that SQP finds from the starts without leaping over a gap."""
        i = self._i
        pushed = [(start, self._pushed(start, way)) for start in starts]
        pushed.sort(key=lambda pair: -way * float(pair[1][i]))
        q = next((end for start, end in pushed if self._joined(start, end)), starts[0])
        polished = self._newton(q)
        return float(q[i]) if polished is None else polished

    def _joined(self, start: FloatArray, end: FloatArray) -> bool:
        """Whether values between those of two configurations are reached."""
        between = np.linspace(start[self._i], end[self._i], BETWEEN + 2)[1:-1]
        if abs(end[self._i] - start[self._i]) < NARROW:
            return True
        return all(self.at(float(v), end) is not None or len(self._all_at(float(v))) > 0 for v in between)

    def _halved(self, q: FloatArray, far: float) -> FloatArray:
        """The configuration after some halvings of the way to a value that is not reached."""
        for _ in range(HALVINGS):
            middle = 0.5 * (float(q[self._i]) + far)
            there = self.at(middle, q)
            if there is None:
                far = middle
            else:
                q = there
        return q

    def _pushed(self, q: FloatArray, way: float) -> FloatArray:
        """The configuration that goes farthest that way at the goal, within limits, by SQP; or the same."""
        study, limits, i = self._study, self._study.robot.limits, self._i
        low, high = limits.q_min.copy(), limits.q_max.copy()
        low[i], high[i] = max(low[i], q[i] - FAR), min(high[i], q[i] + FAR)
        slope = -way * np.eye(len(q))[i]
        problem: Any = {
            "fun": lambda p: float(slope @ p),
            "jac": lambda p: slope,
            "bounds": list(zip(low, high, strict=True)),
            "constraints": {
                "type": "eq",
                "fun": lambda p: study.limited.values(p[None])[0][0],
                "jac": lambda p: -study.limited.values(p[None])[2][0],
            },
            "options": {"maxiter": SQP, "ftol": 1e-14},
        }
        answer = minimize(x0=q, method="SLSQP", **problem)
        better = np.clip(answer.x, low, high)
        error = np.abs(study.limited.values(better[None])[0]).max()
        return better if error < ROUGH and way * (better[i] - q[i]) >= 0.0 else q

    def _newton(self, q: FloatArray) -> float | None:
        """The extreme value of the joint: A' mu = e_i over joints off their limits, and e = 0."""
        study, i = self._study, self._i
        limits = study.robot.limits
        moving = (q > limits.q_min + AT_LIMIT) & (q < limits.q_max - AT_LIMIT)
        moving[i] = True
        q, free, m = q.copy(), np.flatnonzero(moving), study.m
        begin = float(q[i])
        unit = np.zeros(study.robot.nv)
        unit[i] = 1.0
        mu: FloatArray | None = None
        for _ in range(NEWTON):
            e, A, D, H = (value[0] for value in study.limited.values(q[None], rates=True))
            if mu is None:
                mu = np.linalg.lstsq(A[:, free].T, unit[free], rcond=None)[0]
            residual = np.concatenate([(A.T @ mu - unit)[free], e])
            if np.abs(residual).max() < 1e-11:
                inside = (q >= limits.q_min - AT_LIMIT) & (q <= limits.q_max + AT_LIMIT)
                return float(q[i]) if inside.all() and abs(q[i] - begin) < FAR else None
            K = np.zeros((len(free) + m, len(free) + m))
            K[: len(free), : len(free)] = np.einsum("r,lrk->kl", mu, H)[np.ix_(free, free)]
            K[: len(free), len(free) :] = A[:, free].T
            K[len(free) :, : len(free)] = -D[:, free]
            step = np.linalg.lstsq(K, -residual, rcond=1e-12)[0]
            q[free] += step[: len(free)]
            mu = mu + step[len(free) :]
            if not np.isfinite(q).all() or abs(q[i] - begin) > 1.0:
                return None
        return None
