"""In which form an array reaches a step: those that hold the same numbers, and those that are mistakes."""

import array
import ctypes
import datetime
import decimal
import fractions
from collections.abc import Callable
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]
Form = Callable[[Array], Any]


class Own(np.ndarray[Any, Any]):
    """An array of a class of its own."""


class Offers:
    """Something that turns itself into an array when numpy asks."""

    def __init__(self, numbers: Array) -> None:
        self._numbers = numbers

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        return self._numbers.copy()


class Falls:
    """Something that fails when numpy asks."""

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        raise ValueError("not today")


def _aside(x: Array, gap: int) -> Array:
    room = np.full(len(x) * gap, np.nan)
    room[::gap] = x
    return room[::gap]


def _unaligned(x: Array) -> Any:
    return np.frombuffer(b"\0" + x.tobytes(), dtype=np.uint8)[1:].view(np.float64)


def _read_only(x: Array) -> Array:
    y = x.copy()
    y.setflags(write=False)
    return y


def _backwards(x: Array) -> Array:
    return x[::-1].copy()[::-1]


def _end_of_a_buffer(x: Array) -> Array:
    room = np.full(3 * len(x), np.nan)
    room[2 * len(x) :] = x
    return room[2 * len(x) :]


EXACT: dict[str, Form] = {
    "list": lambda x: x.tolist(),
    "tuple": lambda x: tuple(x.tolist()),
    "numbers of numpy": list,
    "strided": lambda x: _aside(x, 2),
    "far strided": lambda x: _aside(x, 7),
    "backwards": _backwards,
    "column": lambda x: np.array([x, x + 1.0]).T[:, 0],
    "read-only": _read_only,
    "bytes of another": lambda x: np.frombuffer(x.tobytes()),
    "unaligned": _unaligned,
    "end of a buffer": _end_of_a_buffer,
    "byte-swapped": lambda x: x.astype(x.dtype.newbyteorder()),
    "objects": lambda x: x.astype(object),
    "long double": lambda x: x.astype(np.longdouble),
    "own class": lambda x: x.view(Own),
    "masked": lambda x: np.ma.masked_array(x),
    "offers": Offers,
    "memoryview": lambda x: memoryview(x.copy()),
    "array.array": lambda x: array.array("d", x.tolist()),
    "ctypes": lambda x: (ctypes.c_double * len(x))(*x.tolist()),
    "writable bytes": lambda x: np.frombuffer(bytearray(x.tobytes())),
}
"""The same numbers in another form: the command must be the same, bit by bit."""

LOSSY: dict[str, Form] = {
    "float32": lambda x: x.astype(np.float32),
    "float16": lambda x: x.astype(np.float16),
    "whole": lambda x: np.nan_to_num(x, posinf=0.0, neginf=0.0).clip(-1e9, 1e9).astype(np.int64),
    "small whole": lambda x: np.nan_to_num(x, posinf=0.0, neginf=0.0).clip(-100, 100).astype(np.int8),
    "boolean": lambda x: x > 0.0,
    "nothing": lambda x: [None] * len(x),
    "one is nothing": lambda x: [*x.tolist()[:-1], None],
}
"""Numbers of fewer digits, which count as what they are, and missing ones, which count as NaN."""

MISTAKES: dict[str, Form] = {
    "one too few": lambda x: x[:-1].copy(),
    "one too many": lambda x: np.append(x, 0.0),
    "far too many": lambda x: np.zeros(100_000),
    "empty": lambda x: np.zeros(0),
    "empty list": lambda x: [],
    "row": lambda x: x[None, :].copy(),
    "column matrix": lambda x: x[:, None].copy(),
    "matrix": lambda x: np.asmatrix(x),
    "cube": lambda x: x.reshape(1, 1, -1).copy(),
    "number": lambda x: float(x[0]),
    "number of numpy": lambda x: x[0],
    "array of no dimension": lambda x: np.array(0.5),
    "words": lambda x: "home",
    "numbers as words": lambda x: [str(value) for value in x],
    "array of words": lambda x: np.array([str(value) for value in x]),
    "underscores": lambda x: ["1_000"] * len(x),
    "wide digits": lambda x: ["\uff11\uff0e\uff10"] * len(x),
    "bytes": lambda x: x.tobytes(),
    "bytes of words": lambda x: np.array([b"1.0"] * len(x)),
    "dictionary": lambda x: dict(enumerate(x.tolist())),
    "set": lambda x: {0.0, 1.0},
    "generator": lambda x: (value for value in x),
    "iterator": lambda x: iter(x.tolist()),
    "complex": lambda x: x.astype(np.complex128),
    "complex objects": lambda x: np.array([1j] * len(x), dtype=object),
    "dates": lambda x: np.zeros(len(x), dtype="datetime64[s]"),
    "spans": lambda x: np.zeros(len(x), dtype="timedelta64[s]"),
    "date objects": lambda x: [datetime.datetime(2026, 1, 1)] * len(x),
    "ragged": lambda x: [[0.0], [0.0, 1.0]],
    "record": lambda x: np.zeros(len(x), dtype=[("x", np.float64)]),
    "void": lambda x: np.zeros(len(x), dtype="V8"),
    "too large a number": lambda x: [10**400] * len(x),
    "too large an object": lambda x: np.array([10**400] * len(x), dtype=object),
    "falls": lambda x: Falls(),
    "a class": lambda x: float,
    "a function": lambda x: np.sin,
    "the array class": lambda x: np.ndarray,
    "an ellipsis": lambda x: ...,
}
"""Mistakes of a programmer: InputError that names the argument, and nothing has changed."""

NUMBERS_OF_OTHERS: dict[str, Form] = {
    "decimals": lambda x: [decimal.Decimal(repr(value)) for value in x.tolist()],
    "fractions": lambda x: [
        fractions.Fraction(value) if np.isfinite(value) else value for value in x.tolist()
    ],
}
"""Exact numbers of other libraries."""
EXACT |= NUMBERS_OF_OTHERS
