"""Runs after failures that nobody reported: eight seats, which go to the next runs as they end.

A run ends at the goal, at another rest, or in a singularity that lies ahead.
Source: docs/theory/after-a-failure.md, "How a run ends".

Where a motion creeps it goes on by itself, in real time, by an L-stable method of order 2: next to
configurations that are nearly singular dq/ds turns within a width of the least singular value, while dq/dt
decays linearly there, which such a method passes in long steps. Slopes are central differences.
Source: Shampine and Reichelt 1997, section 3.1 (ode23s).
"""

from math import sqrt
from typing import Any, Final

from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import CORRECT, ERRONEOUS, NONE, SINGULAR, TASK_ROWS, UNRESOLVED
from ftqp.kernel.layout.other_records import LONG_WAY, SHARE
from ftqp.kernel.maths.elementary import any_of, select
from ftqp.kernel.maths.linear_systems import assign, lu_factor, lu_solve, plus_products
from ftqp.kernel.maths.side_by_side import WIDTH, load_lanes, store_lanes
from ftqp.kernel.study.law_rates import (
    LOOKS,
    NEVER,
    begin,
    factor,
    note,
    rates,
    rates_at,
    rates_in_eight,
    resolve,
    solve,
    step,
    towards_goal,
    values,
)

SQUARINGS: Final = 24
"""Of the Cayley transform, until its powers have grown or died."""


@jit
def dies_out(L: Any, k: int) -> bool:
    """Whether all eigenvalues of ``slope``, (k, k), have negative real parts; the slopes are lost.

    Of two unknowns by det > 0 and trace < 0, of more by the powers of the Cayley transform
    C = (s - S)^-1 (s + S): they die out just where S is stable, as |(s + x)/(s - x)| < 1 where Re x < 0.
    """
    S, B = L.slope, L.work
    if k == 1:
        return S[0, 0] < 0.0
    if k == 2:
        return S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0] > 0.0 and S[0, 0] + S[1, 1] < 0.0
    scale = largest_of(S, k)
    if not scale > 0.0:
        return False
    for i in range(k):
        for j in range(k):
            B[i, j] = (scale if i == j else 0.0) - S[i, j]
            S[i, j] += scale if i == j else 0.0
    if not lu_factor(B, k, L.pivots):
        return False
    for j in range(k):
        assign(L.y, S[:, j], k)
        lu_solve(B, k, L.pivots, L.y)
        assign(S[:, j], L.y, k)
    for _ in range(SQUARINGS):
        size = 0.0
        for i in range(k):
            for j in range(k):
                s = plus_products(0.0, S[i], S[:, j], k)
                B[i, j] = s
                size += s * s
        for i in range(k):
            assign(S[i], B[i], k)
        if not size < 1e30:
            return False
        if size < 1e-6:
            return True
    return sqrt(size) < 1e-3


@jit
def largest_of(S: Any, k: int) -> float:
    """The largest entry of S, (k, k), without its sign."""
    scale = 0.0
    for i in range(k):
        for j in range(k):
            scale = max(scale, abs(S[i, j]))
    return scale


MOVING: Final = -1
"""Not at an end, as far as is known."""
NEAR: Final = 5e-2
"""From this |e| on the goal is looked for [unit lengths]."""
REACH: Final = 5e-2
"""An end that is further away from a run than this is not taken for its own [rad]."""
GOAL_SEARCHES: Final = 4
"""Newton steps: from ``NEAR`` on the error falls below 1e-12 where the Jacobian is regular."""
FOUND: Final = 1e-9
"""The |e| at which a configuration counts as one at the goal [unit lengths]. Newton's steps from ``NEAR`` end
far below it, rounding included."""
SEARCHES: Final = 12
"""Newton steps to a rest, at most."""
STILL: Final = 1e-9
"""A Newton step this short has converged [rad]. The next one would be rounding."""
AT_GOAL: Final = 1e-6
"""|e| at a rest that counts as the goal [unit lengths]."""
SLOW: Final = 3e-2
"""Below this |dq/ds| rest is looked for."""
RESTING: Final = 1e-7
"""A motion this slow with gain 1 has come to rest, though there may be rests beside it [rad/s]."""
NEUTRAL: Final = 1e-6
"""An eigenvalue whose real part is this small beside the slopes, or beside 1, belongs to a curve of rests."""
DIFFERENCE: Final = 1e-6
"""Of slopes by central differences [rad or m]. Between the rounding of slopes and what they bend: a
convention."""
AT_ONCE: Final = (WIDTH - 1) // 2
"""Joints whose differences have room beside the configuration itself."""
FLAT: Final = 1e-10
"""Least pivot of B over the largest up to which the arm at the goal is singular, and the goal not taken.
Above rounding; a guess that tests/kernel/study/test_law_runs.py has not contradicted."""
NEARLY_FLAT: Final = 1e-5
"""The same from which a singularity ahead is looked for ..."""
TRULY_FLAT: Final = 1e-12
"""... and of one that takes a motion in. Rounding, and a guess that tests/kernel/study/test_law_runs.py has
not contradicted."""
FIRST_AHEAD: Final = 1e-9
LAST_AHEAD: Final = 2.0 * REACH
FINER: Final = 60
"""How far behind a singularity the field is looked at [rad], and by how many halvings it is found."""


