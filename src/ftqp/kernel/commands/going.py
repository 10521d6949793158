"""Going to a posture: the motion of the joints that work, as far as motors hold the arm on it, and its end.

It is planned from the last command, anew where the belief in a joint or a limit changes, so that position and
velocity go on without a jump. Source: docs/theory/ways-to-a-goal.md.
"""

from math import pi
from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.latches.settling import keep_rows
from ftqp.kernel.layout.enums import (
    BRAKING,
    GOING_MOVING,
    GOING_REACHED,
    GOING_RESTLESS,
    GOING_UNREACHABLE,
    HEALTHY,
)
from ftqp.kernel.layout.thresholds import (
    ACCELERATION_SHARE,
    AT_REST,
    COMES_NEARER,
    ENDLESS,
    EXACT,
    PATIENCE,
    RESTLESS_PATIENCE,
    SLOW_SHARE,
    SPEED_DEVIATION,
    STRONG,
)
from ftqp.kernel.maths.elementary import floor
from ftqp.kernel.maths.jerk_limited import PARTS, brake, duration_of, fastest, slower, state_after
from ftqp.kernel.maths.vectors import three

ALONG = 1e-9
"""States as near to the way of all joints as this share of their limits lie along it. A convention."""
LARGE = 1e300
"""More than any number of a motion."""
SPEED_SHARE = 0.999
"""Share of the limits of speed that the motion uses."""
PLACES, FINER, NEARER_ENDS = 17, 10, 8
"""Whether motors hold the arm is looked at in so many places of a motion, in so many between the last at
which they do and the next, and so many nearer ends are tried before the arm is left where it stands."""
RESTS_SOONEST, GOES, RESTS_TOGETHER = 0, 1, 2
"""What a motion does, see ``plan_going``."""
BISECTIONS = 50
"""Halvings of a share until rounding ends that. A convention."""


@jit
def short_way(K: Any, i: int, way: float) -> float:
    """A way of joint i; of a continuous joint the short way round."""
    return way - 2.0 * pi * floor((way + pi) / (2.0 * pi)) if K.chain.continuous[i] else way


@jit
def way_from(K: Any, W: Any, i: int, q: float) -> float:
    """From a place of joint i to its goal."""
    return short_way(K, i, W.goal[i] - q)


@jit
def _is_along(W: Any, n: int, lead: int) -> bool:
    """Whether speeds and accelerations of all joints are along their ways, as joint ``lead`` has them."""
    if W.way[lead] == 0.0:
        return False
    v, a = W.v[lead] / W.way[lead], W.a[lead] / W.way[lead]
    for i in range(n):
        if W.moves[i] and (
            abs(W.v[i] - v * W.way[i]) > ALONG * W.v_max[i] or abs(W.a[i] - a * W.way[i]) > ALONG * W.a_max[i]
        ):
            return False
    return True


@rare_jit
def _go_along(W: Any, n: int, lead: int) -> None:
    """One time law for all joints, of the share of their ways that is gone."""
    v_max = a_max = jerk = LARGE
    for i in range(n):
        size = abs(W.way[i])
        if W.moves[i] and size > 0.0:
            v_max = min(v_max, W.v_max[i] / size)
            a_max = min(a_max, W.a_max[i] / size)
            jerk = min(jerk, W.jerk[i] / size)
    way, times, jerks = W.way[lead], W.times[lead], W.jerks[lead]
    fastest(times, jerks, 1.0, W.v[lead] / way, W.a[lead] / way, v_max, a_max, jerk)
    for i in range(n):
        if W.moves[i] and i != lead:
            for k in range(PARTS):
                W.times[i, k], W.jerks[i, k] = times[k], jerks[k] * W.way[i]
    for k in range(PARTS):
        jerks[k] *= way
    W.duration = duration_of(times)


@rare_jit
def _go_together(W: Any, n: int) -> None:
    """Each joint its way, to arrive at the same time."""
    W.duration = 0.0
    for i in range(n):
        if W.moves[i]:
            W.by[i] = fastest(
                W.times[i], W.jerks[i], W.way[i], W.v[i], W.a[i], W.v_max[i], W.a_max[i], W.jerk[i]
            )
            W.duration = max(W.duration, duration_of(W.times[i]))
    for i in range(n):
        if W.moves[i] and duration_of(W.times[i]) < W.duration and W.by[i] != 0.0:
            slower(
                W.times[i], W.jerks[i], W.way[i], W.v[i], W.a[i], W.by[i], W.a_max[i], W.jerk[i], W.duration
            )


