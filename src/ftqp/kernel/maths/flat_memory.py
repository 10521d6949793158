"""Matrices in flat memory."""

from typing import Any

import numpy as np

from ftqp.kernel.jit import carray, jit, pointer

FLOAT = np.dtype(np.float64)


@jit
def as_matrix(values: Any, rows: int, columns: int) -> Any:
    """A contiguous vector as a matrix, row by row; numba's own ``reshape`` would need numba at run time."""
    return carray(pointer(values.ctypes.data), (rows, columns), FLOAT)