@jit
def goal_ahead(S: Any, L: Any, q: Any, free: Any, reach: Any, seats: int) -> None:
    """Search the goal from q with the joints that move, within ``reach``; ends in ``trial``.

    ``found`` is 1 where there is one; where fewer joints than rows move, the goal is found as a rest only. It
    draws the arm if the motion e' = -A I_S G e dies out, whose matrix, turned into B^-1 (A I_S P), goes into
    ``turned``.
    """
    n, m = S.chain.n, S.study.m
    for at in range(0, n * WIDTH, WIDTH):
        store_lanes(L.trial, at, load_lanes(q, at))
    for _ in range(GOAL_SEARCHES):
        values(S, L, L.trial, seats)
        for r in range(m):
            for i in range(n):
                at = (r * n + i) * WIDTH
                store_lanes(L.P, at, load_lanes(L.A, at) * load_lanes(free, i * WIDTH))
        factor(S, L)
        towards_goal(S, L)
        resolve(S, L, free, L.next)
        for at in range(0, n * WIDTH, WIDTH):
            store_lanes(L.trial, at, load_lanes(L.trial, at) + load_lanes(L.next, at))
    error, _, regular = rates(S, L, L.trial, free, L.next, seats)
    way = load_lanes(L.zero, 0)
    for at in range(0, n * WIDTH, WIDTH):
        move = load_lanes(L.trial, at) - load_lanes(q, at)
        way = way + move * move
    for c in range(m):
        for r in range(m):
            s = load_lanes(L.zero, 0)
            for i in range(n):
                moves = load_lanes(free, i * WIDTH) * load_lanes(L.P, (c * n + i) * WIDTH)
                s = s + load_lanes(L.A, (r * n + i) * WIDTH) * moves
            store_lanes(L.rhs, r * WIDTH, s)
        solve(S, L)
        for r in range(m):
            store_lanes(L.turned, (r * TASK_ROWS + c) * WIDTH, load_lanes(L.rhs, r * WIDTH))
    bound = FOUND * L.unit
    there = (error < bound * bound) & (way < reach * reach) & (regular > FLAT)
    store_lanes(L.found, 0, select(there, 1.0, 0.0))


@jit
def draws(S: Any, L: Any, seat: int) -> bool:
    """Whether the goal that a run has found draws the arm."""
    m = S.study.m
    for r in range(m):
        for c in range(m):
            L.slope[r, c] = -L.turned[(r * TASK_ROWS + c) * WIDTH + seat]
    return dies_out(L, m)


@jit
def put_slopes(S: Any, L: Any, q: Any) -> None:
    """dv/dq at q, (n,), of the joints that move into ``slope``, by central differences, three at a time."""
    n, k = S.chain.n, L.moves
    for first in range(0, k, AT_ONCE):
        last = min(first + AT_ONCE, k)
        for i in range(n):
            L.eight[i * WIDTH : (i + 1) * WIDTH] = q[i]
        for l in range(first, last):
            at = L.moving[l] * WIDTH + 1 + 2 * (l - first)
            L.eight[at] += DIFFERENCE
            L.eight[at + 1] -= DIFFERENCE
        rates_in_eight(S, L, L.v, 1 + 2 * (last - first))
        for l in range(first, last):
            for i in range(k):
                at = L.moving[i] * WIDTH + 1 + 2 * (l - first)
                L.slope[i, l] = (L.eight_rate[at] - L.eight_rate[at + 1]) / (2.0 * DIFFERENCE)


