"""Joint limits as one interval per joint: what the next acceleration or velocity may be.

Every function gives the upper end, as ``(bound, limit that set it)``; the lower end is its mirror (v -> -v,
distance to the other limit, sign flipped). ``d`` is the distance to the upper position limit [rad or m]. Each
bound is derived in docs/theory/joint-limits.md.

``bound`` to ``lighten`` say what else is asked of one variable of the QP: its interval, and a value near it.
"""

from math import ceil, inf, sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    BY_ACCELERATION,
    BY_FAULT,
    BY_POSITION,
    BY_VELOCITY,
    HEALTHY,
    JIN,
    NO_LIMIT,
    ONE_STEP,
    VIABILITY,
)
from ftqp.kernel.maths.elementary import larger, select, smaller
from ftqp.kernel.maths.side_by_side import WIDTH, all_of, is_set, load_lanes, put_either, store_lanes


@jit
def bound(qp: Any, i: int, low: float, high: float) -> None:
    """low <= x_i <= high."""
    qp.lb[i], qp.ub[i] = low, high


@jit
def fix(qp: Any, i: int, x: float) -> None:
    """x_i = x."""
    bound(qp, i, x, x)


@jit
def widen(qp: Any, i: int, low: float, high: float) -> None:
    """Let x_i go to low and to high, too."""
    bound(qp, i, min(qp.lb[i], low), max(qp.ub[i], high))


@jit
def narrow(qp: Any, i: int, low: float, high: float) -> None:
    """low <= x_i <= high within the interval that x_i has; where they do not meet, its nearer end."""
    lb, ub = qp.lb[i], qp.ub[i]
    bound(qp, i, min(max(low, lb), ub), max(min(high, ub), lb))


@jit
def draw(qp: Any, i: int, weight: float, x: float) -> None:
    """weight (x_i - x)^2/2 in the place of what a diagonal objective has for x_i."""
    qp.H_diagonal[i] = weight
    qp.g[i] = -weight * x


@jit
def lighten(qp: Any, i: int, share: float) -> None:
    """The same with that share of its weight."""
    qp.H_diagonal[i] *= share
    qp.g[i] *= share


AT_LIMIT = 1e-12
"""A joint this near its position limit [rad or m], on either side, stands at it: rounding does no more."""
RETURN_GAIN = 4.0
"""A joint outside its position limit is led back at RETURN_GAIN times its distance [1/s] ..."""
RETURN_SLOWEST = 0.01
"""... at no less than this share of its velocity limit ..."""
RETURN_FASTEST = 0.25
"""... and no more than this share."""


@jit
def return_velocity(d: float, v_max: float) -> float:
    """Velocity (< 0) that leads a joint with d < 0 back inside."""
    top = v_max if v_max < inf else 1.0
    return -min(max(-RETURN_GAIN * d, RETURN_SLOWEST * top), RETURN_FASTEST * top)


@jit
def return_deceleration(v: float, a_max: float, a_brake: float) -> float:
    """How hard a joint outside its limit is pushed back: what is sure to be there, more while it leaves."""
    return a_max if v > 0.0 else a_brake


@jit
def braking_velocity(d: float, a_brake: float, dt: float) -> float:
    """Largest velocity that can stop within d in whole steps: d/(N dt) + a_brake dt (N-1)/2.

    N = max(1, ceil((-1 + sqrt(1 + 8 d/(a_brake dt^2)))/2)) is the number of steps that stopping takes. The
    textbook sqrt(2 a_brake d) is not safe in discrete time.
    """
    if not d < inf:
        return inf
    steps = max(1.0, float(ceil(0.5 * (sqrt(1.0 + 8.0 * d / (a_brake * dt * dt)) - 1.0))))
    return d / (steps * dt) + 0.5 * a_brake * dt * (steps - 1.0)


@jit
def viability(v: float, d: float, v_max: float, a_max: float, a_brake: float, dt: float) -> tuple[float, int]:
    """Largest acceleration after which the joint can still come to rest, in whole steps, before its limit.

    It is the least of a_max, of (v_max - v)/dt, and of (v' - v)/dt, v' = braking_velocity(d - v dt/2): what
    is left of d once the joint has moved by dt (v + v')/2 is then enough to brake from v' at ``a_brake`` or
    less. A joint that is too fast to stop within the step turns round in it, -v^2/(2 d). Outside its limit
    the joint is led back, with no more than a_brake once it no longer leaves. At its limit, to AT_LIMIT, it
    need not stop sooner than AT_LIMIT beyond: else what rounding leaves of its velocity would ask for a_max.
    Source: Del Prete 2018, with stops in whole steps (docs/theory/joint-limits.md), clipped to +-a_max.
    """
    if d < -AT_LIMIT:
        a = (return_velocity(d, v_max) - v) / dt
        return min(max(a, -return_deceleration(v, a_max, a_brake)), a_max), BY_POSITION
    d = max(d, 0.0)
    bound, by = a_max, BY_ACCELERATION
    a = (v_max - v) / dt
    if a < bound:
        bound, by = a, BY_VELOCITY
    after = v + bound * dt
    if after >= 0.0 and after * after <= 2.0 * a_brake * (d - dt * (0.5 * v + after)):
        return max(bound, -a_max), by  # far from the limit: braking_velocity >= after
    if after < 0.0:
        return max(bound, -a_max), by  # v < 0, away from it: braking_velocity >= 0
    if d < inf:
        if 0.5 * v * dt > max(d, AT_LIMIT):  # too fast: the turning point lies inside the step
            a = -v * v / (2.0 * max(d, AT_LIMIT))
        else:
            a = (braking_velocity(max(d - 0.5 * v * dt, 0.0), a_brake, dt) - v) / dt
        if a < bound:
            bound, by = a, BY_POSITION
    return max(bound, -a_max), by


