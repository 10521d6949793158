"""A process that makes a planner and steps it, with the library of a folder that may be damaged.

``python kernel_ride.py BUILT`` prints its commands, whether the library was used, and what ftqp logged.
"""

import json
import logging
import sys
from pathlib import Path

import ftqp
from ftqp.kernel.compiled import kernel, mode

TICKS = 6
"""So few because plain Python may have to do them."""


class Kept(logging.Handler):
    """Keeps what ftqp logs."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep it."""
        self.said.append(record.getMessage())


def commands() -> list[float]:
    """All commands of a ride round a part of a circle."""
    panda, dt = ftqp.robots.load("panda"), 1e-3
    planner = ftqp.Planner(panda, dt)
    q, T = panda.neutral.copy(), panda.pose(panda.neutral)
    target, found = ftqp.Target(pose=T), []
    planner.reset(q)
    for k in range(TICKS):
        target.position[0] = T[0, 3] + 1e-4 * k
        if k == TICKS // 2:
            planner.report(ftqp.Locked(2))
        step = planner.step(q, None, target)
        q = step.reference.q.copy()
        for part in (step.q, step.v, step.a):
            found += part.tolist()
    return found


def main() -> None:
    """Rides, and says how it went."""
    kept = Kept()
    logging.getLogger("ftqp").addHandler(kept)
    kernel._KERNEL = kernel.Kernel(mode.KERNEL, Path(sys.argv[1]))
    found = commands()
    said = {"commands": found, "library": bool(kernel.level()), "said": kept.said}
    sys.stdout.write(json.dumps(said) + "\n")


if __name__ == "__main__":
    main()
