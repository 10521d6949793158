"""The record of a batch: how many arms and ticks there are, and where the arrays of all arms lie."""

from functools import cache
from typing import Any

import numpy as np

NUMBERS = ("arms", "ticks", "every", "believed", "returns", "stop")
ARRAYS = (
    "q", "v", "targets", "beliefs", "events", "starts", "skipped",
    "position_error", "rotation_error", "clearance", "counts", "first_bad", "trace",
)  # fmt: skip


@cache
def batch_dtype() -> np.dtype[Any]:
    """The type of the record, whole numbers and addresses of arrays, ``q_at`` and so on.

    ``every``: after how many ticks q is kept, 0 keeps none; ``believed``: how many ``beliefs`` there are;
    ``returns``: whether the posture of each arm is its own start; ``stop``: whether all are to end now. The
    arrays are those of ``ftqp.kernel.entry.rollouts.Batch``.
    """
    return np.dtype([(name, "i8") for name in (*NUMBERS, *(f"{name}_at" for name in ARRAYS))])
