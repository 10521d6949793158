"""What to do about a free-swinging joint: a share of the search each tick.

    brake -> pose, position + axis, position: rest posture, gain, rollout; the first that passes is held
          -> else the look-ahead, until the joint is calm or its time is over -> hold still

Source: docs/theory/free-swinging.md, "Decision".
"""

from math import inf
from typing import Any

from ftqp.kernel.arm.dynamics import knows_no_gravity
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.free.end_stop import end_stops, free_motion, rest_on_stops
from ftqp.kernel.free.holding import (
    LENIENCE,
    ROLLOUT_STEPS,
    SETTLED,
    begin_gain,
    begin_rollout,
    begin_start,
    finish_gain,
    go_on_doubling,
    led,
    roll_on,
    seek,
    take_nearest,
)
from ftqp.kernel.free.look_ahead import (
    BOUNDARY,
    LONG_STEPS,
    ROLLOUTS,
    begin_judging,
    begin_plan,
    braking_is_safe,
    look_ahead,
    planned,
    search,
    shift_plan,
    weigh_holding,
)
from ftqp.kernel.free.swinging import HARMLESS, WORTH, braked, mark_places, viscous_friction
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.latches.settling import latch, slow_enough
from ftqp.kernel.layout.enums import (
    ARREST,
    DECIDE,
    FOLLOW,
    HOLD,
    NO_GAIN,
    NO_POSTURE,
    NOT_REFUSED,
    NOTHING_KEPT,
    OK,
    POSE_KEPT,
    POSITION_KEPT,
    RELAXED,
    STILL,
    STOPPED,
    STOPPED_BY_FREE_JOINT,
    STOPPING,
    TARGET_TWIST,
    VELOCITY,
)
from ftqp.kernel.layout.other_records import STARTS
from ftqp.kernel.layout.thresholds import FREE_SHARE, HANGS
from ftqp.kernel.maths.elementary import is_finite
from ftqp.kernel.maths.linear_systems import plus_products
from ftqp.kernel.rows.failed_joints import sort_joints
from ftqp.kernel.rows.joint_intervals import draw

SEEK, GAIN, DOUBLE, ROLL = 0, 1, 2, 3
"""Items of the decision."""
WORK = 160
"""Work of a tick of the decision, in evaluations of the dynamics, 0.5 us each on a core of 2026, ..."""
WATCH_WORK = 70
"""... and of one tick in which the arm's way is rolled out again."""
ITERATION_WORK, DOUBLING_WORK, MODEL_WORK = 1, 25, 25
"""What an iteration of the rest posture, one of the Riccati equation, and the linear model count."""
SLICE = 20
"""Iterations of the rest posture, or steps of a rollout, between two looks at what work is left."""
BRAKING_TIME = 0.4
"""The tip is to be held where it comes to rest after so much time [s]."""
NEAR = 0.03
"""A target that is nearer to the tip than this is what is to be held [m]."""

SEARCH_TIME, MORE_TIME, LONGEST_SEARCH = 1.0, 0.1, 3.5
"""How long the look-ahead goes on, how much longer each time while to hold still would be worse by then than
it was when the joint failed, and until when at most [s]."""
DAMPED = 0.5
"""Viscous friction below this is little [N m s/rad]."""
REPEAT = 0.05
"""The rollout of an arm that is led is repeated so often [s]."""
SETTLING_SWING = 0.02
"""A free joint that swings no farther than this is calm [rad or m]."""
RETRY = 0.1
"""A posture in which the free joint can rest is looked for so often [s] ..."""
LONGER = 0.3
"""... and for so long after the search [s]."""
LED_FOR, LED_FOR_UNDAMPED = 1.2, 4.5
"""So long after the task was given up the others rest where the free joint still swings [s] ..."""
LEFT_SWING = 0.2
"""... and, with little friction, no farther than this [rad or m]: it would swing so for long. Without the
second an arm let a balanced joint tip over when its time was over."""
HARDER = 0.1
"""Speed that following a task may add to an impact [rad/s or m/s]. Holding the tip by turning the free joint
speeds that up without end near some postures (docs/theory/free-swinging.md, "Decision")."""


@jit
def _next_rows(K: Any, F: Any, above: int) -> None:
    """The next smaller set of rows that is allowed, from where the arm is now; none: the look-ahead."""
    rows = above - 1
    while rows > NOTHING_KEPT and not (int(K.free.allowed) >> rows) & 1:
        rows -= 1
    if rows == NOTHING_KEPT:
        begin_arrest(K, F)
        return
    _begin_rows(K.faults, K.chain, F, rows)


