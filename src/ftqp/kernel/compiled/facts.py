"""What compiled code must know of the process it runs in: a few addresses, in a table of its own.

Machine code from a file cannot contain the address of a Python object. A library therefore has a table, which
is filled when it is loaded.
"""

import ctypes

import numpy as np

SYMBOL = "ftqp_facts"
"""The table's name in the library."""

FIRST, LAST = "ftqp_first_", "ftqp_last_"
"""Between these, with a capacity behind them, lies the code of common ticks."""

SIZE = 4
"""How many numbers the table has."""
TYPE_ERROR = 0
RUNTIME_ERROR = 1
NDARRAY = 2
"""``numpy.ndarray``, or 0 where arrays are laid out otherwise than expected."""
FLOAT64 = 3
"""The data type object of float64."""

BAD_BUFFER = -1
"""The object is no readable C-contiguous buffer of float64 in this machine's byte order."""
CALL_FAILED = -1_000
"""The Python function raised or gave no whole number; the error is forgotten."""

DATA_AT, NDIM_AT, SHAPE_AT, DTYPE_AT, FLAGS_AT = 16, 24, 32, 56, 64
"""Offsets of an array's fields [bytes]."""
CONTIGUOUS = 1
"""The flag of an array whose elements follow each other in C order."""


def facts() -> list[int]:
    """The table's numbers in this process."""
    table = [0] * SIZE
    table[TYPE_ERROR] = id(TypeError)
    table[RUNTIME_ERROR] = id(RuntimeError)
    if _arrays_are_laid_out_as_expected():
        table[NDARRAY] = id(np.ndarray)
        table[FLOAT64] = id(np.dtype(np.float64))
    return table


def fill(address: int) -> None:
    """Write the table's numbers to its address."""
    ctypes.memmove(address, (ctypes.c_int64 * SIZE)(*facts()), 8 * SIZE)


def _arrays_are_laid_out_as_expected() -> bool:
    """Whether the fields of arrays of every kind are found where ``take`` reads them."""
    if ctypes.sizeof(ctypes.c_void_p) != 8 or object.__basicsize__ != 16:
        return False
    owner = np.zeros((6, 4))
    probes = (
        np.zeros(7),
        owner,
        owner[1:3],
        owner[:, 1],
        owner.T,
        np.zeros((2, 3, 5)),
        np.zeros(5, dtype=np.float32),
        np.zeros(5, dtype=">f8"),
        np.zeros(0),
    )
    return all(_matches(probe) for probe in probes)


def _matches(array: np.ndarray) -> bool:
    """Whether reading an array's fields by address gives what the array says of itself."""
    at = id(array)

    def pointer(offset: int) -> int:
        return ctypes.c_uint64.from_address(at + offset).value

    def number(offset: int) -> int:
        return ctypes.c_int32.from_address(at + offset).value

    shape = tuple((ctypes.c_int64 * array.ndim).from_address(pointer(SHAPE_AT)))
    return (
        pointer(8) == id(np.ndarray)
        and pointer(DATA_AT) == array.ctypes.data
        and number(NDIM_AT) == array.ndim
        and shape == array.shape
        and pointer(DTYPE_AT) == id(array.dtype)
        and bool(number(FLAGS_AT) & CONTIGUOUS) == array.flags.c_contiguous
    )
