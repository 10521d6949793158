"""A process that makes a planner and steps it, with machine code from a folder that may be damaged.

``python kernel_ride.py GOOD [AHEAD]``: what would be compiled is taken from the folder GOOD in its place,
which takes a minute less; AHEAD is the folder of a wheel's library. The commands' digest is printed.
"""

import hashlib
import json
import logging
import sys
from pathlib import Path
from typing import Any

import ftqp
from ftqp.kernel.compiled import kernel
from ftqp.kernel.compiled.machine_code import linked_function
from ftqp.kernel.compiled.stored import unpacked

TICKS = 100


class Kept(logging.Handler):
    """Keeps what ftqp logs."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep it."""
        self.said.append(record.getMessage())


def commands() -> str:
    """The digest of all commands of a ride round a circle."""
    panda, dt = ftqp.robots.load("panda"), 1e-3
    planner = ftqp.Planner(panda, dt)
    q, T = panda.neutral.copy(), panda.pose(panda.neutral)
    target, digest = ftqp.Target(pose=T), hashlib.sha256()
    planner.reset(q)
    for k in range(TICKS):
        target.position[0] = T[0, 3] + 1e-4 * k
        if k == TICKS // 2:
            planner.report(ftqp.Locked(2))
        step = planner.step(q, None, target)
        q = step.reference.q.copy()
        for part in (step.q, step.v, step.a):
            digest.update(part.tobytes())
    return digest.hexdigest()


def main() -> None:
    """Rides, and says how it went."""
    good = Path(sys.argv[1])
    kept, instead = Kept(), []
    logging.getLogger("ftqp").addHandler(kept)

    def from_copy(self: Any, entry: Any, capacity: int) -> Any:
        instead.append(entry.name)
        content = (good / f"{entry.name}-{capacity}.kernel").read_bytes()
        return linked_function(unpacked(content, self._facts(entry, capacity)), entry.symbol(capacity))

    kernel.Kernel._compiled = from_copy
    kernel._KERNEL._ahead = Path(sys.argv[2]) if len(sys.argv) > 2 else None
    digest = commands()
    said = {"digest": digest, "instead": instead, "library": kernel._KERNEL._library is not None,
            "ready": [f"{entry.name}-{capacity}" for entry, capacity in kernel._KERNEL._ready],
            "said": kept.said}  # fmt: skip
    sys.stdout.write(json.dumps(said) + "\n")


if __name__ == "__main__":
    main()
