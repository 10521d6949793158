"""A task that is a path: its rate as one more variable of the QP, and how the progress goes on."""

from math import cos, inf, sin, sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    SCALE,
    TARGET_ACCELERATION,
    TARGET_HAS_ROTATION,
    TARGET_TWIST,
)
from ftqp.kernel.layout.flat_arrays import BEGIN, ORIENTATION, POSITION, SPIN, STOP, TURN
from ftqp.kernel.layout.thresholds import SINGULAR_FROM, TIME_SLACK
from ftqp.kernel.maths.linear_systems import plus_products
from ftqp.kernel.rows.joint_intervals import bound, braking_velocity, draw
from ftqp.kernel.rows.task_rows import SCALE_WEIGHT, component_of

SEPARATION = 1e4
"""1 - s costs SCALE_WEIGHT times the largest value of the objective, but a residual as large as the path's
own speed costs SEPARATION times that ..."""
PUSH, LEAST_SEPARATION = 1e2, 1e2
"""... but no less than PUSH times what the scheme gains by waiting, down to this separation. The weights make
an order (docs/theory/path-progress.md, "The rows"), because each is a hundred times the next or more; that
the powers of ten do is measured in tests/papers/test_bedrossian1993_scaling.py."""
NO_WAY = 3e-6
"""What is left of a path is not waited for where it is shorter than this share of the length: some
micrometres, because slow paths did not end in settling with 1e-7."""
STIFFNESS = 1e-10
"""Compliance of the rows, as a share of the QP's own magnitude."""
LEAST_WEIGHT = 1e-12
"""Least cost of 1 - s, as a share of the objective's largest value: the QP stays strictly convex. Four digits
above rounding."""
RISE = 0.1
"""Acceleration level: the rate approaches 1 with this time constant [s]."""

STOP_SHARE = 0.5
"""Share of the acceleration limits that slowing down may use. The other half is left for what the bend takes
(docs/theory/path-progress.md, "How fast the rate may be")."""
NEAR_SINGULAR = 0.2
"""Where in settling a singular value is below this [characteristic lengths] ..."""
STOP_SHARE_NEAR = 0.8
"""... this is the share for coming down to the rate of a bend, what the bend itself takes included
(docs/theory/path-progress.md, "How fast the rate may be")."""
BEND_SHARE = 0.5
"""Share of the acceleration limits that the bend of the path may use. The other half is that of STOP_SHARE,
because both act at once."""
FOLLOWS_BEND = 0.02
"""The rate rises to the limit of a bend with this time constant [s], and falls by half of the way in a tick.
The limit depends on what the rate moves: with half of the way both ways the two went to and fro at 2 and 5 ms
(docs/theory/path-progress.md, "How fast the rate may be")."""

BEFORE_STOP = 0.8
"""Beside its path the tip goes as far as this share of the emergency stop's thresholds at most, ..."""
BESIDE_RISE = 0.5
"""... and the path, which does not wait for it then, comes to its full rate in this time [s]."""
LEAST_RATE = 0.1
"""Below this rate a joint's motion is not taken for that of the path alone ..."""
LEAST_SETTLING = 0.01
"""... in settling, which leaves little other motion; so the bend is braked down to there."""


@part_jit
def path_rows(K: Any, path: Any) -> None:
    """The task's rows with the path rate s, 0 <= s <= 1, as the last variable, so that s = 0 waits.

    velocity level:      J v - s x' = kp e
    acceleration level:  J a - x' s/dt = x'' sigma'^2 - x' sigma'/dt - Jdot v + kv (x' sigma' - J v) + kp e

    At the acceleration level s is the rate after the step and sigma'' = (s - sigma')/dt. The feedback is
    never scaled. It needs ``task_rows``.
    Source: Bedrossian 1993, extended as in docs/theory/path-progress.md, "The rows".
    """
    state, kinematics, task, qp = K.state, K.kinematics, K.task, K.qp
    n = K.chain.n
    task.beyond = 0.0
    for k in range(task.m):
        c = task.rows[k]
        w = task.row_scale[c]
        e = w * component_of(task, kinematics, c, 0, task.error)
        rate = w * component_of(task, kinematics, c, TARGET_TWIST, task.target)
        change = w * component_of(task, kinematics, c, TARGET_ACCELERATION, task.target)
        drift = w * component_of(task, kinematics, c, 0, kinematics.drift)
        moving = 0.0
        if state.level == ACCELERATION:
            moving = plus_products(moving, qp.A[k], state.v, n)
            s = path.rate
            qp.A[k, n] = -rate / state.dt
            qp.b[k] = (
                change * s * s - rate * s / state.dt + task.kv * (rate * s - moving) + task.kp * e - drift
            )
            task.beyond = max(task.beyond, abs(qp.A[k, n]) * task.kv * state.dt)
        else:
            qp.A[k, n] = -rate
            qp.b[k] = task.kp * e
            task.beyond = max(task.beyond, abs(rate))
        qp.b[k] += w * component_of(task, kinematics, c, 0, K.feedback.push)
        path.feedback[k] = task.kp * e if path.limit > 0.0 else qp.b[k] + task.kv * moving
        own = max(path.rate, LEAST_SETTLING if K.settling.on else LEAST_RATE)
        path.bend[k] = change - drift / (own * own)


