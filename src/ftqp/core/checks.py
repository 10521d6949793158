"""Checks of arrays and numbers at construction time, each with one clear sentence."""

from math import isfinite
from types import UnionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ftqp.core.errors import InputError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


def array(
    name: str, value: Any, shape: tuple[int, ...], symbol: str = "", *, finite: bool = True
) -> FloatArray:
    """``value`` as a fresh contiguous float64 array of ``shape``.

    Args:
        name: How the user knows the value.
        value: Anything numpy can turn into numbers.
        shape: The shape expected.
        symbol: That shape in symbols, for the message, for example ``(nv,)``.
        finite: Whether NaN and infinity are refused; NaN always is.

    Raises:
        InputError: Not numbers, another shape, NaN, or infinite where it must be finite.
    """
    try:
        result = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{name} is not an array of numbers: {value!r:.80}; expected shape {shape}"
        ) from error
    if result.shape != shape:
        expected = f"{symbol} = {shape}" if symbol else f"{shape}"
        raise InputError(f"{name} has shape {result.shape}, expected {expected}")
    if np.isnan(result).any():
        raise InputError(f"{name} contains NaN at index {_first(np.isnan(result))}; expected numbers")
    if finite and not np.isfinite(result).all():
        raise InputError(
            f"{name} is infinite at index {_first(~np.isfinite(result))}; expected finite numbers"
        )
    return result


def _first(mask: BoolArray) -> str:
    return ", ".join(str(int(i)) for i in np.argwhere(mask)[0])


def frozen(value: NDArray[Any]) -> NDArray[Any]:
    """``value``, made read-only."""
    value.setflags(write=False)
    return value


def instance(name: str, value: Any, kind: type | UnionType, expected: str) -> None:
    """Refuses a ``value`` that is not of a ``kind``.

    Args:
        name: How the user knows the value.
        value: Anything.
        kind: The class expected.
        expected: What to give, in words, for the message.

    Raises:
        InputError: The value is of another kind.
    """
    if not isinstance(value, kind):
        short = isinstance(value, str | int | float | type) or value is None
        what = f"{value!r:.60}" if short else f"of type {type(value).__name__}"
        raise InputError(f"{name} is {what}, expected {expected}")


def positive(name: str, value: Any, unit: str = "") -> float:
    """``value`` as a float that is finite and greater than zero.

    Raises:
        InputError: Not a number, not finite, or not positive.
    """
    return _number(name, value, unit, least=0.0, strict=True)


def non_negative(name: str, value: Any, unit: str = "") -> float:
    """``value`` as a float that is finite and at least zero.

    Raises:
        InputError: Not a number, not finite, or negative.
    """
    return _number(name, value, unit, least=0.0, strict=False)


def _number(name: str, value: Any, unit: str, *, least: float, strict: bool) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} is {value!r}, expected a number{' in ' + unit if unit else ''}") from error
    if not isfinite(number) or number < least or (strict and number == least):
        bound = "> 0" if strict else ">= 0"
        raise InputError(
            f"{name} is {number:g}, expected a finite number {bound}{' ' + unit if unit else ''}"
        )
    return number