@jit
def _begin_rows(faults: Any, chain: Any, F: Any, rows: int) -> None:
    """Begin the decision on a set of rows."""
    F.rows, F.stage, F.starts, F.found = rows, SEEK, 0, 0
    for j in range(chain.n):
        F.start[j], F.start_v[j] = F.q[j], F.v[j]
    begin_start(faults, chain, F, 0)


@jit
def _try_next(K: Any, F: Any, refusal: int) -> None:
    """The next rest posture of these rows; none: the next rows."""
    F.refused[F.rows] = refusal
    if take_nearest(K.chain, F):
        F.stage = GAIN
    elif F.calming:
        F.calming, F.recheck = 0, RETRY
    else:
        _next_rows(K, F, F.rows)


@jit
def _latch(watch: Any) -> None:
    """The task is given up until somebody says that it goes on."""
    if watch.latched == 0:
        latch(watch, STOPPED_BY_FREE_JOINT)


@jit
def begin_arrest(K: Any, F: Any) -> None:
    """Give the task up; the arm is latched. Where an impact would harm nobody the others hold still."""
    made_so = K.free.mode == FOLLOW
    K.free.mode, K.free.rows = ARREST, NOTHING_KEPT
    _latch(K.watch)
    F.calming, F.recheck, F.given_up = 0, 0.0, 0.0
    F.left = SEARCH_TIME
    begin_plan(F, K.chain.n)
    begin_judging(K, F)
    if F.held_energy < HARMLESS and not made_so:
        hold_still(K.free, F)


@jit
def _aim(state: Any, task: Any, kinematics: Any, chain: Any, F: Any) -> None:
    """Where the tip is to be held: where the target, or a tip far from it, comes to rest within 0.4 s."""
    far = 0.0
    for r in range(3):
        d = task.target[4 * r + 3] - kinematics.o_tip[r]
        far += d * d
    near = far <= NEAR * NEAR  # not so if it is not finite
    half = 0.5 * BRAKING_TIME
    for r in range(3):
        moving = plus_products(0.0, kinematics.J[r], state.v, chain.n)
        F.goal[r] = kinematics.o_tip[r] + half * moving
        if near and is_finite(task.target[TARGET_TWIST + r]):
            F.goal[r] = task.target[4 * r + 3] + half * task.target[TARGET_TWIST + r]
        for c in range(3):
            F.goal_rotation[3 * r + c] = kinematics.R_tip[3 * r + c]
            if near and task.uses_rotation:
                F.goal_rotation[3 * r + c] = task.target[4 * r + c]


@jit
def begin(K: Any, F: Any) -> None:
    """The first tick with this fault, or after a reset."""
    free, faults, n = K.free, K.faults, K.chain.n
    F.joint = faults.order[faults.working]
    F.dt = K.state.dt
    F.period = max(2, int(BOUNDARY / F.dt + 0.5))
    free.joint, free.rows, free.impact_side = F.joint, NOTHING_KEPT, 0
    free.swing = free.reach = free.drift = 0.0
    free.drift_time = inf
    begin_plan(F, n)
    F.clear_for = 0
    F.left = 0.0
    F.calming = 0
    for rows in range(len(F.refused)):
        F.refused[rows] = NOT_REFUSED
    forward_kinematics(K, K.supposed)
    mark_places(K.kinematics, n, F)
    F.held_reach, F.held_energy = inf, 0.0
    single = faults.movable == faults.working + 1
    if single and knows_no_gravity(K.kinematics, K.chain, F.joint):
        free.mode = FOLLOW
        F.borne, F.since = -1.0, REPEAT
    elif not single or faults.working == 0:
        free.mode = STILL
        _latch(K.watch)
    elif K.watch.latched:
        begin_arrest(K, F)
    else:
        free.mode = DECIDE
        _aim(K.state, K.task, K.kinematics, K.chain, F)
        begin_judging(K, F)
        _next_rows(K, F, POSE_KEPT + 1)


@jit
def _decide(K: Any, F: Any) -> None:
    """Some items of the decision, no more than a tick has time for."""
    work = WORK
    while work > 0 and (K.free.mode == DECIDE or F.calming):
        if F.stage == SEEK:
            before = F.iteration
            done = seek(K, F, SLICE)
            work -= ITERATION_WORK * (F.iteration - before + 1)
            if done:
                F.starts += 1
                if F.starts < STARTS:
                    begin_start(K.faults, K.chain, F, F.starts)
                else:
                    _try_next(K, F, NO_POSTURE)
        elif F.stage == GAIN:
            work -= MODEL_WORK
            F.stage = DOUBLE
            if not begin_gain(K, F):
                _try_next(K, F, NO_GAIN)
        elif F.stage == DOUBLE:
            work -= DOUBLING_WORK
            change = go_on_doubling(K.faults, F)
            if change < SETTLED:
                finish_gain(K.faults, K.limits, F)
                begin_rollout(K.chain, F)
                F.stage = ROLL
            elif not change < inf:
                _try_next(K, F, NO_GAIN)
        else:
            work -= SLICE
            refusal = roll_on(K, F, SLICE, 1.0)
            if refusal != NOT_REFUSED:
                _try_next(K, F, refusal)
            elif F.roll_step >= ROLLOUT_STEPS:
                K.free.mode, K.free.rows = HOLD, F.rows
                F.since, F.rolling, F.calming = 0.0, 0, 0


