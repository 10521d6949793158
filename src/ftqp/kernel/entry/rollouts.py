"""Many arms through one trajectory in closed loop, shared out among threads."""

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.kernel.compiled.kernel import level, load
from ftqp.kernel.compiled.levels import WIDE
from ftqp.kernel.entry.session import Session
from ftqp.kernel.entry.table import ENTRIES
from ftqp.kernel.layout.enums import Status
from ftqp.kernel.layout.free_memory import free_dtype
from ftqp.kernel.layout.lane_rooms import LANES, lanes_memory
from ftqp.kernel.layout.record import belief_dtype, record_dtype

PORTION_TICKS = 200_000
"""About so many ticks are done between two looks at whether to go on."""
POLL = 0.1
"""How often an interrupt of the user is looked for [s]."""

Progress = Callable[[int, int], None]


@dataclass(slots=True, kw_only=True)
class Batch:
    """Arms to be driven, and what becomes of them.

    Attributes:
        q: Start positions, then the final ones, (B, n) [rad or m].
        v: Start velocities, then the final ones, (B, n).
        targets: Packed targets, one a tick, (T, 29).
        events: Tick, index of what is then believed, and joint of each fault, (E, 3), by arm, then by tick.
        starts: Where the events of each arm begin, (B + 1,).
        every: After how many ticks q is kept; 0 keeps none.
        worst: Largest position error [m] and rotation error [rad] on the way, (B, 2).
        counts: Ticks that ended in each status, (B, number of statuses).
        first_bad: The first tick that did not end in OK, (B,); -1 while there is none.
        trace: The q that are kept, (B, T // every, n).
    """

    q: FloatArray
    v: FloatArray
    targets: FloatArray
    events: IntArray
    starts: IntArray
    every: int
    worst: FloatArray
    counts: IntArray
    first_bad: IntArray
    trace: FloatArray

    @classmethod
    def of(cls, q: FloatArray, v: FloatArray, targets: FloatArray, events: IntArray, starts: IntArray,
           every: int) -> "Batch":  # fmt: skip
        """A batch that is still to be driven; q and v are its own from now on."""
        arms, n = q.shape
        kept = len(targets) // every if every else 0
        return cls(
            q=q, v=v, targets=targets, events=events, starts=starts, every=every, worst=np.zeros((arms, 2)),
            counts=np.zeros((arms, len(Status)), dtype=np.int64),
            first_bad=np.full(arms, -1, dtype=np.int64), trace=np.zeros((arms, kept, n)),
        )  # fmt: skip

    def arguments(self, beliefs: Any) -> tuple[Any, ...]:
        """What the entry points take behind the range of arms."""
        return (
            len(self.targets), self.q, self.v, self.targets, beliefs, len(beliefs), self.events, self.starts,
            self.worst, self.counts, self.first_bad, self.trace, self.every,
        )  # fmt: skip


def beliefs_of(capacity: int, rooms: list[dict[str, Any]]) -> Any:
    """What is believed after each event, in one array.

    Args:
        capacity: The class of the record.
        rooms: The rooms of limits and faults of each, by name.
    """
    beliefs = np.zeros(max(len(rooms), 1), belief_dtype(capacity))
    for k, believed in enumerate(rooms):
        for room, value in believed.items():
            beliefs[room][k] = value
    return beliefs


def lane_width() -> int:
    """How many arms go side by side on this machine."""
    return LANES[1] if level() == WIDE else LANES[0]


@final
class _Workshop:
    """Memory in which one thread drives arms."""

    def __init__(self, session: Session, width: int) -> None:
        capacity = session.capacity
        self.records = np.zeros(width + 1, record_dtype(capacity))
        self.free = np.zeros(1, free_dtype(capacity))
        self.work = np.zeros((width, 2), dtype=np.int64)
        self.memory, self.lanes = lanes_memory(capacity, width)


def drive(
    session: Session,
    batch: Batch,
    beliefs: Any,
    *,
    threads: int,
    side_by_side: bool,
    progress: Progress | None = None,
) -> None:
    """Drive the arms of a batch with their own commands, each from its start and with its own faults.

    An arm whose start is not finite stays where it is, and all its ticks count as INVALID_INPUT. Ctrl-C stops
    all threads within a moment, and is raised.

    Args:
        session: What every arm begins with: robot, task, beliefs. It is only read.
        batch: The arms; it is filled in.
        beliefs: Those that its events name, by ``beliefs_of``.
        threads: How many threads share the arms out, >= 1.
        side_by_side: Whether arms may go side by side; otherwise one after the other, whatever the planner's
            terms and with joints that swing freely.
        progress: Called with the number of arms that are done and of all.
    """
    width = lane_width() if side_by_side else 1
    name = f"rollout_{width}" if side_by_side else "rollout_any"

    def call(shop: _Workshop, first: int, last: int, stop: Any) -> int:
        own = (shop.records, shop.lanes, shop.work) if side_by_side else (shop.records, shop.free)
        done: int = session.bind(name, *own, first, last, *batch.arguments(beliefs), stop)()
        return done

    load(ENTRIES[name], session.capacity)
    _share_out(session, width, len(batch.q), len(batch.targets), call, threads, progress)


def _share_out(
    session: Session,
    width: int,
    arms: int,
    ticks: int,
    call: Callable[[_Workshop, int, int, Any], int],
    threads: int,
    progress: Progress | None,
) -> None:
    """Call for portions of the arms, in groups of ``width``, on all threads; about so many ticks each."""
    size = width * max(1, min(PORTION_TICKS // max(ticks, 1), arms // (2 * threads)) // width)
    stop = np.zeros(1, dtype=np.int64)
    shops: SimpleQueue[_Workshop] = SimpleQueue()
    for _ in range(min(threads, max(1, -(-arms // size)))):
        shops.put(_Workshop(session, width))

    def work(first: int) -> int:
        shop = shops.get()
        try:
            return call(shop, first, min(first + size, arms), stop)
        finally:
            shops.put(shop)

    pool = ThreadPoolExecutor(threads)
    try:
        waiting = {pool.submit(work, first) for first in range(0, arms, size)}
        count = 0
        while waiting:
            finished, waiting = wait(waiting, timeout=POLL, return_when=FIRST_COMPLETED)
            count += sum(one.result() for one in finished)
            if progress is not None and finished:
                progress(count, arms)
    except BaseException:
        stop[0] = 1
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
