"""Quantiles of more numbers than one would keep: exact while they are few, then within 0.1 %."""

from typing import final

import numpy as np

from ftqp.core.checks import FloatArray, IntArray

EXACT = 200_000
"""So many numbers are kept, and their quantiles are exact."""
RATIO = 1.001
"""The upper end of a bin by its lower one, where numbers are only counted."""
LEAST = 1e-6
"""Numbers below, those that are not positive included, are counted in the lowest bin."""
BINS = 32_000
"""Bins, so that the highest one begins at 8e7 in the unit of the numbers."""


@final
class Quantiles:
    """Takes in numbers, and tells their quantiles; what is no number is left out.

    It is never changed in place, so that a shallow copy is one of its own.

    Attributes:
        count: How many numbers it has taken in.
    """

    __slots__ = ("_bins", "_kept", "count")

    def __init__(self) -> None:
        self.count = 0
        self._kept: FloatArray | None = np.empty(0)
        self._bins: IntArray = np.zeros(0, dtype=np.int64)

    def add(self, values: FloatArray) -> None:
        """Take in numbers, (K,)."""
        finite = values[np.isfinite(values)]
        self.count += len(finite)
        if self._kept is not None:
            self._kept = np.concatenate([self._kept, finite])
            if self.count <= EXACT:
                return
            finite, self._kept, self._bins = self._kept, None, np.zeros(BINS, dtype=np.int64)
        places = np.log(np.maximum(finite, LEAST) / LEAST) / np.log(RATIO)
        self._bins = self._bins + np.bincount(np.minimum(places.astype(np.int64), BINS - 1), minlength=BINS)

    def at(self, percent: float) -> float | None:
        """The number below which so many lie [%]; None where there is none."""
        if not self.count:
            return None
        if self._kept is not None:
            return float(np.percentile(self._kept, percent))
        place = int(np.searchsorted(np.cumsum(self._bins), percent / 100.0 * (self.count - 1), side="right"))
        return LEAST * float(RATIO ** (min(place, BINS - 1) + 0.5))


@final
class Counts:
    """Takes in whole numbers of a few values, such as iterations, and tells their median exactly."""

    __slots__ = ("_counts",)

    def __init__(self) -> None:
        self._counts: dict[float, int] = {}

    def add(self, values: FloatArray) -> None:
        """Take in numbers, (K,); what is no number is left out."""
        found, counts = np.unique(values[np.isfinite(values)], return_counts=True)
        merged = dict(self._counts)
        for value, count in zip(found.tolist(), counts.tolist(), strict=True):
            merged[value] = merged.get(value, 0) + count
        self._counts = merged

    def median(self) -> float | None:
        """The middle one, or the mean of the two in the middle; None where there is none."""
        total = sum(self._counts.values())
        if not total:
            return None
        values = np.array(sorted(self._counts))
        ends = np.cumsum([self._counts[value] for value in values.tolist()])
        middle = [
            values[int(np.searchsorted(ends, at, side="right"))] for at in ((total - 1) // 2, total // 2)
        ]
        return float(0.5 * (middle[0] + middle[1]))
