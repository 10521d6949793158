"""A motion that does not come to rest: its returns to a section, its period and its errors."""

from dataclasses import dataclass
from typing import Any, final

import numpy as np
from scipy.integrate import solve_ivp

from ftqp.analysis.outcomes.unaware_law import UnawareLaw
from ftqp.core.checks import BoolArray, FloatArray

RETURNS = 400
"""To the section, at most."""
SAME = 1e-6
"""Two returns so near each other are the same [rad]."""
AROUND = 0.5
"""The section reaches so far from its point [rad]."""
LONGEST = 200.0
"""A round is not longer, in s."""
EVALUATIONS = 60_000
"""Of the motion, at most: next to singularities steps collapse."""
AWAY = 0.1
"""In s, before a return is looked for."""
TOLERANCE = 1e-10
STEP = 0.5
"""A step that is not longer, in s, passes no return unseen."""
SAMPLES = 4000
"""Of a round, for its errors."""


class _TooLong(Exception):
    """The evaluations are used up."""


@final
class _Counted:
    """dq/ds and dt/ds, counted."""

    def __init__(self, law: UnawareLaw) -> None:
        self.law, self._left = law, EVALUATIONS

    def __call__(self, s: float, y: FloatArray) -> FloatArray:
        self._left -= 1
        if self._left < 0:
            raise _TooLong
        return self.law.scaled(s, y)


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cycle:
    """A closed orbit.

    Attributes:
        q: A configuration on it, (n,) [rad].
        period: [s].
        error_range: The smallest and the largest |e| on it [m].
    """

    q: FloatArray
    period: float
    error_range: tuple[float, float]


def cycle_through(law: UnawareLaw, q: FloatArray, turning: BoolArray) -> Cycle | None:
    """The cycle that a motion from q comes to; None where returns do not settle.

    The section is the plane through q across the motion; joints that turn count modulo one turn. A cycle is
    certified where two returns in a row agree within SAME.

    Args:
        law: The law after the failure.
        q: A configuration that has gone on for long, (n,) [rad].
        turning: Joints that turn without end, (n,).
    """
    try:
        return _settled(law, q, turning)
    except _TooLong:
        return None


def _settled(law: UnawareLaw, q: FloatArray, turning: BoolArray) -> Cycle | None:
    """The cycle, or None; _TooLong where it takes too many evaluations."""
    n, motion = len(q), _Counted(law)
    across = law.scaled(0.0, np.append(q, 0.0))[:n]
    size = float(np.linalg.norm(across))
    if size == 0.0:
        return None
    across /= size

    def ahead(s: float, y: FloatArray) -> float:
        away = y[:n] - q
        return float(across @ np.where(turning, np.sin(away), away))

    ahead.terminal, ahead.direction = True, 1.0  # type: ignore[attr-defined]
    last, time = q, 0.0
    for _ in range(RETURNS):
        found = _return(motion, last, ahead, q, turning)
        if found is None:
            return None
        here, time, orbit = found
        away = here - last
        away = np.where(turning, (away + np.pi) % (2.0 * np.pi) - np.pi, away)
        if np.abs(away).max() < SAME:
            errors = [float(np.linalg.norm(law.error(y[:n]))) for y in orbit]
            return Cycle(q=here, period=time, error_range=(min(errors), max(errors)))
        last = here
    return None


def _return(
    motion: _Counted, start: FloatArray, ahead: Any, centre: FloatArray, turning: BoolArray
) -> tuple[FloatArray, float, FloatArray] | None:
    """The next return: where, after which time, and samples of the way (k, n + 1)."""
    n, y, gone = len(start), np.append(start, 0.0), []
    options: dict[str, Any] = {
        "method": "DOP853", "rtol": TOLERANCE, "atol": TOLERANCE, "dense_output": True, "max_step": STEP,
    }  # fmt: skip
    s, total = 0.0, 0.0
    while total < LONGEST:
        first = solve_ivp(motion, (0.0, AWAY), y, **options)
        rest = solve_ivp(motion, (0.0, LONGEST), first.y[:, -1], events=ahead, **options)
        for piece in (first, rest):
            dense: Any = piece.sol
            gone.append(dense(np.linspace(0.0, piece.t[-1], SAMPLES)).T)
            s += piece.t[-1]
        total, y = s, rest.y[:, -1]
        if rest.status != 1:
            return None
        away = y[:n] - centre
        away = np.where(turning, (away + np.pi) % (2.0 * np.pi) - np.pi, away)
        if np.abs(away).max() < AROUND:
            return y[:n], float(y[n]), np.concatenate(gone)
    return None
