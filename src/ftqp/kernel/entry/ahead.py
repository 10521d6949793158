"""``python -m ftqp.kernel.entry.ahead`` compiles what the demo needs, with numpy, numba and this source only.

The Makefile runs it beside the installation of everything else, so that nobody waits for it afterwards.
"""

import sys

from ftqp.kernel.entry.compile import compile_entries
from ftqp.kernel.entry.table import ANY_SIZE, COMMON, ENTRIES
from ftqp.kernel.layout.record import CAPACITIES

DEMO = COMMON[:5]
"""Entry points of a planner that is given targets, and of its simulation."""


def main(names: list[str]) -> None:
    """Compile entry points for small arms; those of the demo where none are named."""
    compile_entries([ENTRIES["write_target"]], ANY_SIZE)
    compile_entries([ENTRIES[name] for name in names or DEMO], CAPACITIES[0])


if __name__ == "__main__":
    main(sys.argv[1:])
