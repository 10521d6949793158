"""Many arms through one trajectory in closed loop, shared out among threads."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.kernel.compiled.library import load
from ftqp.kernel.entry.planner_commands import PlannerCommands, ReserveSamples
from ftqp.kernel.entry.session import Session, share_out
from ftqp.kernel.entry.table import ENTRIES
from ftqp.kernel.layout.enums import Status
from ftqp.kernel.layout.other_records import ARRAYS
from ftqp.kernel.layout.record import dtype, in_line, used_words, zeros_in_line

PORTION_TICKS = 200_000
"""About so many ticks are done between two looks at whether to go on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Arms to be driven, and what becomes of them."""

    q: FloatArray  # Start positions, then the final ones, (B, n) [rad or m]
    v: FloatArray  # Start velocities, then the final ones, (B, n)
    targets: FloatArray  # Packed targets, one a tick, (T, 29)
    faults: Any  # Records of kind ``fault``, one at least
    # Tick, index of the fault, and 1 where it may leave a joint too weak, (E, 3), by arm, then by tick
    events: IntArray
    starts: IntArray  # Where the events of each arm begin, (B + 1,)
    every: int  # After how many ticks q is kept; 0 keeps none
    position_error: FloatArray  # Largest position error on the way, (B,) [m]
    rotation_error: FloatArray  # Largest rotation error on the way, (B,) [rad]
    clearance: FloatArray  # Least distance of two bodies that are kept apart, (B,) [m]; inf without any
    counts: IntArray  # Ticks that ended in each status, (B, number of statuses)
    first_bad: IntArray  # The first tick that did not end in OK, (B,); -1 while there is none
    trace: FloatArray  # The q that are kept, (B, T // every, n)

    @classmethod
    def begun(cls, q: FloatArray, v: FloatArray, targets: FloatArray, every: int, **faults: Any) -> "Batch":
        """Arms that nothing has become of yet, from copies of their starts, with ``faults`` to ``starts``."""
        arms, n = q.shape
        return cls(
            q=q.copy(), v=v.copy(), targets=targets, every=every, **faults,
            position_error=np.zeros(arms), rotation_error=np.zeros(arms), clearance=np.full(arms, np.inf),
            counts=np.zeros((arms, len(Status)), dtype=np.int64), first_bad=np.full(arms, -1, dtype=np.int64),
            trace=np.zeros((arms, len(targets) // every if every else 0, n)),
        )  # fmt: skip

    def record(self) -> Any:
        """The record that the entry point takes, (1,); it holds as long as the arrays live."""
        record = np.zeros(1, dtype("batch"))
        record["arms"], record["ticks"], record["every"] = len(self.q), len(self.targets), self.every
        record["kinds"] = len(self.faults)
        for name in ARRAYS:
            record[f"{name}_at"] = getattr(self, name).ctypes.data
        return record


def drive_some(
    session: Session, commands: PlannerCommands, samples: ReserveSamples | None, batch: Any, first: int,
    last: int,
) -> int:  # fmt: skip
    """Drive arms ``first`` to ``last - 1`` of a batch, begun as the session: how many ended."""
    arm = in_line(commands.arm)
    own, mine, free = (
        zeros_in_line(dtype("record")),
        np.zeros(1, dtype("given")),
        zeros_in_line(dtype("free")),
    )
    rows, out = np.zeros(1) if samples is None else samples.rows, np.zeros(1, dtype("reserve"))
    used, count = used_words(int(arm["chain"]["n"][0])), 0 if samples is None else len(samples.rows)
    return session.bind(
        "rollout", used, len(used), commands.memory, batch, arm, rows, count, out, own, own, mine, mine, free,
        free, first, last,
    )()  # fmt: skip


def drive(
    session: Session, commands: PlannerCommands, samples: ReserveSamples | None, batch: Batch, *,
    threads: int, progress: Callable[[int], None] | None = None,
) -> int:  # fmt: skip
    """Drive the arms of a batch, which is filled in, each with its own faults: how many; Ctrl-C is raised."""
    load(ENTRIES["rollout"])
    arms, ticks, record = len(batch.q), len(batch.targets), batch.record()
    work = partial(drive_some, session, commands, samples, record)
    size = max(1, min(PORTION_TICKS // max(ticks, 1), arms // (2 * threads)))
    return share_out(work, arms, threads, size=size, progress=progress, stop=lambda: record["stop"].fill(1))
