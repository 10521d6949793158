"""Whether a blocked path can be followed in fewer rows of its task, by a search."""

from collections.abc import Generator
from typing import Final

from ftqp.control.following.ahead import Ahead
from ftqp.control.paths.path import Path
from ftqp.control.planner.planner import Planner
from ftqp.faults.kinds import FreeSwinging

FARTHER: Final = 0.02
"""Fewer rows are worth it where the path goes on for this share of its rest with them, by convention."""
PIECE: Final = 1e-3
"""One piece of thinking for so much time between two ticks [s]."""


def fewer_rows_hold(
    planner: Planner, path: Path, progress: float, given_up: int
) -> Generator[None, None, int]:
    """How many further sets of rows are to be given up so that a path goes on; 0 where that does not help.

    It yields after each piece of thinking. The rest of the path is followed in thought in the rows of each
    set, within limits.

    Args:
        planner: The planner that is led.
        path: Its path.
        progress: The path time at which it is blocked [s].
        given_up: How many sets have been given up already.

    Source: docs/theory/ways-out.md, "Fewer rows".
    """
    if any(isinstance(fault, FreeSwinging) for fault in planner.faults.values()):
        return 0
    for count, rows in enumerate(planner.task.kept_sets[given_up + 1 :], 1):
        ahead = Ahead(planner, path, progress)
        search = ahead.begin(rows)
        yield
        if search is None:
            return 0
        share = 0.0
        for _, time, there in ahead.near(planner.view().command.q):
            yield
            if not there:
                break
            share = (time - progress) / (path.duration - progress)
        if share > FARTHER:
            return count
    return 0
