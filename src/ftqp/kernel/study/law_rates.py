"""Joint rates of the point-to-point law of any arm, eight configurations at once.

The bits of ``seats`` say which configurations are computed.
Runs go on by steps of orders 3 and 2, each with its own length.
Source: docs/theory/after-a-failure.md, "The law and its clock"; Bogacki and Shampine 1989, the 3(2) pair.
"""

import math
from typing import Any, Final

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import TASK_ROWS
from ftqp.kernel.layout.other_records import SHARE
from ftqp.kernel.maths.elementary import any_of, larger, select, smaller, sqrt
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.maths.side_by_side import WIDTH, load_lanes, store_lanes
from ftqp.kernel.study.task_values import task_values

TINY: Final = 1e-300
"""Keeps a quotient of two zeros a number. A convention: rounding of any other quotient is more."""
FLOOR: Final = 1e-30
"""Least pivot of B over the largest: beyond it the rates of a singular arm are huge, but numbers. A
convention: far below rounding, and its square is still a number."""


@jit
def values(S: Any, L: Any, q: Any, seats: int) -> None:
    """e and A of the task rows at eight configurations."""
    n, m = S.chain.n, S.study.m
    for seat in range(WIDTH):
        if not (seats >> seat) & 1:
            continue
        for i in range(n):
            S.state.q[i] = q[i * WIDTH + seat]
        task_values(S)
        for r in range(m):
            L.e[r * WIDTH + seat] = S.study.e[r]
            for i in range(n):
                L.A[(r * n + i) * WIDTH + seat] = S.study.A[r, i]


@jit
def weigh(S: Any, L: Any) -> Any:
    """P = M A' and the factors of B = A P; the least pivot over the largest."""
    n, m = S.chain.n, S.study.m
    if L.plain:
        for at in range(0, m * n * WIDTH, WIDTH):
            store_lanes(L.P, at, load_lanes(L.A, at))
        return factor(S, L)
    for r in range(m):
        for i in range(n):
            p = load_lanes(L.zero, 0)
            for k in range(n):
                p = p + load_lanes(L.A, (r * n + k) * WIDTH) * L.M[i, k]
            store_lanes(L.P, (r * n + i) * WIDTH, p)
    return factor(S, L)


@jit
def factor(S: Any, L: Any) -> Any:
    """B = A P = F D F', F with ones on the diagonal; ``pivot`` is D^-1. The least of D over the largest."""
    n, m = S.chain.n, S.study.m
    low, high = load_lanes(L.zero, 0), load_lanes(L.zero, 0)
    for c in range(m):
        for r in range(c, m):
            s = load_lanes(L.zero, 0)
            for i in range(n):
                s = s + load_lanes(L.A, (r * n + i) * WIDTH) * load_lanes(L.P, (c * n + i) * WIDTH)
            for k in range(c):
                part = load_lanes(L.factor, (r * TASK_ROWS + k) * WIDTH)
                s = s - part * load_lanes(L.factor, (k * TASK_ROWS + c) * WIDTH)
            store_lanes(L.factor, (c * TASK_ROWS + r) * WIDTH, s)
        d = load_lanes(L.factor, (c * TASK_ROWS + c) * WIDTH)
        high = larger(high, d)
        d = larger(d, high * FLOOR + TINY)
        low = d if c == 0 else smaller(low, d)
        inverse = 1.0 / d
        store_lanes(L.pivot, c * WIDTH, inverse)
        for r in range(c + 1, m):
            s = load_lanes(L.factor, (c * TASK_ROWS + r) * WIDTH)
            store_lanes(L.factor, (r * TASK_ROWS + c) * WIDTH, s * inverse)
    return low / (high + TINY)


@jit
def solve(S: Any, L: Any) -> None:
    """rhs <- B^-1 rhs with the factors of ``factor``."""
    m = S.study.m
    for r in range(1, m):
        s = load_lanes(L.rhs, r * WIDTH)
        for k in range(r):
            s = s - load_lanes(L.factor, (r * TASK_ROWS + k) * WIDTH) * load_lanes(L.rhs, k * WIDTH)
        store_lanes(L.rhs, r * WIDTH, s)
    for back in range(m):
        r = m - 1 - back
        s = load_lanes(L.rhs, r * WIDTH) * load_lanes(L.pivot, r * WIDTH)
        for k in range(r + 1, m):
            s = s - load_lanes(L.factor, (k * TASK_ROWS + r) * WIDTH) * load_lanes(L.rhs, k * WIDTH)
        store_lanes(L.rhs, r * WIDTH, s)