@rare_jit
def _go(W: Any, n: int) -> None:
    """The motion along the ways of all joints."""
    lead = 0
    for i in range(n):
        if W.moves[i] and (not W.moves[lead] or abs(W.way[i]) > abs(W.way[lead])):
            lead = i
    if _is_along(W, n, lead):
        _go_along(W, n, lead)
    else:
        _go_together(W, n)


@jit
def _brake_joint(W: Any, i: int, share: float) -> float:
    """Joint i comes to rest soonest with a share of its limits: how long that takes [s]."""
    W.way[i] = brake(W.times[i], W.jerks[i], W.v[i], W.a[i], share * W.a_max[i], share * W.jerk[i])
    return duration_of(W.times[i])


@rare_jit
def _brake(K: Any, W: Any, n: int, together: bool) -> None:
    """All joints come to rest soonest; or at once, near their way, with one that has failed and brakes."""
    W.duration = 0.0
    for i in range(n):
        W.way[i] = 0.0
        if W.moves[i]:
            W.duration = max(W.duration, _brake_joint(W, i, 1.0))
        elif together and K.faults.code[i] == BRAKING:
            W.duration = max(W.duration, abs(W.v[i]) / K.faults.lock_rate[i])
    for i in range(n if together else 0):
        low, high = 0.0, 1.0
        for _ in range(BISECTIONS if W.moves[i] and (W.v[i] != 0.0 or W.a[i] != 0.0) else 0):
            middle = 0.5 * (low + high)
            if _brake_joint(W, i, middle) > W.duration:
                low = middle
            else:
                high = middle
        if W.moves[i]:
            _brake_joint(W, i, high)


@jit
def look_up(W: Any, n: int, t: float) -> None:
    """Where the motion is at a time [s]; after its end it rests."""
    for i in range(n):
        W.q_now[i], W.v_now[i], W.a_now[i] = W.q[i], 0.0, 0.0
        if W.moves[i] and t >= W.duration:
            W.q_now[i] += W.way[i]
        elif W.moves[i]:
            gone, v, a = state_after(W.times[i], W.jerks[i], t, W.v[i], W.a[i])
            W.q_now[i], W.v_now[i], W.a_now[i] = W.q[i] + gone, v, a


@jit
def effort_at(K: Any, A: Any, W: Any) -> float:
    """The largest share of a motor's limit that holds the arm at ``q_now``, and whose it is."""
    n, most = K.chain.n, 0.0
    for i in range(n):
        A.state.q[i], A.state.v[i] = W.q_now[i], 0.0
    forward_kinematics(A, A.state)
    motion(A, A.state)
    dynamics(A, A.state)
    for i in range(n):
        share = abs(A.kinematics.h[i]) / K.limits.tau_max[i] if W.moves[i] else 0.0
        if share > most:
            most, W.worst = share, i
    return most


@rare_jit
def _end_sooner(K: Any, A: Any, W: Any) -> bool:
    """Let the ways end at the last place up to which motors hold the arm; False where they do all the way."""
    n, least = K.chain.n, STRONG
    for k in range(PLACES):
        look_up(W, n, W.duration * k / (PLACES - 1))
        share = effort_at(K, A, W)
        if k == 0:
            least = max(least, share)
        elif share > least:
            W.heavy = W.worst
            for i in range(n):
                W.far[i] = W.q_now[i]
            look_up(W, n, W.duration * (k - 1) / (PLACES - 1))
            for i in range(n):
                W.near[i] = W.q_now[i]
            for fine in range(1, FINER + 1):
                for i in range(n):
                    W.way[i] = W.q_now[i] - W.q[i]
                    W.q_now[i] = W.near[i] + (W.far[i] - W.near[i]) * fine / FINER
                if fine == FINER or effort_at(K, A, W) > least:
                    return True
    return False


