"""Many arms through one trajectory in closed loop, shared out among threads."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.kernel.compiled.kernel import load
from ftqp.kernel.entry.session import Session
from ftqp.kernel.entry.table import ENTRIES
from ftqp.kernel.layout.other_records import ARRAYS
from ftqp.kernel.layout.record import dtype

PORTION_TICKS = 200_000
"""About so many ticks are done between two looks at whether to go on."""
POLL = 0.1
"""How often an interrupt of the user is looked for [s]. A convention: shorter than a person notices."""

Progress = Callable[[int], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Arms to be driven, and what becomes of them.

    Attributes:
        q: Start positions, then the final ones, (B, n) [rad or m].
        v: Start velocities, then the final ones, (B, n).
        targets: Packed targets, one a tick, (T, 29).
        beliefs: What is believed after each event, by ``beliefs_of``.
        events: Tick, index of what is then believed, and joint of each fault, (E, 3), by arm, then by tick.
        starts: Where the events of each arm begin, (B + 1,).
        skipped: 1 for an arm that is left as it is, else 0, (B,).
        returns: Whether the posture of each arm is its own start.
        every: After how many ticks q is kept; 0 keeps none.
        position_error: Largest position error on the way, (B,) [m].
        rotation_error: Largest rotation error on the way, (B,) [rad].
        clearance: Least distance of two bodies that are kept apart, (B,) [m]; inf without any.
        counts: Ticks that ended in each status, (B, number of statuses).
        first_bad: The first tick that did not end in OK, (B,); -1 while there is none.
        trace: The q that are kept, (B, T // every, n).
    """

    q: FloatArray
    v: FloatArray
    targets: FloatArray
    beliefs: Any
    events: IntArray
    starts: IntArray
    skipped: IntArray
    returns: bool
    every: int
    position_error: FloatArray
    rotation_error: FloatArray
    clearance: FloatArray
    counts: IntArray
    first_bad: IntArray
    trace: FloatArray

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


def drive(session: Session, batch: Batch, *, threads: int, progress: Progress | None = None) -> int:
    """Drive the arms of a batch with their own commands, each from its start and with its own faults.

    An arm whose start is not finite stays where it is, and all its ticks count as INVALID_INPUT. Ctrl-C stops
    all threads within a moment, and is raised.

    Args:
        session: What every arm begins with: robot, task, beliefs. It is only read.
        batch: The arms; it is filled in.
        threads: How many threads share the arms out, >= 1.
        progress: Called with the number of arms that are done.
    """
    load(ENTRIES["rollout"])
    arms, ticks, record = len(batch.q), len(batch.targets), batch.record()
    size = max(1, min(PORTION_TICKS // max(ticks, 1), arms // (2 * threads)))
    working = min(threads, -(-arms // size))
    portions = iter(range(0, arms, size))
    done: SimpleQueue[int | None] = SimpleQueue()

    def work() -> None:
        """Do portions until none is left; None is put when this thread has ended, well or not."""
        own, free = np.zeros(1, dtype("record")), np.zeros(1, dtype("free"))
        shop = (own, own, free, batch.q.shape[1])
        try:
            for first in portions:
                done.put(session.bind("rollout", record, *shop, first, min(first + size, arms))())
                if record["stop"][0]:
                    return
        finally:
            done.put(None)

    # A Ctrl-C in concurrent.futures.wait would leave its futures locked and the threads waiting for ever.
    pool, count = ThreadPoolExecutor(threads), 0
    try:
        threads_of_work = [pool.submit(work) for _ in range(working)]
        while working:
            try:
                driven = done.get(timeout=POLL)
            except Empty:
                continue
            if driven is None:
                working -= 1
                continue
            count += driven
            if progress is not None:
                progress(count)
        for one in threads_of_work:
            one.result()
    except BaseException:
        record["stop"] = 1
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
    return count