@jit
def _braking(state: Any, faults: Any, limits: Any, path: Any) -> float:
    """How fast the rate can fall [1/s] with STOP_SHARE of the acceleration limits; inf at rest."""
    brake = inf
    for k in range(faults.working):
        i = faults.order[k]
        if abs(state.v[i]) > 1e-9 * limits.a_max[i] * state.dt:
            brake = min(brake, STOP_SHARE * limits.a_max[i] * max(path.rate, LEAST_RATE) / abs(state.v[i]))
    return brake


@jit
def _limit_before_jump(state: Any, path: Any, brake: float) -> float:
    """The largest rate from which the arm can stop, in whole steps, before the path's twist jumps."""
    ahead = path.stop - path.progress
    if state.level == ACCELERATION:
        ahead -= 0.5 * state.dt * path.rate  # of this step already
    if not (ahead < inf and brake < inf):
        return 1.0
    return min(1.0, braking_velocity(max(ahead, 0.0), brake, state.dt))


@jit
def _limit_in_bend(K: Any, path: Any) -> float:
    """The largest rate at which BEND_SHARE of the acceleration limits hold the arm on the path's bend.

    At a constant rate s the joints accelerate by s^2 c, c = J_f^+ (x'' - Jdot q'), q' = v/sigma', with the
    damped inverse: sqrt(min BEND_SHARE a_max_i/|c_i|). The rest of the limits is left for slowing down. The
    rate goes down half of the way to that, as c is that of the rate before, and up dt/FOLLOWS_BEND of it, and
    comes down no faster than min_i STOP_SHARE a_max_i sigma'/|v_i|. In settling s^2 |c_i| adds to the share
    where it is along v_i, as what speeds a joint up towards a singularity has to be braked, too; near one the
    share may be STOP_SHARE_NEAR a_max_i + s^2 c_i sign(v_i). It needs the singular directions of
    ``fade_feedback``, and diag(sigma) V' in ``scratch.wide``.
    """
    limits, faults, task, turned, scratch, v = K.limits, K.faults, K.task, K.turned, K.scratch, K.state.v
    m = task.m
    floor = (task.length * SINGULAR_FROM) ** 2
    for k in range(m):
        s = plus_products(0.0, turned.U[:, k], path.bend, m)
        scratch.rows[k] = s / (turned.sigma[k] * turned.sigma[k] + floor)
    limit, brake = 1.0, inf
    own = max(path.rate, LEAST_SETTLING if K.settling.on else LEAST_RATE)
    least = inf
    for k in range(m):
        least = min(least, turned.sigma[k])
    for column in range(faults.working):
        i = faults.order[column]
        c = plus_products(0.0, scratch.wide[:, column], scratch.rows, m)
        if limit * limit * abs(c) > BEND_SHARE * limits.a_max[i]:
            limit = sqrt(BEND_SHARE * limits.a_max[i] / abs(c))
        if abs(v[i]) > 1e-9 * limits.a_max[i] * K.state.dt:
            share = STOP_SHARE * limits.a_max[i]
            if K.settling.on:
                along = own * own * (c if v[i] > 0.0 else -c)
                share += max(along, 0.0)
                if least < NEAR_SINGULAR * task.length:
                    share = max(share, STOP_SHARE_NEAR * limits.a_max[i] + along)
            brake = min(brake, share * own / abs(v[i]))
    if limit < 1.0:
        share = 0.5 if limit < path.rate else min(0.5, K.state.dt / FOLLOWS_BEND)
        limit = path.rate + share * (limit - path.rate)
    return max(limit, path.rate - brake * K.state.dt) if brake < inf else limit