@rare_jit
def plan_going(K: Any, A: Any, W: Any, goes: int) -> None:
    """Plan the motion from the last command: to the goal, to rest soonest, or to rest together."""
    state, limits, n, stands, limited = K.state, K.limits, K.chain.n, True, False
    W.duration = 0.0
    for i in range(n):
        W.moves[i] = K.faults.code[i] == HEALTHY
        W.q[i], W.v[i], W.a[i] = state.q_command[i], state.v_command[i], state.a_command[i]
        top = min(limits.v_max[i], ENDLESS)
        W.slow[i], W.v_max[i] = SPEED_DEVIATION * top, min(W.speed * SPEED_SHARE * limits.v_max[i], ENDLESS)
        W.a_max[i] = ACCELERATION_SHARE * max(limits.a_brake[i], W.least[i])
        place = min(max(W.q[i] + way_from(K, W, i, W.q[i]), limits.q_min[i]), limits.q_max[i])
        W.way[i] = place - W.q[i] if W.moves[i] else 0.0
        stands = stands and not (W.moves[i] and abs(W.v[i]) > AT_REST * top)
        limited = limited or (W.moves[i] and limits.tau_max[i] < LARGE)
    if stands and goes == GOES:  # so that the motion is straight
        for i in range(n):
            W.v[i] = W.a[i] = 0.0
    if goes != GOES:
        _brake(K, W, n, goes == RESTS_TOGETHER)
        return
    _go(W, n)
    if not W.looks and W.heavy < 0:
        return
    W.looks, W.heavy = 0, -1
    for _ in range(NEARER_ENDS if limited else 0):
        if not _end_sooner(K, A, W):
            return
        _go(W, n)
    if limited:
        _brake(K, W, n, False)


@jit
def wait_anew(W: Any) -> None:
    """The arm is waited for to come nearer, from now on."""
    W.best, W.since, W.lately = LARGE, 0, 0


@jit
def judge_going(K: Any, W: Any) -> int:
    """Whether the arm, as measured, rests at its goal or as near as it gets, goes on, or is restless."""
    commanded = off = fast = 0.0
    failed, working = False, False
    for i in range(K.chain.n):
        works = K.faults.code[i] == HEALTHY
        if works:
            commanded = max(commanded, abs(way_from(K, W, i, K.state.q_command[i])))
        if works or K.faults.code[i] == BRAKING:
            fast = max(fast, abs(K.state.v_command[i]) / min(K.limits.v_max[i], 1.0 / AT_REST))
        if W.counts[i]:
            left = abs(way_from(K, W, i, K.feedback.seen[i])) / W.tolerance
            off = max(off, left)
            failed, working = failed or (left > 1.0 and not works), working or (left > 1.0 and works)
    W.lately = W.lately + 1 if fast < SLOW_SHARE else 0
    rests: int = GOING_REACHED if off <= 1.0 else GOING_UNREACHABLE
    if commanded <= EXACT and fast < AT_REST and (off <= 1.0 or (failed and not working)):
        return rests
    distance = max(commanded / W.tolerance, off)
    if distance < W.best - COMES_NEARER * min(W.best, 1.0 + distance):
        W.best, W.since = distance, 0
        return GOING_MOVING
    W.since += 1
    if min(W.since, W.lately) * K.state.dt > PATIENCE:
        return rests
    return GOING_RESTLESS if W.since * K.state.dt > RESTLESS_PATIENCE else GOING_MOVING


@jit
def _believes_anew(K: Any, W: Any) -> bool:
    """Whether something else is believed of a joint, its limits or the load than a tick ago.

    A load that is learned while the arm moves comes nearer to what it is in every look, and is no news.
    """
    limits, chain, learned, news = K.limits, K.chain, K.learned, False
    for i in range(chain.n):
        learns = learned.based and i == chain.tip_joint
        mass = learned.base_mass if learns else chain.mass[i]
        com = three(learned.base_com) if learns else three(chain.com[i])
        now = (
            float(K.faults.code[i]), limits.q_min[i], limits.q_max[i], limits.v_max[i], limits.a_brake[i],
            limits.tau_max[i], mass, com[0], com[1], com[2],
        )  # fmt: skip
        for k in range(10):
            news = news or W.known[i, k] != now[k]
            W.known[i, k] = now[k]
    return news


@jit
def begin_anew(K: Any, W: Any) -> None:
    """Forget what was planned and seen on the way, and ask for the whole task."""
    W.begun, W.looks, W.heavy, W.state = -1, 1, -1, GOING_MOVING
    W.plays, W.thinks, W.blocked, W.rate, W.stood = 0, 0, 0, 1.0, 0.0
    wait_anew(W)
    if W.whole:
        K.task.late = 0
        if K.task.given_up:
            keep_rows(K.task, K.terms, K.qp, 0)


@jit
def begins_anew(K: Any, W: Any) -> bool:
    """Whether a joint has failed or works again, or something else has led the planner: all begins anew."""
    news = _believes_anew(K, W)
    if W.ticks == K.state.ticks and not news:
        return False
    begin_anew(K, W)
    W.ticks = K.state.ticks
    return True