@jit
def hold_still(free: Any, F: Any) -> None:
    """The search is over; what lies ahead is looked at now and then, to be reported."""
    F.left = 0.0
    free.mode = STILL
    F.period = max(F.period, int(REPEAT / F.dt + 0.5))
    F.countdown = 0


@jit
def _may_rest(K: Any, F: Any) -> bool:
    """Whether the others may rest: the free joint stays off its stops, and it hangs or its time is over."""
    damped = viscous_friction(K.faults, K.chain, F.joint) >= DAMPED
    over = F.given_up >= (LED_FOR if damped else LED_FOR_UNDAMPED)
    if not over and abs(F.v[F.joint]) > HANGS:
        return False
    for j in range(K.chain.n):
        F.base_q[j], F.base_v[j] = F.q[j], F.v[j]
    if not braking_is_safe(K, F):
        return damped and over and weigh_holding(K, F)[1] < WORTH
    return (damped and over) or F.highest - F.lowest < (LEFT_SWING if over else SETTLING_SWING)


@jit
def _watch(K: Any, F: Any) -> None:
    """While the arm is led: roll it out again every 50 ms, and give up where it would not get there."""
    F.since += F.dt
    if not F.rolling and F.since >= REPEAT:
        if K.watch.latched and _may_rest(K, F):
            hold_still(K.free, F)
            return
        F.since, F.rolling = 0.0, 1
        begin_rollout(K.chain, F)
    if F.rolling:
        refusal = roll_on(K, F, WATCH_WORK, LENIENCE)
        if F.roll_step >= ROLLOUT_STEPS:
            F.rolling = 0
        if refusal != NOT_REFUSED:
            F.refused[F.rows] = refusal
            begin_arrest(K, F)


@jit
def _arrest(K: Any, F: Any) -> None:
    """The look-ahead, until it is safe to hold still."""
    damped = viscous_friction(K.faults, K.chain, F.joint) >= DAMPED
    F.recheck -= F.dt
    if F.calming:
        _decide(K, F)
        return
    boundary = F.countdown <= 0
    if boundary and F.left <= 0.0 and F.given_up < LONGEST_SEARCH:
        for j in range(K.chain.n):
            F.base_q[j], F.base_v[j] = F.q[j], F.v[j]
        if weigh_holding(K, F)[1] <= F.held_energy:
            hold_still(K.free, F)
            return
        F.left = MORE_TIME
    for _ in range(ROLLOUTS):
        search(K, F)
        if boundary and (F.quiet or F.left <= 0.0):
            break
    F.countdown -= 1
    if not boundary or not (F.quiet or F.left <= 0.0):
        return
    if braking_is_safe(K, F) and (damped or F.highest - F.lowest < SETTLING_SWING):
        hold_still(K.free, F)
    elif F.recheck <= 0.0:
        F.calming = 1
        _begin_rows(K.faults, K.chain, F, NOTHING_KEPT)
    elif F.left <= -LONGER:
        hold_still(K.free, F)


@jit
def _drift(faults: Any, limits: Any, kinematics: Any, chain: Any, free: Any, F: Any) -> None:
    """A joint without gravity: its speed (M_i: v) / M_ii once the others rest, and when it meets its stop."""
    # the last tick's M is one tick old, which is near enough for a message
    M, i = kinematics.M, F.joint
    if not M[i, i] > 0.0:
        return
    momentum = plus_products(0.0, M[i], F.v, chain.n)
    free.drift = momentum / M[i, i]
    room = limits.q_max[i] - F.q[i] if free.drift > 0.0 else F.q[i] - limits.q_min[i]
    free.drift_time = inf
    if abs(free.drift) > 1e-4 and room < inf:
        friction = viscous_friction(faults, chain, i)
        way = inf if friction == 0.0 else abs(momentum) / friction
        if way > room:
            free.drift_time = room / abs(free.drift)


@jit
def _go_on_following(K: Any, F: Any) -> None:
    """A joint without gravity: the task is given up before it makes an impact harder."""
    _drift(K.faults, K.limits, K.kinematics, K.chain, K.free, F)
    F.since -= F.dt
    if F.since > 0.0 or K.watch.latched:
        return
    for j in range(K.chain.n):
        F.base_q[j], F.base_v[j] = F.q[j], F.v[j]
    look_ahead(K, F, 0.0, 0.0, inf, LONG_STEPS)
    if F.borne < 0.0:
        F.borne = max(abs(K.free.drift), F.impact_speed)
    F.since = REPEAT
    if F.impact_speed > F.borne + HARDER:
        begin_arrest(K, F)