@jit
def _rest_ahead(S: Any, L: Any) -> int:
    """What Newton steps on the rates find within REACH of ``here``, or MOVING; it is in ``there``."""
    n, k, found = S.chain.n, L.moves, False
    assign(L.there, L.here, n)
    for _ in range(SEARCHES):
        put_slopes(S, L, L.there)
        for i in range(k):
            L.y[i] = -L.v[L.moving[i]]
            assign(L.work[i], L.slope[i], k)
        if not lu_factor(L.work, k, L.pivots):
            return MOVING
        lu_solve(L.work, k, L.pivots, L.y)
        length, way = 0.0, 0.0
        for i in range(k):
            j = L.moving[i]
            length += L.y[i] * L.y[i]
            L.there[j] += L.y[i]
            way += (L.there[j] - L.here[j]) ** 2
        if not way < REACH * REACH:
            return MOVING
        if length < STILL * STILL:
            found = True
            break
    if not found:
        return MOVING
    put_slopes(S, L, L.there)
    if not dies_out(L, k):
        return MOVING
    return CORRECT if L.one_error[0] < (AT_GOAL * L.unit) ** 2 else ERRONEOUS


@jit
def _on_a_curve(S: Any, L: Any) -> int:
    """Whether ``here``, where all stands, is one of many rests that attract: ERRONEOUS or MOVING."""
    assign(L.there, L.here, S.chain.n)
    put_slopes(S, L, L.there)
    if L.one_error[0] < (AT_GOAL * L.unit) ** 2:
        return MOVING
    shift = NEUTRAL * max(1.0, largest_of(L.slope, L.moves))
    for i in range(L.moves):
        L.slope[i, i] -= shift
    return ERRONEOUS if dies_out(L, L.moves) else MOVING


@jit
def _points_back(S: Any, L: Any, way: float) -> bool:
    """Whether the field at ``there`` = ``here`` + way v/|v| points against v, which is in ``v``."""
    n = S.chain.n
    square = along = 0.0
    square = plus_products(square, L.v, L.v, n)
    for i in range(n):
        L.there[i] = L.here[i] + way / sqrt(square) * L.v[i]
    rates_at(S, L, L.there, L.w)
    along = plus_products(along, L.w, L.v, n)
    return along < -0.5 * sqrt(square) * L.one_speed[0]


@rare_jit
def _singularity_ahead(S: Any, L: Any) -> int:
    """Whether a singular configuration takes the motion in: behind it the field points back. Or MOVING."""
    rates_at(S, L, L.here, L.v)
    if L.one_regular[0] > NEARLY_FLAT or L.one_speed[0] < RESTING:
        return MOVING
    ratio = (LAST_AHEAD / FIRST_AHEAD) ** (1.0 / (FINER - 1))
    before, behind = 0.0, FIRST_AHEAD
    while not _points_back(S, L, behind):
        before, behind = behind, behind * ratio
        if behind > LAST_AHEAD:
            return MOVING
    for _ in range(FINER):
        middle = 0.5 * (before + behind)
        if _points_back(S, L, middle):
            behind = middle
        else:
            before = middle
    _points_back(S, L, behind)
    return SINGULAR if L.one_regular[0] < TRULY_FLAT else MOVING


@jit
def begin_alone(S: Any, L: Any, seat: int) -> None:
    """Make the run of a seat the one that is looked at alone: its joints that move, its place in ``here``."""
    k = 0
    for i in range(S.chain.n):
        free = L.free[i * WIDTH + seat]
        L.here[i] = L.q[i * WIDTH + seat]
        L.alone[i * WIDTH : (i + 1) * WIDTH] = free
        if free > 0.5:
            L.moving[k] = i
            k += 1
    L.moves = k


@rare_jit
def ending_ahead(S: Any, L: Any, speed: float, regular: float) -> int:
    """How the run at ``here`` ends that does not see the goal, or MOVING; the end is in ``there``."""
    if speed < SLOW * (SHARE + speed):
        ending = _rest_ahead(S, L)
        return _on_a_curve(S, L) if ending == MOVING and speed < RESTING else ending
    return _singularity_ahead(S, L) if regular < NEARLY_FLAT else MOVING


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
    near = load_lanes(L.error, 0) < bound * bound
    store_lanes(L.found, 0, load_lanes(L.zero, 0))
    if any_of(near):
        goal_ahead(S, L, L.q, L.free, load_lanes(L.reach, 0), seats)
        store_lanes(L.found, 0, select(near, load_lanes(L.found, 0), 0.0))