@jit
def _gain_of_waiting(faults: Any, task: Any, qp: Any, turned: Any, speed: float) -> float:
    """What the objective falls by at most, to first order, when s goes from 1 to 0.

    x' makes the joints move by J^+ x', against the slope g of the objective: |x'| |g|/sigma_min. It counts
    where a scheme draws the joints somewhere, as rmp does: on a slow path it exceeds |x'|^2.
    """
    slope, least = 0.0, inf
    for k in range(task.m):
        least = min(least, turned.sigma[k])
    for column in range(faults.working):
        g = qp.g[faults.order[column]]
        slope += g * g
    return sqrt(speed * slope) / max(least, SINGULAR_FROM * task.length)


@jit
def _rate_beside(state: Any, task: Any, watch: Any, path: Any) -> float:
    """The least rate where the tip may be beside its path: min(1, 2 - 2 e), e the error by what it may be.

    Source: docs/theory/ways-out.md, "Beside the path".
    """
    room, turn = path.aside, path.aside / task.length
    if watch.stop_samples > 0:
        room = min(room, BEFORE_STOP * watch.stop_position)
        turn = min(turn, BEFORE_STOP * watch.stop_rotation)
    e = max(watch.last_position_error / room, watch.last_rotation_error / turn)
    return min(1.0, max(0.0, 2.0 - 2.0 * e), path.rate + state.dt / BESIDE_RISE)


@jit
def rate_variable(K: Any, path: Any) -> None:
    """The variable s: its interval, and its cost between those of the residual and of the rates.

    1/2 w (1 - s)^2 with w = SCALE_WEIGHT times the objective's largest value, or |x'|^2/(SEPARATION soft) if
    that is less: on a slow path a residual of the path's own speed must not come cheaper than waiting. Where
    that in turn is less than PUSH times what the scheme gains by waiting, w is that, but not in settling,
    whose rows are soft. The last NO_WAY of a path that comes to rest is not waited for.
    Acceleration level: s is drawn to sigma' + (1 - sigma') dt/RISE; at the end, where nothing waits, to 1.
    """
    limits, state, qp = K.limits, K.state, K.qp
    n = K.chain.n
    size = speed = 0.0
    for i in range(n):
        reach = min(limits.a_max[i], 1e3) if state.level == ACCELERATION else min(limits.v_max[i], 1e3)
        size += (qp.H[i, i] if qp.dense else qp.H_diagonal[i]) * reach * reach
    speed = plus_products(speed, qp.A[:, n], qp.A[:, n], K.task.m)
    weight = SCALE_WEIGHT * size
    if state.level == ACCELERATION:
        weight *= (RISE / state.dt) ** 2  # s is drawn by the share dt/RISE of 1 - sigma' only
    if speed > 0.0:
        push = 0.0 if K.settling.on else PUSH * _gain_of_waiting(K.faults, K.task, qp, K.turned, speed)
        if state.level == ACCELERATION:
            push *= RISE / state.dt
        weight = min(weight, speed / (SEPARATION * qp.soft[0]))
        weight = max(weight, min(push, speed / (LEAST_SEPARATION * qp.soft[0])), LEAST_WEIGHT * size)
    wanted = 1.0
    if state.level == ACCELERATION and path.progress < path.end:
        wanted = path.rate + (1.0 - path.rate) * min(1.0, state.dt / RISE)
    for i in range(n):
        qp.H[i, n] = qp.H[n, i] = 0.0
    brake = _braking(state, K.faults, limits, path)
    path.ahead = _limit_before_jump(state, path, brake)
    slowest = path.rate - brake * state.dt if brake < inf else 0.0
    in_bend = _limit_in_bend(K, path)
    allowed = K.feedback.rate * K.feedback.speed  # the path waits for an arm that lags
    draw(qp, n, weight, wanted)
    qp.H[n, n] = weight
    low, high = 0.0, min(path.limit, path.left, path.ahead, in_bend, max(allowed, slowest))
    if path.aside > 0.0:
        low = min(_rate_beside(state, K.task, K.watch, path), path.limit, path.ahead, max(allowed, slowest))
        high = max(low, high)
    pace = sqrt(speed) * (state.dt if state.level == ACCELERATION else 1.0)
    if pace * (path.end - path.progress) < NO_WAY * K.task.length:
        low = max(0.0, high)
    bound(qp, n, low, high)
    qp.nx = n + 1


