"""Matrices in the memory of a vector; ``reshape`` would call numba's runtime, which kept code has not."""

from typing import Any

import numpy as np

from ftqp.kernel.jit import carray, jit, pointer

_FLOAT = np.dtype(np.float64)


@jit
def matrix_view(vector: Any, first: int, rows: int, columns: int) -> Any:
    """The numbers of a vector from ``first`` on as a matrix by rows; the caller keeps the vector alive."""
    return carray(pointer(vector.ctypes.data + 8 * first), (rows, columns), _FLOAT)