@jit
def resolve(S: Any, L: Any, free: Any, out: Any) -> Any:
    """out <- I_S P B^-1 rhs with what ``factor`` left; returns |out|. The right side is lost."""
    n, m = S.chain.n, S.study.m
    solve(S, L)
    square = load_lanes(L.zero, 0)
    for i in range(n):
        s = load_lanes(L.zero, 0)
        for r in range(m):
            s = s + load_lanes(L.P, (r * n + i) * WIDTH) * load_lanes(L.rhs, r * WIDTH)
        s = s * load_lanes(free, i * WIDTH)
        square = square + s * s
        store_lanes(out, i * WIDTH, s)
    return sqrt(square)


@jit
def towards_goal(S: Any, L: Any) -> Any:
    """rhs <- e; returns |e|^2."""
    square = load_lanes(L.zero, 0)
    for at in range(0, S.study.m * WIDTH, WIDTH):
        e = load_lanes(L.e, at)
        square = square + e * e
        store_lanes(L.rhs, at, e)
    return square


@jit
def rates(S: Any, L: Any, q: Any, free: Any, out: Any, seats: int) -> Any:
    """out <- v = I_S G e, gain 1; returns |e|^2, |v| and the least pivot of B over the largest."""
    values(S, L, q, seats)
    regular = weigh(S, L)
    error = towards_goal(S, L)
    return error, resolve(S, L, free, out), regular


@jit
def scaled_rates(S: Any, L: Any, q: Any, out: Any, seats: int) -> Any:
    """out <- dq/ds = v / (c + |v|); returns the same."""
    error, speed, regular = rates(S, L, q, L.free, out, seats)
    scale = 1.0 / (speed + SHARE)
    for at in range(0, S.chain.n * WIDTH, WIDTH):
        store_lanes(out, at, load_lanes(out, at) * scale)
    return error, speed, regular


@jit
def clock(L: Any, error: Any, speed: Any) -> Any:
    """dt/ds = 1 / (kappa (c + |v|)) with kappa = min(K_e, v_max / |e|), of |e|^2."""
    return larger(sqrt(error) * L.per_speed, L.slowness) / (speed + SHARE)


@jit
def rates_in_eight(S: Any, L: Any, out: Any, count: int) -> None:
    """The rates at the first configurations of ``eight``; those at the first one also in out, ``one_``."""
    error, speed, regular = rates(S, L, L.eight, L.alone, L.eight_rate, (1 << count) - 1)
    store_lanes(L.one_error, 0, error)
    store_lanes(L.one_speed, 0, speed)
    store_lanes(L.one_regular, 0, regular)
    for i in range(S.chain.n):
        out[i] = L.eight_rate[i * WIDTH]


@jit
def rates_at(S: Any, L: Any, q: Any, out: Any) -> None:
    """The same at one configuration, (n,)."""
    for i in range(S.chain.n):
        L.eight[i * WIDTH : (i + 1) * WIDTH] = q[i]
    rates_in_eight(S, L, out, 1)


LOOKS: Final = 4
"""Steps from one look at how a run may end to the next."""
LONGEST: Final = 1.0
"""Of a step, in s: the fastest motion near rest has the rate 2. Derived from the method's region of
stability, which ends beyond 2."""
FIRST: Final = 0.05
"""Length of the first step."""
SAFETY: Final = 0.9
GROWTH: Final = 5.0
SHRINKAGE: Final = 0.2
"""Largest changes of the length from step to step. Conventions of adaptive methods."""
NEVER: Final = 1e300
"""A time that does not come. A convention."""


@jit
def begin(S: Any, L: Any, seats: int) -> None:
    """The rates at the starts of runs that are fresh."""
    fresh = load_lanes(L.fresh, 0) > 0.5
    if not any_of(fresh):
        return
    error, speed, regular = scaled_rates(S, L, L.q, L.k4, seats)
    for at in range(0, S.chain.n * WIDTH, WIDTH):
        store_lanes(L.k1, at, select(fresh, load_lanes(L.k4, at), load_lanes(L.k1, at)))
    store_lanes(L.error, 0, select(fresh, error, load_lanes(L.error, 0)))
    store_lanes(L.speed, 0, select(fresh, speed, load_lanes(L.speed, 0)))
    store_lanes(L.regular, 0, select(fresh, regular, load_lanes(L.regular, 0)))
    store_lanes(L.rate, 0, select(fresh, clock(L, error, speed), load_lanes(L.rate, 0)))
    store_lanes(L.h, 0, select(fresh, FIRST, load_lanes(L.h, 0)))
    for array in (L.path, L.time, L.gone, L.fresh):
        store_lanes(array, 0, select(fresh, 0.0, load_lanes(array, 0)))
    store_lanes(L.arrived, 0, select(fresh, NEVER, load_lanes(L.arrived, 0)))


