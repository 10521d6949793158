"""Many arms through one trajectory in closed loop, shared out among threads."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray, array
from ftqp.core.errors import InputError
from ftqp.kernel.entry.compile import load
from ftqp.kernel.entry.session import Session
from ftqp.kernel.entry.table import ENTRIES
from ftqp.kernel.entry.threads import thread_count
from ftqp.kernel.layout.enums import TARGET_SIZE, JointCode, Status
from ftqp.kernel.layout.record import record

PARTS_PER_THREAD = 8
"""Portions that the arms are shared out in, for each thread."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rollout:
    """What became of B arms.

    Attributes:
        q: Final positions, (B, n) [rad or m].
        v: Final velocities, (B, n).
        worst: Largest position error [m] and rotation error [rad] on the way, (B, 2).
        counts: Ticks that ended in each status, (B, number of statuses).
    """

    q: FloatArray
    v: FloatArray
    worst: FloatArray
    counts: IntArray


def rollout(
    session: Session,
    q: Any,
    v: Any,
    targets: Any,
    events: Any = None,
    rates: Any = None,
    threads: int | None = None,
) -> Rollout:
    """Drive B arms with their own commands, each from a start and with a fault of its own.

    Args:
        session: What every arm begins with: robot, task, beliefs. It is only read.
        q: Start positions, (B, n) [rad or m].
        v: Start velocities, (B, n).
        targets: Packed targets, one a tick, (T, 29).
        events: Joint, tick and code (``JointCode``) of each arm's fault, (B, 3) whole numbers; joint -1 is
            none. None spares every arm.
        rates: Deceleration of a joint that locks, (B,) > 0 [rad/s2 or m/s2]; needed with ``events``.
        threads: How many threads share the arms out, >= 1; None is ``thread_count()``. The result is the same
            with any number.

    Raises:
        InputError: A wrong shape, a number that is not finite, or an event of no joint or kind.
    """
    n = int(session.K.chain.n)
    arms = len(q)
    q, v = array("q", q, (arms, n), "(B, n)"), array("v", v, (arms, n), "(B, n)")
    targets = array("targets", targets, (len(targets), TARGET_SIZE), "(T, 29)")
    faults = _events(events, arms, n)
    if rates is None and events is not None:
        raise InputError("events without rates; give the deceleration of each arm's locking joint, (B,)")
    slow = array("rates", np.ones(arms) if rates is None else rates, (arms,), "(B,)")
    if arms and slow.min() <= 0.0:
        raise InputError(f"the least rate is {slow.min():g}, expected more than 0")
    worst, counts = np.zeros((arms, 2)), np.zeros((arms, len(Status)), dtype=np.int64)
    threads = thread_count() if threads is None else threads
    if threads < 1:
        raise InputError(f"threads is {threads}, expected a whole number from 1")
    load(ENTRIES["rollout"], session.capacity)
    portions = max(1, min(arms, PARTS_PER_THREAD * threads))

    def work(portion: int) -> None:
        first, last = portion * arms // portions, (portion + 1) * arms // portions
        own = record(session.capacity)
        given = (q, v, targets, faults, slow, worst, counts)
        session.bind("rollout", own, first, last, len(targets), *given)()

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, range(portions)))
    return Rollout(q=q, v=v, worst=worst, counts=counts)


def _events(events: Any, arms: int, joints: int) -> IntArray:
    """The events as the kernel reads them, every joint and code checked."""
    if events is None:
        return np.full((arms, 3), -1, dtype=np.int64)
    given = np.asarray(events)
    if given.shape != (arms, 3) or not np.issubdtype(given.dtype, np.integer):
        raise InputError(
            f"events have shape {given.shape} of {given.dtype}, expected (B, 3) = ({arms}, 3) whole numbers"
        )
    faults = np.ascontiguousarray(given, dtype=np.int64)
    for joint, _, code in faults[faults[:, 0] != -1]:
        if not 0 <= joint < joints:
            raise InputError(f"an event names joint {joint}, expected 0 to {joints - 1}, or -1 for none")
        if code not in list(JointCode):
            raise InputError(f"an event has code {code}, expected one of JointCode")
    return faults