@part_jit
def search_step(K: Any, F: Any) -> None:
    """This tick's share of the search, in the rooms for a supposed state and the kinematics."""
    state, supposed, n = K.state, K.supposed, K.chain.n
    for j in range(n):
        if not (is_finite(state.q[j]) and is_finite(state.v[j])):
            return
        F.q[j], F.v[j] = supposed.q[j], supposed.v[j] = state.q[j], state.v[j]
    sort_joints(K.faults, K.chain)
    for k in range(K.faults.working, K.faults.movable):
        i = K.faults.order[k]
        if K.free.contact[i]:
            F.v[i] = 0.0  # an observer that knows no stop takes its time to see that
    given_up = K.free.mode == ARREST or K.free.mode == STILL
    if state.ticks == 1 or K.free.joint < 0 or (given_up and K.watch.latched == 0):
        begin(K, F)
    if K.free.mode == DECIDE and K.watch.latched:
        begin_arrest(K, F)
    mode = K.free.mode
    F.given_up += F.dt
    if mode == FOLLOW:
        _go_on_following(K, F)
    elif mode == DECIDE:
        _decide(K, F)
    elif mode == HOLD:
        _watch(K, F)
    elif mode == ARREST:
        _arrest(K, F)
    elif K.faults.movable == K.faults.working + 1 and K.faults.working > 0:
        search(K, F)
        F.countdown -= 1
    if K.free.mode == ARREST and mode != ARREST:
        search(K, F)  # what lies ahead is reported at once
    rest_on_stops(state, K.faults, K.free)


REACHED, ATTAINED = 0.01, 0.05
"""A tip that is nearer to its target than this counts as there [m] and [rad]."""


@jit
def _wanted(state: Any, faults: Any, limits: Any, kinematics: Any, free: Any, F: Any) -> None:
    """The accelerations of the healthy joints into ``F.a``."""
    mode, dt = free.mode, state.dt
    if mode == HOLD:
        led(state, faults, limits, kinematics, F, dt)
    for k in range(faults.working):
        j = faults.order[k]
        if mode == ARREST:
            F.a[j] = planned(state, limits, F, j, F.phase, F.left, dt)
        elif mode != HOLD:
            F.a[j] = braked(state, limits, j, dt)


@jit
def ask_for_motion(K: Any, F: Any) -> None:
    """1/2 |x - x_wanted|^2 over box, torque rows and end stop; needs ``begin_rest`` and the rows of C."""
    faults, state, qp = K.faults, K.state, K.qp
    _wanted(state, faults, K.limits, K.kinematics, K.free, F)
    for k in range(faults.working):
        j = faults.order[k]
        x = F.a[j] if state.level != VELOCITY else state.v[j] + state.dt * F.a[j]
        F.x[j] = x
        draw(qp, j, 1.0, x)
    for k in range(faults.working, K.chain.n):
        j = faults.order[k]
        F.x[j] = qp.lb[j] if k >= faults.movable else (state.v[j] if state.level == VELOCITY else 0.0)
    end_stops(K, F.x)
    for k in range(faults.working, faults.movable):
        i = faults.order[k]
        draw(qp, i, FREE_SHARE, free_motion(K.chain, qp, i, F.x) if qp.lb[i] < qp.ub[i] else 0.0)
    if K.free.mode == ARREST:
        F.left -= F.dt
        shift_plan(F, K.chain.n)


@jit
def outcome_beside_free(K: Any) -> int:
    """STOPPING and STOPPED where the task is given up, OK where nothing of it is, else RELAXED."""
    limits, faults, state, task, free = K.limits, K.faults, K.state, K.task, K.free
    if K.watch.latched:
        if free.mode == ARREST:
            return STOPPING
        slow = slow_enough(K)
        for k in range(faults.movable if free.mode == HOLD else faults.working):
            j = faults.order[k]
            top = limits.v_max[j] if limits.v_max[j] < inf else 1.0
            if abs(state.v[j]) > slow * top:
                return STOPPING
        K.watch.stopped = 1
        return STOPPED
    whole = free.rows == POSE_KEPT or (free.rows == POSITION_KEPT and not task.uses_rotation)
    whole = whole or (free.rows > POSITION_KEPT and task.tool_rows)
    near = task.position_error <= REACHED and task.rotation_error <= ATTAINED
    return OK if free.mode == HOLD and whole and near and not K.feedback.lagging else RELAXED
