"""Checks of arrays and numbers at construction time, each with one clear sentence."""

from dataclasses import fields
from math import isfinite
from types import UnionType
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from ftqp.core.errors import InputError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
LARGEST = 1e300
"""No number of a file is larger than this, so that sums and products of some are finite."""
FULL_TURN = 2.0 * np.pi
"""What is farther beyond a joint's range [rad] was written in degrees. A convention."""


def perhaps_degrees(away: float) -> str:
    """A question for one who puts a joint so far beyond its range [rad]; empty where that may be meant."""
    return "; are these degrees?" if away > FULL_TURN else ""


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
    """
    result = numbers(name, value, f"; expected shape {shape}")
    if result.shape != shape:
        expected = f"{shape}" if symbol in ("", f"{shape}") else f"{symbol} = {shape}"
        raise InputError(f"{name} has shape {result.shape}, expected {expected}")
    if np.isnan(result).any():
        raise InputError(f"{name} contains NaN at index {_first(np.isnan(result))}; expected numbers")
    if finite and not np.isfinite(result).all():
        raise InputError(
            f"{name} is infinite at index {_first(~np.isfinite(result))}; expected finite numbers"
        )
    return result


def numbers(name: str, value: Any, expected: str = "") -> FloatArray:
    """``value`` as a fresh float64 array of any shape; texts, complex numbers and dates are refused."""
    try:
        given = np.asarray(value)
        kind = given.dtype.kind
        if kind in "biuf" or (kind == "O" and not any(isinstance(x, str | bytes) for x in given.flat)):
            return np.array(given, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{name} is not an array of numbers: {shown(value)}{expected}") from error
    raise InputError(f"{name} is not an array of numbers: {shown(value)}{expected}")


def is_number(value: Any, most: float = LARGEST) -> TypeGuard[float]:
    """Whether a value that was read from a file is a plain number and its size is one to compute with."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= most


def shown(value: Any) -> str:
    """What a message shows of a value: its first 80 letters, in one line."""
    return " ".join(f"{value!r:.80}".split())


def _first(mask: BoolArray) -> str:
    return ", ".join(str(int(i)) for i in np.argwhere(mask)[0])


def frozen(value: NDArray[Any]) -> NDArray[Any]:
    """``value``, made read-only: a view of it, which owns no memory and so cannot be resized either."""
    value.setflags(write=False)
    return seen(value)


def seen(value: NDArray[Any]) -> NDArray[Any]:
    """A view of ``value`` that cannot be written, for those who may look at it."""
    view = value.view()
    view.setflags(write=False)
    return view


def read_only(record: Any) -> None:
    """Let the arrays of a frozen dataclass only be read: the ``__post_init__`` of what is handed out."""
    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, np.ndarray):
            object.__setattr__(record, field.name, seen(value))


def instance(name: str, value: Any, kind: type | UnionType, expected: str) -> None:
    """Refuses a ``value`` that is not of a ``kind``."""
    if not isinstance(value, kind):
        short = isinstance(value, str | int | float | type) or value is None
        what = f"{value!r:.60}" if short else f"of type {type(value).__name__}"
        raise InputError(f"{name} is {what}, expected {expected}")


def positive(name: str, value: Any, unit: str = "") -> float:
    """``value`` as a float that is finite and greater than zero."""
    return _number(name, value, unit, least=0.0, strict=True)


def non_negative(name: str, value: Any, unit: str = "") -> float:
    """``value`` as a float that is finite and at least zero."""
    return _number(name, value, unit, least=0.0, strict=False)


def whole_number(name: str, value: Any, least: int, most: int | None = None) -> None:
    """Refuses what is no whole number from a least one to a largest one."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or value < least or (most is not None and value > most):
        to = "" if most is None else f" to {most}"
        raise InputError(f"{name} is {value!r:.40}, expected a whole number from {least}{to}")


def as_number(name: str, value: Any, unit: str = "") -> float:
    """``value`` as a float, which may be infinite or NaN; a text is none, whatever digits are in it."""
    try:
        if not isinstance(value, str | bytes | bytearray) and not np.ndim(value):
            return float(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(_no_number(name, value, unit)) from error
    raise InputError(_no_number(name, value, unit))


def _no_number(name: str, value: Any, unit: str) -> str:
    return f"{name} is {shown(value)}, expected a number{' in ' + unit if unit else ''}"


def _number(name: str, value: Any, unit: str, *, least: float, strict: bool) -> float:
    number = as_number(name, value, unit)
    if not isfinite(number) or number < least or (strict and number == least):
        bound = "> 0" if strict else ">= 0"
        raise InputError(
            f"{name} is {number:g}, expected a finite number {bound}{' ' + unit if unit else ''}"
        )
    return number


_MEANS = {
    ("pose", (4, 4)): ", a homogeneous matrix; for a point alone give position=",
    ("twist", (6,)): ", vx, vy, vz [m/s] and wx, wy, wz [rad/s]",
}
"""What numbers of a target are, for whom their shape says too little."""


def sized(name: str, value: Any, shape: tuple[int, ...], symbol: str = "") -> FloatArray:
    """``value`` as a contiguous array of ``shape``; NaN and infinities pass."""
    result = numbers(name, value)
    if result.shape != shape:
        expected = f"{shape}" if symbol in ("", f"{shape}") else f"{symbol} = {shape}"
        means = _MEANS.get((name, shape), "")
        raise InputError(f"{name} has shape {result.shape}, expected {expected}{means}")
    return result
