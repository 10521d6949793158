"""Where an arm starts when nobody says so: a posture that the model names, or a regular one in mid-range."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray, array
from ftqp.core.errors import InputError, unknown
from ftqp.model.audit import Finding, note
from ftqp.model.chain import Chain, configuration_of, frame_id
from ftqp.model.followers import coupled_columns, coupled_places
from ftqp.model.limits import JointLimits
from ftqp.model.posture import NEAR_SINGULAR, gravity_torques, least_singular_value, scaled_jacobian
from ftqp.model.shape import neutral_of

NAMES = ("home", "neutral", "ready", "default", "half_sitting")
"""Names under which models keep the posture to start from, the most telling first."""

GOOD = 0.15
"""A simple posture is kept when its sigma_min is at least this share of the characteristic length."""

CANDIDATES = 300
SPREAD = 0.35
"""Candidates lie within this share of the range on either side of its middle."""
FARTHEST = 2.0
"""Largest distance of a candidate from the middle [rad]."""
SLIDE = 0.5
"""Largest distance of a candidate from the middle of an endless slide [m]."""
ROUND = 0.05
"""Candidates are multiples of this [rad or m] ..."""
NARROW = 0.2
"""... but for joints with less range [rad or m], such as fingers: they keep off their limits unrounded, and
do not make a posture regular, as there is little that they can do. Rounding moves a wider one by ROUND/2 at
most, which is less than the (0.5 - SPREAD) NARROW that its candidates are away from its limits."""
WORTH = 0.85
"""A joint goes back to its simple position when that keeps this share of the merit."""
HANDICAP = 0.5
"""Merit of a posture that a motor cannot hold, or that reaches below the base, beside one that is neither."""


class Arm:
    """What the search needs of the joints on the way to one tip."""

    def __init__(
        self, model: Any, tip: str, chain: Chain, limits: JointLimits, rows: Sequence[str], length: float
    ) -> None:
        self.model, self.chain, self.limits = model, chain, limits
        self._rows, self._length = rows, length
        self._data, self._tip = model.createData(), frame_id(model, tip)
        way = chain.way(int(model.frames[self._tip].parentJoint) - 1)
        self.way = np.unique(chain.lead[way])  # who follows is where the leader puts it
        wide = self.way[(limits.q_max - limits.q_min)[self.way] >= NARROW]
        self._useful = wide if wide.size else self.way
        bounded = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
        self._bounded = self.way[bounded[self.way]]

    def regularity(self, q: FloatArray) -> float:
        """sigma_min of the task's Jacobian over the characteristic length; 0 is singular."""
        q = configuration_of(self.model, self.chain.continuous, coupled_places(self.chain, q))
        J = scaled_jacobian(self.model, self._data, self._tip, q, self._rows, self._length)
        return least_singular_value(coupled_columns(self.chain, J)[:, self._useful]) / self._length

    def merit(self, q: FloatArray) -> float:
        """The regularity, less in the outer quarters of a range, with a motor too weak, or below the base."""
        worth = self.regularity(q) * self._room(q)
        return worth if self.holds(q) and not self._is_low() else worth * HANDICAP

    def holds(self, q: FloatArray) -> bool:
        """Whether every motor can hold the arm at rest at q."""
        q = coupled_places(self.chain, q)
        configuration = configuration_of(self.model, self.chain.continuous, q)
        tau = coupled_columns(self.chain, gravity_torques(self.model, self._data, configuration))
        return bool((np.abs(tau) <= self.limits.tau_max)[self.way].all())

    def _room(self, q: FloatArray) -> float:
        low, high, bounded = self.limits.q_min, self.limits.q_max, self._bounded
        if not bounded.size:
            return 1.0
        nearest = np.minimum(q - low, high - q)[bounded] / (high - low)[bounded]
        return float(np.clip(4.0 * nearest.min(), 0.0, 1.0))

    def _is_low(self) -> bool:
        """Whether a joint behind the second, or the tip, is below the first joint."""
        pull, data = self.chain.gravity, self._data
        frame = self.model.frames[self._tip]
        end = data.oMi[frame.parentJoint] * frame.placement
        places = [data.oMi[i + 1].translation for i in self.way[2:].tolist()] + [end.translation]
        first = data.oMi[int(self.way[0]) + 1].translation
        return any(float(pull @ (place - first)) > 1e-9 for place in places)


