"""A batch of arms: common ticks as array code in stretches, all others in the arm's own record."""

import logging
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from ftqp.control.batch.jax.array_facts import Arm, Kind, Limits, State
from ftqp.control.batch.jax.array_tick import Ahead, ticks
from ftqp.control.batch.jax.targets_ahead import TargetsAhead
from ftqp.core.checks import IntArray
from ftqp.kernel.entry.rollouts import Batch, drive_on, seats_of
from ftqp.kernel.entry.session import Session
from ftqp.kernel.layout.enums import OK, RELAXED
from ftqp.qp.dtrnn.jax.arrays import device_kind, double, jnp

_LOG = logging.getLogger("ftqp")
CHUNK: Final = 64
"""An arm that needs another tick than a common one comes back after at most so many ticks."""
MOST: Final = {"cpu": 256, "gpu": 65536}
"""So many arms go side by side: what a CPU's cache, or a GPU's memory, holds well."""
LEAST: Final = 64
"""So many places there are at least; numbers between are powers of four, so that few shapes are compiled."""


def drive_arrays(
    session: Session,
    batch: Batch,
    beliefs: Any,
    *,
    threads: int,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Drive the arms of a batch as ``ftqp.kernel.entry.rollouts.drive`` does.

    An arm does its first tick in its own record, and so it does from a tick that is no common one until the
    next stretch of ``CHUNK`` ticks begins. Ctrl-C is heard between two stretches. The logger ``ftqp`` says,
    at the level of debugging, how many ticks were array code.

    Args:
        session: What every arm begins with. It is only read.
        batch: The arms; it is filled in.
        beliefs: Those that its events name.
        threads: How many threads share out the ticks that are not array code, >= 1.
        progress: Called with the number of arms that are done and of all.
    """
    K, (arms, _) = session.K, batch.q.shape
    total, seats = len(batch.targets), seats_of(session, arms)
    done = 0

    def say(*_: int) -> None:
        if progress is not None:
            progress(int((seats["tick"] == total).sum()), arms)

    def alone(who: IntArray) -> None:
        drive_on(session, batch, beliefs, who, seats, CHUNK, threads=threads, progress=say)

    alone(np.arange(arms))
    with double():
        stretches = None
        for first in range(1, total, CHUNK):
            after = min(first + CHUNK, total)
            inside = np.flatnonzero(seats["tick"] == first)
            if len(inside):
                stretches = stretches or _Stretches(K, batch, seats)
                done += stretches.advance(inside, first, after)
                left = inside[seats["tick"][inside] < after]
                seats["anchor"][left] = stretches.targets.anchors[seats["tick"][left]]
                alone(left)
                say()
    _LOG.debug("%d of %d ticks were array code", done, arms * total)


class _Stretches:
    """What advances the arms that are inside, in groups of one size."""

    def __init__(self, K: Any, batch: Batch, seats: Any) -> None:
        arms, self._n = batch.q.shape
        self._batch, self._seats = batch, seats
        self._kind, self._arm = Kind.of(K, batch.every > 0), Arm.of(K)
        self.targets = TargetsAhead.of(K, batch.targets)
        size, most = LEAST, MOST.get(device_kind(), MOST["gpu"])
        while size < min(arms, most):
            size *= 4
        self._size = size

    def advance(self, who: IntArray, first: int, after: int) -> int:
        """Advance arms from tick ``first`` to ``after`` or to the first that is no common one; ticks done."""
        steps = np.minimum(np.arange(first, first + CHUNK), len(self.targets.packed) - 1)
        ahead = Ahead(
            jnp.arange(first, first + CHUNK), *(jnp.asarray(part[steps]) for part in self.targets[:3])
        )
        return sum(
            self._advance(who[k : k + self._size], ahead, first, after)
            for k in range(0, len(who), self._size)
        )

    def _advance(self, who: IntArray, ahead: Ahead, first: int, after: int) -> int:
        """The same for no more arms than there are places."""
        count, batch, seats = len(who), self._batch, self._seats
        places = np.resize(who, self._size)  # who fills them up is not inside

        def seen(name: str) -> Any:
            value = seats[name][places]
            return jnp.asarray(value[:, : self._n] if value.ndim > 1 else value)

        limits = Limits(
            **{name: seen(name) for name in Limits._fields if name != "guard"}, guard=seen("guard")[:, None]
        )
        kept = ("q", "v", "a_last", "lock_velocity", "stood", "last_position_error", "last_rotation_error")
        zero, none = jnp.zeros(self._size), jnp.zeros(self._size, dtype=int)
        state = State(
            **{name: seen(name) for name in kept}, worst_position=zero, worst_rotation=zero,
            done=none, relaxed=none, first_bad=none - 1, tick=none + first,
            inside=jnp.arange(self._size) < count,
        )  # fmt: skip
        end, way = ticks(self._arm, limits, state, ahead, after, self._kind)
        found = {name: np.asarray(part)[:count] for name, part in end._asdict().items()}
        for name in (*kept, "tick"):
            value = found[name]
            if value.ndim > 1:
                seats[name][who, : self._n] = value
            else:
                seats[name][who] = value
        batch.q[who], batch.v[who] = found["q"], found["v"]
        for column, name in enumerate(("worst_position", "worst_rotation")):
            batch.worst[who, column] = np.maximum(batch.worst[who, column], found[name])
        batch.counts[who, OK] += found["done"] - found["relaxed"]
        batch.counts[who, RELAXED] += found["relaxed"]
        earlier = batch.first_bad[who]  # than any of this stretch
        batch.first_bad[who] = np.where(earlier >= 0, earlier, found["first_bad"])
        self._keep(who, np.asarray(way), first, found["tick"])
        return int(found["done"].sum())

    def _keep(self, who: IntArray, way: Any, first: int, tick: IntArray) -> None:
        """Write the q that are kept of the ticks that were done."""
        batch = self._batch
        for k in range(CHUNK):
            place, rest = divmod(first + k + 1, batch.every or 1)
            if batch.every and not rest and place <= batch.trace.shape[1]:
                some = first + k < tick
                batch.trace[who[some], place - 1] = way[k, : len(who)][some]
