"""A task that is a path: where the tip should be at a progress sigma, and how the progress goes on.

A path is a table of intervals of its time; in each the position is a quintic, the rotation a cubic rotation
vector
from the interval's first orientation, the angular velocity a cubic.
"""

from math import cos, inf, sin, sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    HEALTHY,
    SCALE,
    TARGET_ACCELERATION,
    TARGET_HAS_ROTATION,
    TARGET_TWIST,
)
from ftqp.kernel.rows.joint_intervals import braking_velocity

BEGIN = 0
"""Column of a table: path time at which the interval begins [s]."""
STOP = 1
"""Column: path time of the next jump of the twist, inf if there is none."""
POSITION = 2
"""Columns: six coefficients of the position, (6, 3), by rising powers of the time since BEGIN."""
ORIENTATION = 20
"""Columns: rotation at BEGIN, by rows."""
TURN = 29
"""Columns: three coefficients of the rotation vector, powers 1 to 3, (3, 3)."""
SPIN = 38
"""Columns: four coefficients of the angular velocity, (4, 3)."""
COLUMNS = 50

SCALE_WEIGHT = 1e3
"""1 - s costs SCALE_WEIGHT times the largest value of the objective: progress goes before rates ..."""
SEPARATION = 1e4
"""... but a residual as large as the path's own speed costs SEPARATION times that."""
STIFFNESS = 1e-10
"""Compliance of the rows, as a share of the QP's own magnitude."""
LEAST_WEIGHT = 1e-12
"""The same share of the objective's largest value is the least cost of 1 - s: the QP stays strictly
convex."""
RISE = 0.1
"""Acceleration level: the rate approaches 1 with this time constant [s]."""
STOP_SHARE = 0.5
"""Share of the acceleration limits that slowing down may use."""
BEND_SHARE = 0.5
"""Share of the acceleration limits that the bend of the path may use."""
SINGULAR_FROM = 0.02
"""Singular value (of the Jacobian in characteristic lengths) below which a direction counts as singular."""
LEAST_RATE = 0.1
"""Below this rate a joint's motion is not taken for that of the path alone."""
ARRIVED = 1e-9
"""Path times nearer to each other than this are one [s]."""


@jit
def sample(row: Any, progress: float, target: Any) -> None:
    """Pose, twist x' and acceleration x'' of the path at ``progress`` within one interval, as a packed
    target.

    R = exp(turn) R_begin with Rodrigues' formula.
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


@jit
def look_up(K: Any, table: Any, rows: int, target: Any) -> None:
    """The target at the record's progress; the step that follows is one along the path."""
    k = min(max(K.interval, 0), rows - 1)
    while k > 0 and table[k, BEGIN] > K.progress:
        k -= 1
    while k < rows - 1 and table[k + 1, BEGIN] <= K.progress:
        k += 1
    K.interval = k
    K.path_stop = table[k, STOP]
    K.path_end = table[rows - 1, BEGIN]
    sample(table[k], K.progress, target)
    K.on_path = 1


@jit
def path_row(K: Any, k: int, rate: float, change: float, moving: float, e: float, drift: float) -> None:
    """Row k with the path rate s, 0 <= s <= 1, as the last variable: J x - s x' = ..., so that s = 0 waits.

    Velocity level: J v - s x' = kp e.  Acceleration level, s the rate after the step and sigma'' = (s -
    sigma')/dt:
    J a - x' s/dt = x'' sigma'^2 - x' sigma'/dt - Jdot v + kv (x' sigma' - J v) + kp e.
    Source: Bedrossian 1993 as extended in the spec, section 8; the feedback is never scaled.
    """
    n = K.n
    if K.level == ACCELERATION:
        s = K.rate
        K.A[k, n] = -rate / K.dt
        K.b[k] = change * s * s - rate * s / K.dt + K.kv * (rate * s - moving) + K.kp * e - drift
    else:
        K.A[k, n] = -rate
        K.b[k] = K.kp * e
    K.feedback[k] = K.kp * e if K.rate_limit > 0.0 else K.b[k] + K.kv * moving
    own = max(K.rate, LEAST_RATE)
    K.bend[k] = change - drift / (own * own)


@jit
def _braking(K: Any) -> float:
    """How fast the rate can fall [1/s] with STOP_SHARE of the acceleration limits; inf at rest.

    Joint i moves by |v_i|/sigma' per unit of progress, so that is the least of STOP_SHARE a_max_i
    sigma'/|v_i|.
    """
    brake = inf
    for i in range(K.n):
        if K.fault[i] == HEALTHY and abs(K.v[i]) > 1e-9 * K.a_max[i] * K.dt:
            brake = min(brake, STOP_SHARE * K.a_max[i] * max(K.rate, LEAST_RATE) / abs(K.v[i]))
    return brake


