"""Many writes as one: what they write belongs together, as no exception comes between two of them."""

from typing import Any

import numpy as np

from ftqp.kernel.jit import carray, jit, pointer

WORD = np.dtype(np.int64)


@jit
def write_together(table: Any) -> None:
    """Words from some places to others, (rows, 3) of addresses to and from and how many."""
    for k in range(len(table)):
        to = carray(pointer(table[k, 0]), (table[k, 2],), WORD)
        given = carray(pointer(table[k, 1]), (table[k, 2],), WORD)
        for i in range(table[k, 2]):
            to[i] = given[i]
