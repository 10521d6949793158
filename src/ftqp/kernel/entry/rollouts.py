"""Many arms through one trajectory in closed loop, shared out among threads."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.kernel.compiled.library import load
from ftqp.kernel.entry.session import Session, share_out
from ftqp.kernel.entry.table import ENTRIES
from ftqp.kernel.layout.other_records import ARRAYS
from ftqp.kernel.layout.record import dtype, used_words

PORTION_TICKS = 200_000
"""About so many ticks are done between two looks at whether to go on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Arms to be driven, and what becomes of them."""

    q: FloatArray  # Start positions, then the final ones, (B, n) [rad or m]
    v: FloatArray  # Start velocities, then the final ones, (B, n)
    targets: FloatArray  # Packed targets, one a tick, (T, 29)
    beliefs: Any  # What is believed after each event, by ``beliefs_of``
    events: IntArray  # Tick, index of what is then believed, and joint, (E, 3), by arm, then by tick
    starts: IntArray  # Where the events of each arm begin, (B + 1,)
    skipped: IntArray  # 1 for an arm that is left as it is, else 0, (B,)
    returns: bool  # Whether the posture of each arm is its own start
    every: int  # After how many ticks q is kept; 0 keeps none
    position_error: FloatArray  # Largest position error on the way, (B,) [m]
    rotation_error: FloatArray  # Largest rotation error on the way, (B,) [rad]
    clearance: FloatArray  # Least distance of two bodies that are kept apart, (B,) [m]; inf without any
    counts: IntArray  # Ticks that ended in each status, (B, number of statuses)
    first_bad: IntArray  # The first tick that did not end in OK, (B,); -1 while there is none
    trace: FloatArray  # The q that are kept, (B, T // every, n)

    def record(self) -> Any:
        """The record that the entry point takes, (1,); it holds as long as the arrays live."""
        record = np.zeros(1, dtype("batch"))
        record["arms"], record["ticks"], record["every"] = len(self.q), len(self.targets), self.every
        record["believed"], record["returns"] = len(self.beliefs), self.returns
        for name in ARRAYS:
            record[f"{name}_at"] = getattr(self, name).ctypes.data
        return record


def beliefs_of(rooms: list[dict[str, Any]]) -> Any:
    """What is believed after each event, in one array."""
    beliefs = np.zeros(max(len(rooms), 1), dtype("belief"))
    for k, believed in enumerate(rooms):
        for room, value in believed.items():
            beliefs[room][k] = value
    return beliefs


def drive(
    session: Session, batch: Batch, *, threads: int, progress: Callable[[int], None] | None = None
) -> int:
    """Drive the arms of a batch, which is filled in, each from its start and with its own faults: how many.

    All begin with the session. An arm whose start is not finite stays where it is, and all its ticks count as
    INVALID_INPUT. Ctrl-C stops all threads within a moment, and is raised.
    """
    load(ENTRIES["rollout"])
    (arms, n), ticks, record = batch.q.shape, len(batch.targets), batch.record()
    used = used_words(n)

    def work(first: int, last: int) -> int:
        own, free = np.zeros(1, dtype("record")), np.zeros(1, dtype("free"))
        return session.bind("rollout", used, len(used), record, own, own, free, n, first, last)()

    size = max(1, min(PORTION_TICKS // max(ticks, 1), arms // (2 * threads)))
    return share_out(work, arms, threads, size=size, progress=progress, stop=lambda: record["stop"].fill(1))