@jit
def step(S: Any, L: Any, seats: int) -> None:
    """One trial step of every run; where its error is too large, the run stays and its step gets shorter."""
    size = S.chain.n * WIDTH
    h, r1 = load_lanes(L.h, 0), load_lanes(L.rate, 0)
    for at in range(0, size, WIDTH):
        store_lanes(L.next, at, load_lanes(L.q, at) + 0.5 * h * load_lanes(L.k1, at))
    e2, s2, _ = scaled_rates(S, L, L.next, L.k2, seats)
    for at in range(0, size, WIDTH):
        store_lanes(L.next, at, load_lanes(L.q, at) + 0.75 * h * load_lanes(L.k2, at))
    e3, s3, _ = scaled_rates(S, L, L.next, L.k3, seats)
    ninth = h * (1.0 / 9.0)
    for at in range(0, size, WIDTH):
        move = 2.0 * load_lanes(L.k1, at) + 3.0 * load_lanes(L.k2, at) + 4.0 * load_lanes(L.k3, at)
        store_lanes(L.next, at, load_lanes(L.q, at) + ninth * move)
    e4, s4, regular = scaled_rates(S, L, L.next, L.k4, seats)
    wrong = load_lanes(L.zero, 0)
    for at in range(0, size, WIDTH):
        miss = (
            (-5.0 / 72.0) * load_lanes(L.k1, at)
            + (1.0 / 12.0) * load_lanes(L.k2, at)
            + (1.0 / 9.0) * load_lanes(L.k3, at)
            - 0.125 * load_lanes(L.k4, at)
        )
        wrong = wrong + miss * miss
    wrong = wrong * h * h / (L.tolerance * L.tolerance) + 1e-20
    good = wrong <= 1.0
    moved = load_lanes(L.zero, 0)
    for at in range(0, size, WIDTH):
        here, there = load_lanes(L.q, at), load_lanes(L.next, at)
        moved = moved + (there - here) * (there - here)
        store_lanes(L.q, at, select(good, there, here))
        store_lanes(L.k1, at, select(good, load_lanes(L.k4, at), load_lanes(L.k1, at)))
    store_lanes(L.path, 0, load_lanes(L.path, 0) + select(good, sqrt(moved), 0.0))
    store_lanes(L.gone, 0, load_lanes(L.gone, 0) + select(good, h, 0.0))
    took = ninth * (2.0 * r1 + 3.0 * clock(L, e2, s2) + 4.0 * clock(L, e3, s3))
    if L.success > 0.0:
        _arrive(L, good, e4, took)
    store_lanes(L.time, 0, load_lanes(L.time, 0) + select(good, took, 0.0))
    store_lanes(L.rate, 0, select(good, clock(L, e4, s4), r1))
    store_lanes(L.error, 0, select(good, e4, load_lanes(L.error, 0)))
    store_lanes(L.speed, 0, select(good, s4, load_lanes(L.speed, 0)))
    store_lanes(L.regular, 0, select(good, regular, load_lanes(L.regular, 0)))
    # wrong is the square of the error: its power 5/32 is the error's power 0.31
    root = sqrt(sqrt(sqrt(wrong)))
    change = SAFETY / (root * sqrt(sqrt(root)))
    change = smaller(larger(change, SHRINKAGE), GROWTH)
    store_lanes(L.h, 0, smaller(h * change, LONGEST))


@jit
def _arrive(L: Any, good: Any, error: Any, took: Any) -> None:
    """When |e| fell below ``success``."""
    before, now = sqrt(load_lanes(L.error, 0)), sqrt(error)
    share = smaller(larger((before - L.success) / (before - now + TINY), 0.0), 1.0)
    arrived = load_lanes(L.arrived, 0)
    first = good & (now < L.success) & (arrived >= NEVER)
    store_lanes(L.arrived, 0, select(first, load_lanes(L.time, 0) + share * took, arrived))


@jit
def note(S: Any, L: Any, trace: Any, q: Any, stride: int, gone: float, time: float, error: float) -> None:
    """Put q, s, t and |e| of the one run that is followed on record, (rows, n + 3), where somebody asks."""
    n, size = S.chain.n, len(trace)
    if size == 0 or (L.rows > 0 and not gone > trace[L.rows - 1, n] + L.spacing):
        return
    if L.rows == size:
        L.rows, L.spacing = size // 2, 2.0 * gone / size
        for k in range(L.rows):
            assign(trace[k], trace[2 * k], n + 3)
    for i in range(n):
        trace[L.rows, i] = q[i * stride]
    trace[L.rows, n], trace[L.rows, n + 1], trace[L.rows, n + 2] = gone, time, math.sqrt(error)
    L.rows += 1