D: Final = 0.2928932188134524
"""1 / (2 + sqrt 2). Derived in the source."""
E32: Final = 7.414213562373095
"""6 + sqrt 2. Derived in the source."""
TRIALS: Final = 3
"""Trial steps at most, in those of the method before."""
FIRST_CREEP: Final = 1e-4
LONGEST_CREEP: Final = 1e6
"""Lengths of the first step and of any step [s], with the gain 1/s."""


@jit
def _look(S: Any, L: Any, error: float, speed: float, regular: float) -> int:
    """What is ahead of ``here``; an end is in ``there``."""
    if error < (NEAR * L.unit) ** 2:
        rates_at(S, L, L.here, L.w)  # eight times in ``eight``
        goal_ahead(S, L, L.eight, L.alone, load_lanes(L.reach, 0), 1)
        if L.found[0] > 0.5 and draws(S, L, 0):
            for i in range(S.chain.n):
                L.there[i] = L.trial[i * WIDTH]
            return CORRECT
    return ending_ahead(S, L, speed, regular)


@jit
def _rates_into(S: Any, L: Any, q: Any, out: Any) -> None:
    """v of the joints that move, (k,), at q, (n,)."""
    rates_at(S, L, q, L.v)
    for i in range(L.moves):
        out[i] = L.v[L.moving[i]]


@jit
def _moved(L: Any, h: float, by: Any) -> None:
    """there <- here + h by."""
    for i in range(L.moves):
        L.there[L.moving[i]] = L.here[L.moving[i]] + h * by[i]


@rare_jit
def creep(S: Any, L: Any, seat: int, trace: Any) -> int:
    """How the run of a seat, which is at ``here``, ends; where, is in ``there``."""
    n, k, h, time, gone = S.chain.n, L.moves, FIRST_CREEP, L.time[seat], L.gone[seat]
    for trial in range(TRIALS * L.most):
        put_slopes(S, L, L.here)
        for i in range(k):
            L.f_0[i] = L.v[L.moving[i]]
        error, speed, regular = L.one_error[0], L.one_speed[0], L.one_regular[0]
        if trial % LOOKS == 0:
            ending = _look(S, L, error, speed, regular)
            if ending != MOVING:
                return ending
            if L.path[seat] > LONG_WAY:
                break
            put_slopes(S, L, L.here)
        for i in range(k):
            L.k_1[i] = L.f_0[i]
            for j in range(k):
                L.work[i, j] = (1.0 if i == j else 0.0) - h * D * L.slope[i, j]
        if not lu_factor(L.work, k, L.pivots):
            h *= 0.5
            continue
        assign(L.there, L.here, n)
        lu_solve(L.work, k, L.pivots, L.k_1)
        _moved(L, 0.5 * h, L.k_1)
        _rates_into(S, L, L.there, L.f_1)
        for i in range(k):
            L.k_2[i] = L.f_1[i] - L.k_1[i]
        lu_solve(L.work, k, L.pivots, L.k_2)
        for i in range(k):
            L.k_2[i] += L.k_1[i]
        _moved(L, h, L.k_2)
        _rates_into(S, L, L.there, L.k_3)
        for i in range(k):
            L.k_3[i] -= E32 * (L.k_2[i] - L.f_1[i]) + 2.0 * (L.k_1[i] - L.f_0[i])
        lu_solve(L.work, k, L.pivots, L.k_3)
        wrong, moved = 0.0, 0.0
        for i in range(k):
            wrong += (h / 6.0 * (L.k_1[i] - 2.0 * L.k_2[i] + L.k_3[i])) ** 2
            moved += (h * L.k_2[i]) ** 2
        wrong = sqrt(wrong) / L.tolerance
        if wrong <= 1.0:
            L.path[seat] += sqrt(moved)
            gone += h * (SHARE + speed)
            time += h * max(L.slowness, sqrt(error) * L.per_speed)
            assign(L.here, L.there, n)
            note(S, L, trace, L.here, 1, gone, time, L.one_error[0])
        h = min(LONGEST_CREEP, h * min(5.0, max(0.2, 0.9 / (wrong + 1e-6) ** (1.0 / 3.0))))
    assign(L.there, L.here, n)
    return NONE if L.path[seat] > LONG_WAY else UNRESOLVED


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
    assign(L.there, L.here, S.chain.n)
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
