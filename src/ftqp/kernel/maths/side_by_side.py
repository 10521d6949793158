"""Numbers of eight neighbouring joints at once: what all joints have in common costs as much as for one.

A loop over the joints goes in blocks, ``for at in range(0, K.chain.n, WIDTH)``; arrays of the joints have
room for whole blocks, and hold zeros behind the last joint. Sums, comparisons and the functions of
``ftqp.kernel.maths.elementary`` take such numbers as they take one. In plain Python they are numpy arrays.
"""

from typing import Any

import numpy as np

from ftqp.kernel.jit import COMPILED, jit
from ftqp.kernel.maths.elementary import any_of

WIDTH = 8
"""Joints in a block."""


def _several(array: Any, at: int) -> Any:
    """Eight numbers of a one-dimensional array of float64, from ``at`` on."""
    return array[at : at + WIDTH].copy()


def _put(array: Any, at: int, lanes: Any) -> None:
    """Write eight numbers into a one-dimensional array of float64, from ``at`` on."""
    array[at : at + WIDTH] = lanes


def _is_set(array: Any, at: int) -> Any:
    """Which of eight whole numbers of a one-dimensional array are not 0."""
    return array[at : at + WIDTH] != 0


def _put_either(array: Any, at: int, condition: Any, one: int, other: int) -> None:
    """Write eight whole numbers: ``one`` where a condition holds, elsewhere ``other``."""
    array[at : at + WIDTH] = np.where(condition, one, other)


def _below(count: int, at: int) -> Any:
    """Which of the indices at .. at + 7 are below a count."""
    return np.arange(at, at + WIDTH) < count


def _numbers(at: int) -> Any:
    """The indices at .. at + 7."""
    return np.arange(float(at), at + WIDTH)


def _sum_of(lanes: Any) -> float:
    """The sum of all lanes."""
    return float(np.sum(lanes))


def _largest_of(lanes: Any) -> float:
    """The largest of all lanes."""
    return float(np.max(lanes))


if COMPILED:
    from ftqp.kernel.compiled.making.joint_lanes import (
        below,
        is_set,
        largest_of,
        numbers,
        put,
        put_either,
        several,
        sum_of,
    )
else:
    several, put, is_set, put_either = _several, _put, _is_set, _put_either
    below, numbers, sum_of, largest_of = _below, _numbers, _sum_of, _largest_of


@jit
def all_of(condition: Any) -> bool:
    """Whether a condition holds in every lane."""
    return not any_of(~condition)


__all__ = [
    "WIDTH",
    "all_of",
    "below",
    "is_set",
    "largest_of",
    "numbers",
    "put",
    "put_either",
    "several",
    "sum_of",
]