@jit
def _rate_of_motion(task: Any, kinematics: Any, chain: Any, v: Any) -> float:
    """The share of the path's twist that J v makes, within [0, 1]; 1 where the path rests."""
    along = square = 0.0
    for k in range(task.m):
        c = task.rows[k]
        x = task.target[TARGET_TWIST + c] * task.row_scale[c]
        square += x * x
        for i in range(chain.n):
            along += x * task.row_scale[c] * kinematics.J[c, i] * v[i]
    return min(max(along / square, 0.0), 1.0) if square > 0.0 else 1.0


@part_jit
def begin_on_path(K: Any, path: Any) -> None:
    """The first step along a path: the rate is that of the measured motion."""
    if path.rate < 0.0:
        path.rate = _rate_of_motion(K.task, K.kinematics, K.chain, K.state.v)


@jit
def advance(state: Any, task: Any, kinematics: Any, chain: Any, qp: Any, path: Any) -> None:
    """sigma += s dt, or dt (sigma' + s)/2 at the acceleration level."""
    n = chain.n
    before = max(path.rate, 0.0)
    on_task = task.mode == SCALE and qp.nx > n
    s = min(max(qp.x[n], 0.0), 1.0) if on_task else _rate_of_motion(task, kinematics, chain, state.v_command)
    step = state.dt * (0.5 * (before + s) if state.level == ACCELERATION else s)
    after = path.progress + step
    if after > path.stop - TIME_SLACK:
        after = max(path.stop, path.progress) if after < path.stop + TIME_SLACK else after
    path.rate = s
    path.progress = min(after, path.end)
    if path.end - path.progress < TIME_SLACK:
        path.progress = path.end


@jit
def sample(row: Any, progress: float, target: Any) -> None:
    """Fill in pose, twist x' and acceleration x'' of the path at ``progress`` within one interval.

    The position is a polynomial; R = exp(turn) R_begin with Rodrigues' formula. ``target`` is packed.
    """
    t = progress - row[BEGIN]
    for r in range(3):
        p = POSITION + r
        c0, c1, c2, c3, c4, c5 = row[p], row[p + 3], row[p + 6], row[p + 9], row[p + 12], row[p + 15]
        target[4 * r + 3] = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
        target[TARGET_TWIST + r] = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))
        target[TARGET_ACCELERATION + r] = 2.0 * c2 + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5))
        s = SPIN + r
        d0, d1, d2, d3 = row[s], row[s + 3], row[s + 6], row[s + 9]
        target[TARGET_TWIST + 3 + r] = d0 + t * (d1 + t * (d2 + t * d3))
        target[TARGET_ACCELERATION + 3 + r] = d1 + t * (2.0 * d2 + t * 3.0 * d3)
    x = t * (row[TURN] + t * (row[TURN + 3] + t * row[TURN + 6]))
    y = t * (row[TURN + 1] + t * (row[TURN + 4] + t * row[TURN + 7]))
    z = t * (row[TURN + 2] + t * (row[TURN + 5] + t * row[TURN + 8]))
    square = x * x + y * y + z * z
    angle = sqrt(square)
    a = sin(angle) / angle if angle > 1e-6 else 1.0 - square / 6.0
    b = (1.0 - cos(angle)) / square if angle > 1e-4 else 0.5 - square / 24.0
    for c in range(3):
        r0, r1, r2 = row[ORIENTATION + c], row[ORIENTATION + 3 + c], row[ORIENTATION + 6 + c]
        u0, u1, u2 = y * r2 - z * r1, z * r0 - x * r2, x * r1 - y * r0
        target[c] = r0 + a * u0 + b * (y * u2 - z * u1)
        target[4 + c] = r1 + a * u1 + b * (z * u0 - x * u2)
        target[8 + c] = r2 + a * u2 + b * (x * u1 - y * u0)
    target[12] = target[13] = target[14] = 0.0
    target[15] = 1.0
    target[TARGET_HAS_ROTATION] = 1.0


@part_jit
def look_up(path: Any, table: Any, rows: int, target: Any) -> None:
    """The path's target at the progress that has been reached."""
    k = min(max(path.interval, 0), rows - 1)
    while k > 0 and table[k, BEGIN] > path.progress:
        k -= 1
    while k < rows - 1 and table[k + 1, BEGIN] <= path.progress:
        k += 1
    path.interval = k
    path.stop = table[k, STOP]
    path.end = table[rows - 1, BEGIN]
    sample(table[k], path.progress, target)
