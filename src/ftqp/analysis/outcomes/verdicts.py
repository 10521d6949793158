"""Where a motion after a failure ends: the goal, another rest, or a singularity ahead of it."""

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from ftqp.analysis.outcomes.unaware_law import UnawareLaw
from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.endings import Ending

NEAR = 5e-2
"""From this |e| on the goal is looked for [unit lengths]."""
REACH = 5e-2
"""A rest that is further away is not taken for the end [rad]."""
SEARCHES = 25
"""Newton steps at most."""
STILL = 1e-12
"""A Newton step this short has converged [rad]."""
RESTING = 1e-7
"""The motion of a rest with gain 1 that is left by rounding where J is singular [rad/s]."""
SLOW = 3e-2
"""Below this |dq/ds| rest is looked for."""
NEUTRAL = 1e-7
"""An eigenvalue with a real part this small may belong to a curve of rest configurations [1/s]."""
ALONG = 1e-3
"""So far along such a curve it is looked whether there is rest, too [rad]."""
CLOSE = 1e-6
"""One of a continuum of rests is the end of a motion that is so near it [rad]."""
ROUNDING = 1e-5
"""Least over largest singular value below which slopes are lost in rounding."""
TRULY_FLAT = 1e-6
"""Least over largest singular value of a configuration that takes a motion in."""
FLAT = 1e-3
"""Least over largest singular value from which a singularity ahead is looked for."""


@final
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rest:
    """The end of a motion.

    Attributes:
        ending: CORRECT, ERRONEOUS or SINGULAR.
        q: Where, (n,) [rad or m].
        rate: With which the distance to it falls at last, with gain 1 [1/s]; 0 on a curve of rests.
        curve: Whether it is one of a curve of rest configurations.
    """

    ending: Ending
    q: FloatArray
    rate: float
    curve: bool = False


def goal_ahead(law: UnawareLaw, q: FloatArray, unit: float) -> Rest | None:
    """The goal, where Newton steps of the joints that move find it within REACH and it is stable."""
    here = q.copy()
    for _ in range(SEARCHES):
        step = law.newton_step(here)
        here += step
        if not np.linalg.norm(here - q) < REACH:
            return None
        if np.linalg.norm(step) < STILL:
            break
    if not np.linalg.norm(law.error(here)) < 1e-9 * unit or law.flatness(here) < 1e-9:
        return None
    if law.free.sum() > len(law.error(here)) and np.linalg.norm(here - q) > CLOSE:
        return None  # which of many it will be is not known yet
    least = float(law.contraction(here).real.min())
    return Rest(ending=Ending.CORRECT, q=here, rate=least) if least > 0.0 else None


def rest_ahead(law: UnawareLaw, q: FloatArray, unit: float) -> Rest | None:
    """A rest within REACH that attracts, by all eigenvalues of the slopes of the joints that move."""
    here = q.copy()
    moving = np.flatnonzero(law.free)
    for _ in range(SEARCHES):
        v, _ = law.rates(here)
        if np.linalg.norm(v) < (STILL if law.flatness(here) > FLAT else RESTING):
            break
        slope = law.slopes(0.0, here)[np.ix_(moving, moving)]
        step = np.linalg.lstsq(slope, -v[moving], rcond=1e-9)[0]
        here[moving] += step
        if not np.linalg.norm(here - q) < REACH:
            return None
        if np.linalg.norm(step) < STILL:
            break
    v, size = law.rates(here)
    if not np.linalg.norm(v) < RESTING:
        return None
    slope = law.slopes(0.0, here)[np.ix_(moving, moving)]
    values, vectors = np.linalg.eig(slope)
    if size < 1e-6 * unit:
        return None  # the goal has a test of its own
    if values.real.max() < -NEUTRAL:
        return Rest(ending=Ending.ERRONEOUS, q=here, rate=_rate_at(law, here, q, values))
    if values.real.max() > NEUTRAL or np.linalg.norm(here - q) > CLOSE:
        return None
    for k in np.flatnonzero(values.real > -NEUTRAL):
        for side in (ALONG, -ALONG):
            beside = here.copy()
            beside[moving] += side * vectors[:, k].real
            if np.linalg.norm(law.rates(beside)[0]) > 50.0 * ALONG**2:
                return None
    return Rest(ending=Ending.ERRONEOUS, q=here, rate=0.0, curve=True)


def _rate_at(law: UnawareLaw, rest: FloatArray, q: FloatArray, values: NDArray[np.complex128]) -> float:
    """The rate of a rest, of its eigenvalues; of one at a singular J from a little before it."""
    if law.flatness(rest) > ROUNDING:
        return float(-values.real.max())
    away = q - rest
    before = rest + ALONG * away / max(float(np.linalg.norm(away)), 1e-300)
    moving = np.flatnonzero(law.free)
    return float(-np.linalg.eigvals(law.slopes(0.0, before)[np.ix_(moving, moving)]).real.max())


def singularity_ahead(law: UnawareLaw, q: FloatArray) -> Rest | None:
    """A singular configuration that takes the motion in: behind it the field points back."""
    if law.flatness(q) > FLAT:
        return None
    v, _ = law.rates(q)
    speed = float(np.linalg.norm(v))
    if speed < 1e-9:
        return None

    def points_back(way: float) -> bool:
        beyond = law.rates(q + way / speed * v)[0]
        return bool(beyond @ v < -0.5 * speed * float(np.linalg.norm(beyond)))

    before = 0.0
    for behind in np.geomspace(1e-9, 2.0 * REACH, 60):
        if points_back(behind):
            break
        before = behind
    else:
        return None
    for _ in range(60):
        middle = 0.5 * (before + behind)
        before, behind = (before, middle) if points_back(middle) else (middle, behind)
    there = q + behind / speed * v
    if law.flatness(there) > TRULY_FLAT:
        return None  # nearly singular: the motion turns round and creeps on
    return Rest(ending=Ending.SINGULAR, q=there, rate=np.inf)
