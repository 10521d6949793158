"""Runs after failures that nobody was told of: eight seats, which go to the next runs as they end."""

from typing import Any, Final

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import CORRECT, NONE, UNRESOLVED
from ftqp.kernel.layout.other_records import LONG_WAY, SHARE
from ftqp.kernel.maths.elementary import any_of, select
from ftqp.kernel.maths.side_by_side import WIDTH, put, several
from ftqp.kernel.study.creeping import creep
from ftqp.kernel.study.ends_ahead import (
    MOVING,
    NEAR,
    NEARLY_FLAT,
    REACH,
    RESTING,
    SLOW,
    begin_alone,
    draws,
    ending_ahead,
    goal_ahead,
)
from ftqp.kernel.study.law_rates import LOOKS, NEVER, begin, note, step

PATIENCE: Final = 10
"""A run that is given a time may take so many times as many steps as another before it creeps."""
EMPTY: Final = -1


@jit
def _seat(S: Any, L: Any, seat: int, run: int, starts: Any, locked: Any) -> None:
    """Give a seat to a run, or to nobody."""
    n, moving = S.chain.n, 0
    L.run[seat], L.steps[seat] = run, 0
    L.fresh[seat] = 0.0 if run == EMPTY else 1.0
    for i in range(n):
        at = i * WIDTH + seat
        moves = run != EMPTY and not (locked[run] >> i) & 1
        L.free[at] = 1.0 if moves else 0.0
        if run == EMPTY:
            L.k1[at] = 0.0
        else:
            L.q[at] = starts[run, i]
        moving += 1 if moves else 0
    L.reach[seat] = L.close if moving > S.study.m else REACH


@jit
def _look_for_goal(S: Any, L: Any, seats: int) -> None:
    """What is ahead of every run near the goal, where the end is asked for and not the time."""
    bound = NEAR * L.unit if not L.success > 0.0 else 0.0
    near = several(L.error, 0) < bound * bound
    put(L.found, 0, several(L.zero, 0))
    if any_of(near):
        goal_ahead(S, L, L.q, L.free, several(L.reach, 0), seats)
        put(L.found, 0, select(near, several(L.found, 0), 0.0))


@jit
def _in_time(L: Any, seat: int) -> int:
    """CORRECT where a run has arrived by its horizon, UNRESOLVED where not, MOVING before."""
    if L.arrived[seat] < NEVER:
        return CORRECT if L.arrived[seat] <= L.horizon else UNRESOLVED
    late = L.time[seat] > L.horizon or L.steps[seat] > PATIENCE * L.most
    return UNRESOLVED if late else MOVING


@jit
def _ending(S: Any, L: Any, seat: int, trace: Any) -> int:
    """How the run of a seat ends that does not see the goal, or MOVING; where, is in ``there``."""
    timed, speed, regular = L.success > 0.0, L.speed[seat], L.regular[seat]
    ending = _in_time(L, seat) if timed else MOVING
    looks = regular < NEARLY_FLAT or (speed < SLOW * (SHARE + speed) and not timed)
    stiff = L.steps[seat] > L.most and not timed
    long = L.path[seat] > LONG_WAY and not timed
    if ending == MOVING and not (looks or stiff or long):
        return MOVING
    begin_alone(S, L, seat)
    if ending == MOVING and looks:
        ending = ending_ahead(S, L, speed, regular)
        if ending != MOVING:
            return ending
    if ending == MOVING and stiff and not long:
        return creep(S, L, seat, trace)
    for i in range(S.chain.n):
        L.there[i] = L.here[i]
    return NONE if ending == MOVING and long else ending


@jit
def _write(
    S: Any, L: Any, seat: int, ending: int, q: Any, place: int, stride: int, endings: Any, ends: Any,
    facts: Any,
) -> None:  # fmt: skip
    """What became of the run of a seat, which ends at the numbers of q from a place on."""
    run = L.run[seat]
    endings[run] = ending
    for i in range(S.chain.n):
        ends[run, i] = q[place + i * stride]
    facts[run, 0], facts[run, 1], facts[run, 2] = L.path[seat], L.arrived[seat], L.steps[seat]
    L.run[seat] = EMPTY


@jit
def drive(
    S: Any, L: Any, starts: Any, locked: Any, first: int, last: int, endings: Any, ends: Any, facts: Any,
    trace: Any,
) -> None:  # fmt: skip
    """Runs ``first`` to ``last - 1`` to their ends."""
    n, run = S.chain.n, first
    for i in range(n):
        L.q[i * WIDTH : (i + 1) * WIDTH] = starts[first, i]
    L.run[:], L.h[:], L.rows, L.spacing = EMPTY, 0.0, 0, 0.0
    while True:
        seats = 0
        for seat in range(WIDTH):
            if L.run[seat] == EMPTY:
                _seat(S, L, seat, run if run < last else EMPTY, starts, locked)
                run += 1
            seats |= (1 << seat) if L.run[seat] != EMPTY else 0
        if seats == 0:
            return
        begin(S, L, seats)
        for seat in range(WIDTH):  # those that begin at rest
            if L.run[seat] != EMPTY and L.steps[seat] == 0 and L.speed[seat] < RESTING:
                ending = _ending(S, L, seat, trace)
                if ending != MOVING:
                    _write(S, L, seat, ending, L.there, 0, 1, endings, ends, facts)
        note(S, L, trace, L.q, WIDTH, L.gone[0], L.time[0], L.error[0])
        for _ in range(LOOKS):
            step(S, L, seats)
            note(S, L, trace, L.q, WIDTH, L.gone[0], L.time[0], L.error[0])
        _look_for_goal(S, L, seats)
        for seat in range(WIDTH):
            L.steps[seat] += LOOKS
            if L.run[seat] != EMPTY and L.found[seat] > 0.5 and draws(S, L, seat):
                _write(S, L, seat, CORRECT, L.trial, seat, WIDTH, endings, ends, facts)
        for seat in range(WIDTH):  # these search the goal, too, and write into ``trial``
            ending = MOVING if L.run[seat] == EMPTY else _ending(S, L, seat, trace)
            if ending != MOVING:
                _write(S, L, seat, ending, L.there, 0, 1, endings, ends, facts)
