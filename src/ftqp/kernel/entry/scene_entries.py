"""Distances of bodies apart from any tick, for set-up and studies."""

from collections.abc import Callable

from ftqp.kernel.jit import carray, pointer
from ftqp.kernel.layout.record import record_dtype
from ftqp.kernel.scene.clearance import measure
from ftqp.kernel.ticks.steps import FLOAT


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
