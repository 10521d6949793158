"""Runs after failures that nobody was told of: eight seats, which go to the next runs as they end."""

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from ftqp.kernel.jit import carray, jit, pointer
from ftqp.kernel.layout.endings import CORRECT, NONE, SINGULAR, UNRESOLVED
from ftqp.kernel.layout.planar_memory import planar_dtype
from ftqp.kernel.maths.elementary import any_of, select
from ftqp.kernel.maths.side_by_side import WIDTH, put, several
from ftqp.kernel.study.planar_goal import NEAR, goal_ahead
from ftqp.kernel.study.planar_rest import MOVING, rest_ahead
from ftqp.kernel.study.planar_steps import NEVER, STEPS, begin, step
from ftqp.kernel.study.planar_stiff import LONG_WAY, SLOW, creep

STIFF: Final = 400
"""After so many steps a run goes on by a method for stiff equations."""
NEARLY_FLAT: Final = 1e-4
"""Below this det A rest is looked for whatever the speed is: a run goes into a singularity at full speed."""
EMPTY: Final = -1
FLOAT, WHOLE = np.dtype(np.float64), np.dtype(np.int64)


@jit
def _seat(P: Any, seat: int, run: int, starts: Any, locked: Any) -> None:
    """Give a seat to a run, or to nobody."""
    n = len(P.link)
    P.run[seat] = run
    P.steps[seat] = 0
    P.fresh[seat] = 1.0
    if run == EMPTY:
        P.fresh[seat] = 0.0
        for i in range(n):
            P.free[i * WIDTH + seat] = 0.0
        P.k1[seat::WIDTH] = 0.0
        return
    for i in range(n):
        P.q[i * WIDTH + seat] = starts[run, i]
        P.free[i * WIDTH + seat] = 0.0 if (locked[run] >> i) & 1 else 1.0


@jit
def _alone(P: Any, seat: int) -> None:
    """The configuration and the joints of a seat, eight times, in ``single``."""
    for i in range(len(P.link)):
        at = i * WIDTH
        P.here[i] = P.q[at + seat]
        P.single[at : at + WIDTH] = P.q[at + seat]
        P.single_free[at : at + WIDTH] = P.free[at + seat]


@jit
def _in_time(P: Any, seat: int) -> int:
    """The verdict of a run with a horizon: CORRECT where it has arrived by then, UNRESOLVED where not."""
    if P.arrived[seat] <= P.horizon:
        return CORRECT
    if P.time[seat] > P.horizon or P.arrived[seat] < NEVER or P.steps[seat] > 10 * STIFF:
        return UNRESOLVED
    return MOVING


@jit
def _verdict(P: Any, seat: int) -> int:
    """How the run of a seat ends that does not see the goal, or MOVING; the end is first in ``trial``."""
    if P.success > 0.0:
        return _in_time(P, seat)
    if P.speed[seat] < SLOW or P.det[seat] < NEARLY_FLAT:
        _alone(P, seat)
        ending = rest_ahead(P, P.single_free)
        if ending != MOVING:
            return ending
    if P.path[seat] > LONG_WAY:
        return NONE
    if P.steps[seat] > STIFF:
        _alone(P, seat)
        return creep(P, P.path[seat])
    return MOVING


@jit
def _look_for_goal(P: Any) -> None:
    """What is ahead of every run near the goal."""
    near = several(P.error, 0) < (NEAR * NEAR if not P.success > 0.0 else 0.0)
    if any_of(near):
        goal_ahead(P, P.q, P.free)
        put(P.found, 0, select(near, several(P.found, 0), 0.0))
    else:
        put(P.found, 0, several(P.zero, 0))


@jit
def _write(P: Any, seat: int, ending: int, column: int, endings: Any, ends: Any, facts: Any) -> None:
    """What became of the run of a seat; its end is a column of ``trial``, or of ``q`` where that is EMPTY."""
    run = P.run[seat]
    endings[run] = ending
    for i in range(len(P.link)):
        place = i * WIDTH
        ends[run, i] = P.q[place + seat] if column == EMPTY else P.trial[place + column]
    facts[run, 0], facts[run, 1], facts[run, 2] = P.path[seat], P.arrived[seat], P.steps[seat]
    P.run[seat] = EMPTY


@jit
def drive(
    P: Any, starts: Any, locked: Any, first: int, last: int, endings: Any, ends: Any, facts: Any
) -> None:
    """Runs ``first`` to ``last - 1`` to their ends.

    Args:
        P: The memory.
        starts: Configurations at the failure, (R, n) [rad].
        locked: Which joints do not move, bit i for joint i, (R,).
        first: The first run.
        last: Behind the last run.
        endings: Out: how it ended, (R,).
        ends: Out: the rest, or where the run was when it was given up, (R, n) [rad].
        facts: Out: way [rad], time when |e| fell below ``success`` [s], and steps, (R, 3).
    """
    for i in range(len(P.link)):
        P.q[i * WIDTH : (i + 1) * WIDTH] = starts[first, i]
    P.run[:] = EMPTY
    P.h[:] = 0.0
    run = first
    while True:
        busy = False
        for seat in range(WIDTH):
            if P.run[seat] == EMPTY:
                _seat(P, seat, run if run < last else EMPTY, starts, locked)
                run += 1
            busy = busy or P.run[seat] != EMPTY
        if not busy:
            return
        begin(P)
        for _ in range(STEPS):
            step(P)
        _look_for_goal(P)
        for seat in range(WIDTH):
            P.steps[seat] += STEPS
            if P.run[seat] != EMPTY and P.found[seat] > 0.5:
                ending = CORRECT if P.found[seat] < 1.5 else SINGULAR
                _write(P, seat, ending, seat, endings, ends, facts)
        for seat in range(WIDTH):  # these write into trial
            if P.run[seat] != EMPTY:
                ending = _verdict(P, seat)
                if ending != MOVING:
                    at_rest = P.success <= 0.0 and ending != NONE and ending != UNRESOLVED
                    _write(P, seat, ending, 0 if at_rest else EMPTY, endings, ends, facts)


def planar_runs(n: int) -> Callable[..., int]:
    """Runs after failures, of an arm of n joints."""
    dtype = planar_dtype(n)

    def planar_runs(memory_at: int, table_at: int, first: int, last: int) -> int:
        """Runs ``first`` to ``last - 1``.

        The table holds the number of all runs and the addresses of starts, locked, endings, ends and facts.
        """
        P = carray(pointer(memory_at), 1, dtype)[0]
        table = carray(pointer(table_at), (6,), WHOLE)
        count = table[0]
        drive(
            P,
            carray(pointer(table[1]), (count, n), FLOAT),
            carray(pointer(table[2]), (count,), WHOLE),
            first,
            last,
            carray(pointer(table[3]), (count,), WHOLE),
            carray(pointer(table[4]), (count, n), FLOAT),
            carray(pointer(table[5]), (count, 3), FLOAT),
        )
        return 0

    return planar_runs