@jit
def jin(
    v: float, d: float, v_max: float, a_max: float, gain_p: float, gain_v: float, margin: float
) -> tuple[float, int]:
    """min(gamma_p (d - margin), gamma_v (v_max - v), a_max).

    The interval can be empty, and the limits need not be kept: it is there for the paper's experiments.
    Source: Jin et al. 2017, reconstructed as in docs/theory/joint-limits.md.
    """
    bound, by = a_max, BY_ACCELERATION
    a = gain_v * (v_max - v)
    if a < bound:
        bound, by = a, BY_VELOCITY
    a = gain_p * (d - margin)
    if a < bound:
        bound, by = a, BY_POSITION
    return bound, by


@jit
def one_step(v: float, d: float, v_max: float, a_max: float, dt: float) -> tuple[float, int]:
    """min(2 (d - v dt)/dt^2, (v_max - v)/dt, a_max): looks one step ahead only, for comparison.

    Source: Flacco et al. 2012.
    """
    bound, by = a_max, BY_ACCELERATION
    a = (v_max - v) / dt
    if a < bound:
        bound, by = a, BY_VELOCITY
    a = 2.0 * (d - v * dt) / (dt * dt)
    if a < bound:
        bound, by = a, BY_POSITION
    return max(bound, -a_max), by


@jit
def braking(v: float, d: float, v_max: float, a_max: float, a_brake: float, dt: float) -> tuple[float, int]:
    """Largest next velocity: min(v_max, braking_velocity(d), v + a_max dt), never less than v - a_max dt."""
    bound, by = v + a_max * dt, BY_ACCELERATION
    if v_max < bound:
        bound, by = v_max, BY_VELOCITY
    if bound >= 0.0 and bound * bound <= 2.0 * a_brake * (d - 1.5 * bound * dt):
        return max(bound, v - a_max * dt), by  # far from the limit: braking_velocity(d) >= bound
    if bound < 0.0 and d >= 0.0:
        return max(bound, v - a_max * dt), by  # away from it: braking_velocity(d) >= 0
    if d < -AT_LIMIT:
        return max(min(bound, return_velocity(d, v_max)), v - return_deceleration(v, a_max, a_brake) * dt), (
            BY_POSITION
        )
    a = braking_velocity(max(d, 0.0), a_brake, dt)
    if a < bound:
        bound, by = a, BY_POSITION
    return max(bound, v - a_max * dt), by


@jit
def _upper(state: Any, limits: Any, feedback: Any, i: int, v: float, d: float) -> tuple[float, int]:
    """The upper end for joint i by the conversion that the planner was made with."""
    v_max = (1.0 - feedback.speed_margin) * limits.v_max[i]
    if state.level == ACCELERATION:
        if limits.conversion == JIN:
            return jin(v, d, v_max, limits.a_max[i], limits.jin_p, limits.jin_v, limits.jin_margin)
        if limits.conversion == ONE_STEP:
            return one_step(v, d, v_max, limits.a_max[i], state.dt)
        return viability(v, d, v_max, limits.a_max[i], limits.a_brake[i], state.dt)
    if limits.conversion == JIN:
        bound = limits.jin_upsilon * d
        return (bound, BY_POSITION) if bound < v_max else (v_max, BY_VELOCITY)
    if limits.conversion == ONE_STEP:
        bound = d / state.dt
        return (bound, BY_POSITION) if bound < v_max else (v_max, BY_VELOCITY)
    return braking(v, d, v_max, limits.a_max[i], limits.a_brake[i], state.dt)


@jit
def _least_bad(state: Any, limits: Any, i: int, lo: float, hi: float) -> float:
    """The one value for an interval that came out empty: stop as fast as the acceleration limit allows."""
    if state.level == ACCELERATION:
        return min(max(-state.v[i] / state.dt, -limits.a_max[i]), limits.a_max[i])
    return min(max(0.0, state.v[i] - limits.a_max[i] * state.dt), state.v[i] + limits.a_max[i] * state.dt)


