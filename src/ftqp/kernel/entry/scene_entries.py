"""Distances of bodies apart from any tick, for set-up and studies."""

from collections.abc import Callable

import numpy as np

from ftqp.kernel.jit import carray, pointer
from ftqp.kernel.layout.record import record_dtype
from ftqp.kernel.scene.clearance import measure
from ftqp.kernel.ticks.steps import FLOAT

WORD = np.dtype(np.int64)


def pair_distances(capacity: int) -> Callable[..., int]:
    """The distance of every pair at each of S postures, (S, n) into (S, pairs)."""
    dtype = record_dtype(capacity)

    def pair_distances(address: int, q_at: int, out_at: int, samples: int) -> int:
        K = carray(pointer(address), 1, dtype)[0]
        q = carray(pointer(q_at), (samples, K.chain.n), FLOAT)
        out = carray(pointer(out_at), (samples, K.scene.pairs), FLOAT)
        for k in range(samples):
            measure(K, q[k], out[k])
        return 0

    return pair_distances


def write_together(_capacity: int) -> Callable[..., int]:
    """Words from some places to others, (rows, 3) of addresses to and from and how many, in one call.

    No exception comes between two of them, so that what they write belongs together at any time.
    """

    def write_together(table_at: int, rows: int) -> int:
        table = carray(pointer(table_at), (rows, 3), WORD)
        for k in range(rows):
            to = carray(pointer(table[k, 0]), (table[k, 2],), WORD)
            given = carray(pointer(table[k, 1]), (table[k, 2],), WORD)
            for i in range(table[k, 2]):
                to[i] = given[i]
        return 0

    return write_together
