"""Unions of intervals of one joint's values, on the circle or on the line."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self, final

import numpy as np

from ftqp.core.checks import BoolArray, FloatArray

TURN = 2.0 * np.pi
"""A full turn [rad]."""

WHOLE = (-np.pi, np.pi)
"""The whole circle."""

TOUCHING = 1e-9
"""Gap between intervals that counts as none, and width that counts as that of a point [rad or m]."""


@final
@dataclass(frozen=True, slots=True)
class CircularIntervals:
    """A union of closed intervals, in order and apart from each other; made by ``of``.

    Attributes:
        intervals: (low, high) with low <= high, each low of a circle in (-pi, pi] and high up to low + 2 pi
            [rad or m]; the whole circle is (-pi, pi), the empty set is ().
        circular: Whether values count modulo one turn, as those of a joint without position limits do.
    """

    intervals: tuple[tuple[float, float], ...]
    circular: bool = True

    @classmethod
    def of(cls, pairs: Iterable[tuple[float, float]], *, circular: bool = True) -> Self:
        """The union of intervals, which may overlap and, on the circle, run over its seam.

        Args:
            pairs: (low, high) with low <= high [rad or m].
            circular: Whether values count modulo one turn.
        """
        given = [(float(low), float(high)) for low, high in pairs]
        if not circular:
            return cls(tuple(_merged(given)), False)
        if any(high - low >= TURN - TOUCHING for low, high in given):
            return cls((WHOLE,))
        placed = [(_principal(low), _principal(low) + high - low) for low, high in given]
        joined = _merged(placed)
        while len(joined) > 1 and joined[-1][1] >= joined[0][0] + TURN - TOUCHING:
            (_, end), (begin, last) = joined[0], joined[-1]
            joined = _merged([(begin, max(last, end + TURN)), *joined[1:-1]])
        if any(high - low >= TURN - TOUCHING for low, high in joined):
            return cls((WHOLE,))
        return cls(tuple(joined))

    @property
    def whole(self) -> bool:
        """Whether every value belongs to it: the whole circle, or the whole line."""
        reach = TURN - TOUCHING if self.circular else np.inf
        return any(high - low >= reach for low, high in self.intervals)

    @property
    def size(self) -> float:
        """The lengths of the intervals together [rad or m]."""
        return float(sum(high - low for low, high in self.intervals))

    @property
    def structural(self) -> bool:
        """Whether it is a few points only, as for the elbow of an arm with spherical shoulder and wrist.

        Such a joint stands still in every self-motion: after a lock anywhere else nothing keeps the goal.
        """
        return bool(self.intervals) and all(high - low <= TOUCHING for low, high in self.intervals)

    def contains(self, a: Any, tolerance: float = 0.0) -> Any:
        """Whether values belong to it: a bool, or an array of the shape of ``a``.

        Args:
            a: Values of the joint [rad or m].
            tolerance: How far outside a value may be [rad or m].
        """
        inside: BoolArray = self._margins(a) >= -tolerance
        return bool(inside) if np.ndim(a) == 0 else inside

    def margin(self, a: Any) -> Any:
        """The distance to the nearest end, positive inside and negative outside, as a float or an array.

        It is inf in the whole circle, and -inf where there are no intervals.

        Args:
            a: Values of the joint [rad or m].
        """
        margins = self._margins(a)
        return float(margins) if np.ndim(a) == 0 else margins

    def _margins(self, a: Any) -> FloatArray:
        values = np.asarray(a, dtype=np.float64)
        best = np.full(values.shape, -np.inf)
        if self.whole:
            return np.full(values.shape, np.inf)
        for low, high in self.intervals:
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            away = values - middle
            if self.circular:
                away = wrapped(away)
            best = np.maximum(best, half - np.abs(away))
        return best

    def __or__(self, other: Self) -> Self:
        """What belongs to one of both."""
        return type(self).of((*self.intervals, *other.intervals), circular=self.circular)

    def __and__(self, other: Self) -> Self:
        """What belongs to both."""
        if self.whole:
            return other
        if other.whole:
            return self
        turns = (-TURN, 0.0, TURN) if self.circular else (0.0,)
        common = [
            (max(low, begin + turn), min(high, end + turn))
            for low, high in self.intervals
            for begin, end in other.intervals
            for turn in turns
        ]
        return type(self).of([pair for pair in common if pair[0] <= pair[1]], circular=self.circular)

    def __contains__(self, a: float) -> bool:
        """``a in intervals``."""
        return bool(self.contains(float(a)))


def wrapped(difference: Any) -> Any:
    """A difference of angles modulo one turn, from -pi to pi [rad]."""
    return difference - TURN * np.round(difference / TURN)


def _principal(a: float) -> float:
    """The value in (-pi, pi] that is the same angle."""
    turned = wrapped(a)
    return float(turned + TURN if turned <= -np.pi else turned)


def _merged(pairs: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Sorted, those that touch made one."""
    result: list[tuple[float, float]] = []
    for low, high in sorted(pairs):
        if result and low <= result[-1][1] + TOUCHING:
            result[-1] = result[-1][0], max(result[-1][1], high)
        else:
            result.append((low, high))
    return result
