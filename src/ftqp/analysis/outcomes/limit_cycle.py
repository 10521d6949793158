"""A motion that does not come to rest: its returns to a section, its period and its errors."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, final

import numpy as np
from scipy.optimize import brentq

from ftqp.analysis.outcomes.unaware_law import UnawareLaw
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.kernel.entry.law_study import LawStudy

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