def neutral_posture(
    arms: Sequence[Arm], wanted: Any, named: Mapping[str, Mapping[str, float]]
) -> tuple[FloatArray, list[Finding]]:
    """The neutral configuration, (nv,) [rad or m], and what there is to say about it.

    In this order: what the user gives; a posture of the model by one of ``NAMES``, unless it is singular;
    zero, or the middle of the range where zero is not well inside, if that is regular and can be held; the
    best of ``CANDIDATES`` postures round the middle, by ``Arm.merit``, with every joint back at its simple
    position that may be. The candidates are a fixed sequence: the same arm starts at the same posture. Of
    several arms on one body each is searched in turn, and joints that an arm before has placed stay.

    ``arms`` are one a tip, of one model; ``wanted`` is (nv,) positions, the name of a posture or None, and
    ``named`` has the postures of the model by name, positions by joint.
    """
    arm = arms[0]
    if isinstance(wanted, str):
        if not named:
            raise InputError(f"{arm.model.name} names no posture, got {wanted!r}; give (nv,) positions")
        if wanted not in named:
            raise unknown("posture", wanted, arm.model.name, list(named))
        q = _posture(arm, named[wanted])
        if q is None:
            raise InputError(
                f"the posture {wanted!r} does not place every joint of {arm.model.name}; give neutral=[...], "
                "(nv,) positions"
            )
        wanted = q
    if wanted is not None:
        return _inside(arm, wanted), []
    simple = neutral_of(arm.limits, None)
    lower = {name.lower(): name for name in named}
    for name in (lower[name] for name in NAMES if name in lower):
        q = _posture(arm, named[name])
        if q is None or ((q < arm.limits.q_min) | (q > arm.limits.q_max)).any():
            continue
        if all(each.regularity(q) >= NEAR_SINGULAR for each in arms):
            return q, [note(f"neutral is the posture {name!r} of the model")]
    start, free = simple, np.ones(len(simple), dtype=np.bool_)
    for each in arms:
        if each.regularity(start) < GOOD or not each.holds(start):
            start = _searched(each, start, np.flatnonzero(free[each.way]))
        free[each.way] = False
    return start, []


def _searched(arm: Arm, simple: FloatArray, free: IntArray) -> FloatArray:
    """The best of the candidates, or ``simple`` where none is better; ``free`` are places in ``arm.way``."""
    joints = arm.way[free]
    best, most = simple, arm.merit(simple)
    for positions in _candidates(arm, simple, joints):
        q = simple.copy()
        q[joints] = positions
        worth = arm.merit(q)
        if worth > most:
            best, most = q, worth
    enough = WORTH * most
    for i in joints:
        tried = best.copy()
        tried[i] = simple[i]
        if arm.merit(tried) >= enough:
            best = tried
    return best


def _candidates(arm: Arm, simple: FloatArray, joints: IntArray) -> FloatArray:
    """Positions of joints round the middle of their range, (CANDIDATES, n): a sequence that fills a box.

    Source: Roberts 2018, the additive (Kronecker) recurrence with the powers of 1/phi, phi^(n + 1) = phi + 1.
    """
    n, limits = len(joints), arm.limits
    phi = 2.0
    for _ in range(60):
        phi = (1.0 + phi) ** (1.0 / (n + 1))
    steps = phi ** -np.arange(1.0, n + 1)
    unit = (0.5 + np.arange(1, CANDIDATES + 1)[:, None] * steps) % 1.0
    bounded = np.isfinite(limits.q_min) & np.isfinite(limits.q_max)
    with np.errstate(invalid="ignore"):
        middle = np.where(bounded, 0.5 * (limits.q_min + limits.q_max), simple)
        open_side = np.minimum(middle - limits.q_min, limits.q_max - middle)
        span = SPREAD * np.where(bounded, limits.q_max - limits.q_min, 2.0 * open_side)
    span = np.minimum(span, np.where(arm.chain.prismatic & ~bounded, SLIDE, FARTHEST))
    q = middle[joints] + span[joints] * (2.0 * unit - 1.0)
    with np.errstate(invalid="ignore"):
        narrow = (limits.q_max - limits.q_min)[joints] < NARROW
    rounded = np.where(narrow, q, ROUND * np.round(q / ROUND))
    result: FloatArray = np.clip(rounded, limits.q_min[joints], limits.q_max[joints])
    return result


def _posture(arm: Arm, positions: Mapping[str, float]) -> FloatArray | None:
    """A named posture as (nv,) positions; None where it leaves a joint out."""
    if not set(arm.chain.names) <= set(positions):
        return None
    return np.array([positions[name] for name in arm.chain.names])


def _inside(arm: Arm, wanted: Any) -> FloatArray:
    """What the user gives, which must lie inside the limits."""
    limits = arm.limits
    start = array("neutral", wanted, (len(limits),), "(nv,)")
    outside = np.flatnonzero((start < limits.q_min) | (start > limits.q_max))
    if outside.size:
        i = int(outside[0])
        raise InputError(
            f"neutral[{i}] is {start[i]:g}, expected a position from {limits.q_min[i]:g} to "
            f"{limits.q_max[i]:g}"
        )
    return start