@jit
def _limit_before_jump(K: Any, brake: float) -> float:
    """The largest rate from which the arm can still stop, in whole steps, before the twist of the path
    jumps."""
    ahead = K.path_stop - K.progress
    if K.level == ACCELERATION:
        ahead -= 0.5 * K.dt * K.rate  # of this step already
    if not (ahead < inf and brake < inf):
        return 1.0
    return min(1.0, braking_velocity(max(ahead, 0.0), brake, K.dt))


@jit
def _limit_in_bend(K: Any) -> float:
    """The largest rate at which BEND_SHARE of the acceleration limits hold the arm on the path's bend.

    At a constant rate s the joints accelerate by s^2 c, c = J_f^+ (x'' - Jdot q'), q' = v/sigma', with the
    damped
    inverse: sqrt(min BEND_SHARE a_max_i/|c_i|). The rest of the limits is left for slowing down. Needs the
    singular
    directions of ``fade_feedback``.
    """
    m = K.m
    floor = (K.length * SINGULAR_FROM) ** 2
    for k in range(m):
        s = 0.0
        for j in range(m):
            s += K.turn[j, k] * K.bend[j]
        K.t[k] = s / (K.sigma[k] * K.sigma[k] + floor)
    limit, column = 1.0, 0
    for i in range(K.n):
        if K.fault[i] == HEALTHY:
            c = 0.0
            for k in range(m):
                c += K.V[k, column] * K.t[k]
            column += 1
            if limit * limit * abs(c) > BEND_SHARE * K.a_max[i]:
                limit = sqrt(BEND_SHARE * K.a_max[i] / abs(c))
    return limit


@jit
def rate_variable(K: Any) -> None:
    """The variable s: its interval, and its cost between those of the residual and of the rates.

    1/2 w (1 - s)^2 with w = SCALE_WEIGHT times the objective's largest value, or |x'|^2/(SEPARATION soft) if
    that is
    less: on a slow path a residual of the path's own speed must not come cheaper than waiting. Acceleration
    level: s is drawn to sigma' + (1 - sigma') dt/RISE.
    """
    n = K.n
    size = speed = 0.0
    for i in range(n):
        reach = min(K.a_max[i], 1e3) if K.level == ACCELERATION else min(K.v_max[i], 1e3)
        size += (K.H[i, i] if K.dense else K.H_diagonal[i]) * reach * reach
    for k in range(K.m):
        speed += K.A[k, n] * K.A[k, n]
    weight = SCALE_WEIGHT * size
    if K.level == ACCELERATION:
        weight *= (RISE / K.dt) ** 2  # s is drawn by the share dt/RISE of 1 - sigma' only
    if speed > 0.0:
        weight = max(min(weight, speed / (SEPARATION * K.soft[0])), LEAST_WEIGHT * size)
    wanted = 1.0
    if K.level == ACCELERATION:
        wanted = K.rate + (1.0 - K.rate) * min(1.0, K.dt / RISE)
    for i in range(n):
        K.H[i, n] = K.H[n, i] = 0.0
    brake = _braking(K)
    K.rate_ahead = _limit_before_jump(K, brake)
    slowest = K.rate - brake * K.dt if brake < inf else 0.0
    in_bend = max(_limit_in_bend(K), slowest)
    K.H[n, n] = K.H_diagonal[n] = weight
    K.g[n] = -weight * wanted
    K.lb[n], K.ub[n] = 0.0, min(K.rate_limit, K.rate_left, K.rate_ahead, in_bend)
    K.nx = n + 1


@jit
def _rate_of_motion(K: Any, v: Any) -> float:
    """The share of the path's twist that J v makes, within [0, 1]; 1 where the path rests."""
    along = square = 0.0
    for k in range(K.m):
        c = K.rows[k]
        x = K.target[TARGET_TWIST + c] * K.row_scale[c]
        square += x * x
        for i in range(K.n):
            along += x * K.row_scale[c] * K.J[c, i] * v[i]
    return min(max(along / square, 0.0), 1.0) if square > 0.0 else 1.0


@jit
def begin_on_path(K: Any) -> None:
    """The first step along a path: the rate is that of the measured motion."""
    if K.rate < 0.0:
        K.rate = _rate_of_motion(K, K.v)


@jit
def advance(K: Any) -> None:
    """sigma += s dt, or dt (sigma' + s)/2 at the acceleration level; without the task, s of the motion that
    is left."""
    before = max(K.rate, 0.0)
    on_task = K.mode == SCALE and K.nx > K.n
    s = min(max(K.x[K.n], 0.0), 1.0) if on_task else _rate_of_motion(K, K.v_command)
    step = K.dt * (0.5 * (before + s) if K.level == ACCELERATION else s)
    after = K.progress + step
    if after > K.path_stop - ARRIVED:
        after = max(K.path_stop, K.progress) if after < K.path_stop + ARRIVED else after
    K.rate = s
    K.progress = min(after, K.path_end)
    if K.path_end - K.progress < ARRIVED:
        K.progress = K.path_end
    K.on_path = 0