@jit
def _jin_leaving(
    state: Any, limits: Any, i: int, lo: float, lower_by: int, hi: float, upper_by: int
) -> tuple[float, int, float, int]:
    """An interval that came out empty, without the position term of the strip that the joint is leaving."""
    v = state.v[i]
    if v < 0.0:
        hi, upper_by = jin(v, inf, limits.v_max[i], limits.a_max[i], limits.jin_p, limits.jin_v, 0.0)
    else:
        lo, lower_by = jin(-v, inf, limits.v_max[i], limits.a_max[i], limits.jin_p, limits.jin_v, 0.0)
        lo = -lo
    return lo, lower_by, hi, upper_by


@jit
def _one_by_one(state: Any, faults: Any, limits: Any, feedback: Any, qp: Any, first: int, last: int) -> None:
    """The intervals of the joints that work among ``first`` .. ``last`` - 1, each looked at by itself."""
    for i in range(first, last):
        if faults.code[i] != HEALTHY:
            continue
        v = state.v[i]
        hi, upper_by = _upper(state, limits, feedback, i, v, limits.q_max[i] - state.q[i])
        lo, lower_by = _upper(state, limits, feedback, i, -v, state.q[i] - limits.q_min[i])
        lo = -lo
        if lo > hi:
            if limits.conversion == JIN and state.level == ACCELERATION:
                lo, lower_by, hi, upper_by = _jin_leaving(state, limits, i, lo, lower_by, hi, upper_by)
            if lo > hi:
                limits.empty_intervals += 1
                lo = hi = _least_bad(state, limits, i, lo, hi)
        bound(qp, i, lo, hi)
        limits.lower_by[i], limits.upper_by[i] = lower_by, upper_by


@jit
def _far_accelerations(v: Any, d: Any, v_max: Any, a_max: Any, a_brake: Any, dt: float) -> Any:
    """``viability`` far from a limit, or moving away from it: bounds, where v_max sets them, where so."""
    fast = (v_max - v) / dt
    bound = smaller(a_max, fast)
    after = v + dt * bound
    far = after * after <= 2.0 * a_brake * (d - dt * (0.5 * v + after))
    return larger(bound, -a_max), fast < a_max, (d >= 0.0) & ((after < 0.0) | far)


@jit
def _far_velocities(v: Any, d: Any, v_max: Any, a_max: Any, a_brake: Any, dt: float) -> Any:
    """``braking`` far from a limit, or moving away from it, likewise."""
    most = v + dt * a_max
    bound = smaller(most, v_max)
    far = (bound < 0.0) | (bound * bound <= 2.0 * a_brake * (d - 1.5 * dt * bound))
    return larger(bound, v - dt * a_max), v_max < most, (d >= 0.0) & far


@jit
def _together(state: Any, faults: Any, limits: Any, feedback: Any, qp: Any, at: int) -> bool:
    """The intervals of the joints from ``at`` on, where all are far from position limits; else False."""
    q, v, dt = load_lanes(state.q, at), load_lanes(state.v, at), state.dt
    v_max = (1.0 - feedback.speed_margin) * load_lanes(limits.v_max, at)
    a_max, a_brake = load_lanes(limits.a_max, at), load_lanes(limits.a_brake, at)
    above, below_it = load_lanes(limits.q_max, at) - q, q - load_lanes(limits.q_min, at)
    if state.level == ACCELERATION:
        hi, fast, far = _far_accelerations(v, above, v_max, a_max, a_brake, dt)
        lo, fast_back, far_back = _far_accelerations(-v, below_it, v_max, a_max, a_brake, dt)
    else:
        hi, fast, far = _far_velocities(v, above, v_max, a_max, a_brake, dt)
        lo, fast_back, far_back = _far_velocities(-v, below_it, v_max, a_max, a_brake, dt)
    held = is_set(faults.code, at)
    if not all_of((far & far_back & (-lo <= hi)) | held):
        return False
    store_lanes(qp.lb, at, select(held, load_lanes(qp.lb, at), -lo))
    store_lanes(qp.ub, at, select(held, load_lanes(qp.ub, at), hi))
    put_either(limits.upper_by, at, fast, BY_VELOCITY, BY_ACCELERATION)
    put_either(limits.lower_by, at, fast_back, BY_VELOCITY, BY_ACCELERATION)
    return True


@part_jit
def intervals(K: Any) -> None:
    """lb <= x <= ub of every joint, and which limit set each end; a failed joint has no limits of its own."""
    chain, limits, faults, qp = K.chain, K.limits, K.faults, K.qp
    for at in range(0, K.chain.n, WIDTH):
        if limits.conversion != VIABILITY or not _together(K.state, faults, limits, K.feedback, qp, at):
            _one_by_one(K.state, faults, limits, K.feedback, qp, at, min(at + WIDTH, chain.n))
    for k in range(faults.movable, chain.n):  # x_F is written by prescribed_motion
        i = faults.order[k]
        limits.lower_by[i] = limits.upper_by[i] = BY_FAULT
    for k in range(faults.working, faults.movable):
        i = faults.order[k]
        bound(qp, i, -inf, inf)
        limits.lower_by[i] = limits.upper_by[i] = NO_LIMIT
