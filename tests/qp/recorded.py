"""A small recording that the tests of this folder share."""

from typing import Any

import numpy as np

from ftqp.qp import QPBuffers, Recorder, Recording

SIZES = {"n": 3, "m": 1, "p": 2}


def fill(buffers: QPBuffers, k: int) -> None:
    """A strictly convex QP that changes with k."""
    n = buffers.n
    buffers.H[:] = np.eye(n) + 0.1 * np.ones((n, n))
    buffers.g[:] = np.sin(np.arange(n) + k)
    buffers.A[:] = 1.0
    buffers.b[:] = 0.01 * k
    buffers.C[:] = np.arange(buffers.C.size).reshape(buffers.C.shape)
    buffers.l[:], buffers.u[:] = [-1.0, -np.inf], [1.0, 2.0]
    buffers.lb[:], buffers.ub[:] = -0.3, 0.3


def record(recorder: Recorder, count: int = 5, first: int = 0) -> Recorder:
    """``count`` QPs through a recorder."""
    buffers = QPBuffers.zeros(**SIZES)
    recorder.setup(buffers)
    for k in range(first, first + count):
        fill(buffers, k)
        recorder.solve(cold=False)
    return recorder


def small(**metadata: Any) -> Recording:
    """Five QPs of three variables, an equality and two rows."""
    return record(Recorder("active_set")).recording(dt=0.1, metadata=metadata)
