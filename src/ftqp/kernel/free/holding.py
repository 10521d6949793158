"""Holding the tip: linear feedback to a rest posture, and the rollout that says whether it will get there.

Source: docs/theory/free-swinging.md, "Keeping the task".
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.dynamics import gravity_torque
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.arm.pose_error import turn_between
from ftqp.kernel.free.swinging import (
    ROLLOUT_STEP,
    braked,
    farthest,
    is_worth,
    swing_on,
    sync_model,
    viscous_friction,
    within_limits,
)
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import (
    AXIS_KEPT,
    NOT_REFUSED,
    NOTHING_KEPT,
    OFF_IN_THE_END,
    OFF_THE_WAY,
    POSE_KEPT,
    STOP_TOUCHED,
    TOO_WEAK,
)
from ftqp.kernel.maths.linear_systems import (
    assign,
    begin_doubling,
    double,
    factor,
    plus_products,
    solve_factored,
)
from ftqp.kernel.maths.vectors import ZERO, column, cross, inner, minus, rotated, times, write

WEIGHT_Q, WEIGHT_Q_FREE = 4.0, 0.5
WEIGHT_V, WEIGHT_V_FREE = 0.05, 0.3
"""What distances [1/rad2] and speeds [s2/rad2] of the healthy joints and of the free one cost ..."""
WEIGHT_TIP = 400.0
"""... a metre of the tip [1/m2] ..."""
EFFORT = 10.0
"""... and an acceleration of a_max (docs/theory/free-swinging.md, "Keeping the task")."""
POLE_SHIFT = 1e-3
"""Taken from the diagonal of the positions [1/s]. So that a pole at zero is a stable one, and the equation
has a solution."""
SPRING, DASHPOT = 1e-2, 1e-3
"""Added to the free joint [N m/rad and N m s/rad]: the equation has a solution where gravity is weak, too."""
RATE = 6.0
"""Rate of the doubling, of the size of the closed loop's eigenvalues [1/s]. Any rate leads to the same P,
because the doubling is exact: the nearer to those eigenvalues, the fewer doublings."""
SETTLED = 1e-9
"""Relative change of P from which it counts as found. The feedback then has nine digits, more than the model,
so that further doublings are rounding."""
DOUBLINGS = 25
"""Of the Riccati equation, at most; some eight are usual."""
ROLLOUT_STEPS = 200
"""Steps of the rollout: two seconds."""
END_ERROR = 0.02
"""Distance of the tip from its goal at the rollout's end up to which the task counts as kept [m] ..."""
WAY_ERROR = 0.10
"""... by how much it may be farther on the way than at its begin [m] ..."""
END_SPEED = 0.3
"""... and speed of the free joint at the end up to which it counts as led to rest [rad/s or m/s]."""
STUCK, STICKS = 0.02, 0.9
"""Coulomb friction holds a joint slower than this [rad/s] against this share of itself."""
OVERCOME = 0.8
"""Share of the free joint's Coulomb friction that is made up for: what is learned of it may be too much."""
LENIENCE = 2.0
"""While the arm is being led, both may be so much larger before it is given up. Two thresholds, so that an
arm near the first does not go to and fro between both."""


@jit
def begin_gain(K: Any, F: Any) -> bool:
    """The arm's linear model about the rest posture, and the doubling's start; False where it has none.

    x = (q - q*, v), u = a_h:  v_i' = -(grad g_i (q - q*) + d v_i + M_ih u) / M_ii.
    """
    faults, limits, supposed, kinematics = K.faults, K.limits, K.supposed, K.kinematics
    i, w = F.joint, faults.working
    n = w + 1
    for j in range(K.chain.n):
        supposed.q[j], supposed.v[j] = F.rest[j], 0.0
    assign(F.moving, faults.order, w)
    F.moving[w] = i
    sync_model(K)
    gravity_torque(kinematics, K.chain, i, F.slope)
    A, G, H, J = F.A, F.G, F.H, kinematics.J
    inertia = kinematics.M[i, i]
    for a in range(2 * n):
        for b in range(2 * n):
            A[a, b] = G[a, b] = H[a, b] = 0.0
    for a in range(n):
        j = F.moving[a]
        A[a, n + a] = 1.0
        A[a, a] = -POLE_SHIFT
        A[2 * n - 1, a] = -(F.slope[j] + (SPRING if a == w else 0.0)) / inertia
        H[a, a] = WEIGHT_Q_FREE if a == w else WEIGHT_Q
        H[n + a, n + a] = WEIGHT_V_FREE if a == w else WEIGHT_V
        for b in range(n):
            s = plus_products(0.0, J[:, j], J[:, F.moving[b]], 3)
            H[a, b] += WEIGHT_TIP * s if F.rows != NOTHING_KEPT else 0.0
    A[2 * n - 1, 2 * n - 1] = -(viscous_friction(faults, K.chain, i) + DASHPOT) / inertia
    total = 0.0
    for a in range(w):
        j = F.moving[a]
        F.column[a] = -kinematics.M[i, j] / inertia
    for a in range(w):
        cheap = limits.a_max[F.moving[a]] * limits.a_max[F.moving[a]] / EFFORT
        G[n + a, n + a] = cheap
        G[n + a, 2 * n - 1] = G[2 * n - 1, n + a] = cheap * F.column[a]
        total += cheap * F.column[a] * F.column[a]
    G[2 * n - 1, 2 * n - 1] = total
    for a in range(w):
        F.step[a] = F.column[a]  # the column of inputs of the free joint, kept for the gain
    F.iteration = 0
    return begin_doubling(A, G, H, F.W, F.S, F.V, 2 * n, RATE, F.pivots, F.column)


@jit
def go_on_doubling(faults: Any, F: Any) -> float:
    """One iteration of the Riccati equation: its relative change, inf where it has no solution."""
    n = 2 * (faults.working + 1)
    F.iteration += 1
    if F.iteration > DOUBLINGS:
        return inf
    return double(F.A, F.G, F.H, F.W, F.S, F.V, n, F.pivots, F.column)


@jit
def finish_gain(faults: Any, limits: Any, F: Any) -> None:
    """K = R^-1 B' P."""
    w = faults.working
    n = w + 1
    for a in range(w):
        top = limits.a_max[F.moving[a]]
        for b in range(2 * n):
            F.gain[a, b] = top * top / EFFORT * (F.H[n + a, b] + F.step[a] * F.H[2 * n - 1, b])
    total = 0.0
    for a in range(w):
        top = limits.a_max[F.moving[a]]
        F.lever[a] = top * top * F.step[a]
        total += F.lever[a] * F.step[a]
    for a in range(w):
        F.lever[a] = F.lever[a] / total if total > 0.0 else 0.0


@jit
def _sticks(v: float, h: float, mu: float) -> float:
    """How surely Coulomb friction holds the free joint, in [0, 1], without a jump that noise could use."""
    if mu == 0.0:
        return 0.0
    slow = min(max(2.0 - abs(v) / STUCK, 0.0), 1.0)
    return slow * min(max((1.0 - abs(h) / mu) / (1.0 - STICKS), 0.0), 1.0)


@jit
def led(state: Any, faults: Any, limits: Any, kinematics: Any, F: Any, dt: float) -> None:
    """u = clip(-K x + l mu sgn v_i/M_ii) at the record's state: what the healthy joints do, into ``F.a``.

    The second part makes up for the Coulomb friction of the free joint, which linear feedback does not know:
    else it would go to and fro about the rest posture for ever. All brake where that friction holds it.
    """
    w, i = faults.working, F.joint
    n, mu, v = w + 1, faults.coulomb[i], state.v[i]
    stuck = _sticks(v, kinematics.h[i], mu)
    helped = OVERCOME * mu * min(max(v / STUCK, -1.0), 1.0) / kinematics.M[i, i]
    for a in range(w):
        k = F.moving[a]
        u = helped * F.lever[a]
        for b in range(n):
            j = F.moving[b]
            u -= F.gain[a, b] * (state.q[j] - F.rest[j]) + F.gain[a, n + b] * state.v[j]
        if stuck > 0.0:
            u += stuck * (braked(state, limits, k, dt) - u)
        F.a[k] = within_limits(state, limits, k, u, dt)


@jit
def begin_rollout(chain: Any, F: Any) -> None:
    """From where the arm is now."""
    for j in range(chain.n):
        F.roll_q[j], F.roll_v[j] = F.q[j], F.v[j]
    F.roll_step = 0


@jit
def roll_on(K: Any, F: Any, steps: int, lenience: float) -> int:
    """So many more steps under the gain: the refusal when the task is not kept, 0 so far so good.

    It is kept when no stop is touched, no torque limit is exceeded, the tip goes no farther from its goal
    than it began by WAY_ERROR, in the end it is near and the free joint slow. Without rows the tip is free.
    And no link goes farther than if the others held still by more than WAY_ERROR, unless that avoids an
    impact.
    """
    supposed, kinematics, n = K.supposed, K.kinematics, K.chain.n
    for j in range(n):
        supposed.q[j], supposed.v[j] = F.roll_q[j], F.roll_v[j]
    for _ in range(steps):
        led(supposed, K.faults, K.limits, kinematics, F, ROLLOUT_STEP)
        sync_model(K)
        away = 0.0
        for r in range(3):
            d = kinematics.o_tip[r] - F.goal[r]
            away += d * d
        away = sqrt(away) if F.rows != NOTHING_KEPT else 0.0
        if F.roll_step == 0:
            F.way = away
        spared = lenience * WAY_ERROR if F.rows != NOTHING_KEPT else 0.0
        if away > F.way + lenience * WAY_ERROR or not is_worth(
            F, sqrt(farthest(kinematics, n, F)), 0.0, spared
        ):
            return OFF_THE_WAY
        impact, share = swing_on(supposed, K.faults, K.limits, kinematics, K.chain, F, ROLLOUT_STEP)
        if impact > 0.0:
            return STOP_TOUCHED
        if share > lenience:
            return TOO_WEAK
        F.roll_step += 1
        if F.roll_step >= ROLLOUT_STEPS:
            slow = abs(supposed.v[F.joint]) <= END_SPEED
            return NOT_REFUSED if slow and away <= lenience * END_ERROR else OFF_IN_THE_END
    for j in range(n):
        F.roll_q[j], F.roll_v[j] = supposed.q[j], supposed.v[j]
    return NOT_REFUSED


TORQUE_UNIT = 10.0
"""A torque of so many N m counts as a metre ..."""
TURN_LENGTH = 0.3
"""... and a radian as so many, because a posture is found by least squares over all three: it ends where all
are zero, so that they weigh only on the way there."""
COULOMB_SHARE = 0.8
"""Share of the Coulomb friction that is relied on to hold the joint. Identified friction is not that
exact."""
DAMPING = 1e-6
"""Of a Gauss-Newton step: far below the square of a singular value that matters, so that steps keep their
direction and stay finite."""
LONGEST_STEP = 0.25
"""Longest step of a joint in one iteration [rad or m]."""
MARGIN = 0.03
"""Margin to the ends of the range [rad or m]. So that the feedback has room on either side."""
ITERATIONS = 60
"""Of a search at most."""
PRECISION = 1e-5
"""Residual, in metres, from which a posture counts as found."""
APART = 0.02
"""Postures nearer to each other than this are one [rad or m]."""
RUN_UP = 0.1
"""The search begins where the arm would be after so much time at its present speed [s]."""
FREE_TRAVEL = 0.3
"""What a radian of the free joint's way costs beside the seconds of the others [s/rad] ..."""
UPRIGHT = 0.3
"""... and an unstable posture [s]."""


@jit
def begin_start(faults: Any, chain: Any, F: Any, number: int) -> None:
    """Where search ``number`` begins: the free joint where it is, or moved to either side."""
    offset = 0.0
    if number == 1 or number == 2:
        offset = 0.4
    elif number >= 3:
        offset = 0.9
    if number % 2 == 0:
        offset = -offset
    for j in range(chain.n):
        F.trial[j] = F.start[j] + RUN_UP * F.start_v[j]
    F.trial[F.joint] += offset
    for k in range(faults.movable, chain.n):
        j = faults.order[k]
        F.trial[j] = F.start[j]
    F.iteration = 0


@jit
def residual(K: Any, F: Any) -> float:
    """c = ((g_i -+ 0.8 mu)+ / 10 N m, p - p*, 0.3 e_rot) at the posture ``F.trial``, its Jacobian ``F.C``.

    e_rot is the rotation vector from the goal, or what of it turns the tool axis: then a* x a with the
    projection across a of the rotation as its gradient. The largest entry of c comes back.
    """
    faults, supposed, kinematics, n = K.faults, K.supposed, K.kinematics, K.chain.n
    assign(supposed.q, F.trial, n)
    forward_kinematics(K, K.supposed)
    c, C = F.c, F.C
    g = gravity_torque(kinematics, K.chain, F.joint, F.slope)
    held = COULOMB_SHARE * faults.coulomb[F.joint]
    over = g - held if g > held else (g + held if g < -held else 0.0)
    c[0] = over / TORQUE_UNIT
    for j in range(n):
        C[0, j] = F.slope[j] / TORQUE_UNIT if over != 0.0 else 0.0
    for r in range(3):
        c[1 + r] = kinematics.o_tip[r] - F.goal[r]
        assign(C[1 + r], kinematics.J[r], n)
    F.unknowns = 4 if F.rows != NOTHING_KEPT else 1
    if F.rows == POSE_KEPT or F.rows == AXIS_KEPT:
        F.unknowns = 7
        _rotation(K.task, kinematics, K.chain, F)
    size = 0.0
    for r in range(F.unknowns):
        size = max(size, abs(c[r]))
        for k in range(faults.movable, n):
            C[r, faults.order[k]] = 0.0
    return size


@jit
def _rotation(task: Any, kinematics: Any, chain: Any, F: Any) -> None:
    """The rotation's part of c and C."""
    R, T, a = kinematics.R_tip, F.goal_rotation, ZERO
    if F.rows == POSE_KEPT:
        e = turn_between(R, 3, T, 3)
    else:
        axis = (task.axis[2], task.axis[5], task.axis[8])
        a = rotated(R, axis)
        e = cross(rotated(T, axis), a)
    write(F.c, 4, times(TURN_LENGTH, e))
    for j in range(chain.n):
        w = column(kinematics.J, 3, j)
        turn = times(TURN_LENGTH, minus(w, times(inner(a, w), a)))
        F.C[4, j], F.C[5, j], F.C[6, j] = turn


@jit
def improve(limits: Any, chain: Any, F: Any) -> None:
    """One step of Gauss and Newton of least norm, dq = -C' (C C' + 1e-6)^-1 c, at most 0.25 rad a joint."""
    n, m = chain.n, F.unknowns
    for again in range(2):
        for a in range(m):
            for b in range(a + 1):
                F.square[a, b] = plus_products(DAMPING if a == b else 0.0, F.C[a], F.C[b], n)
            F.column[a] = -F.c[a]
        if not factor(F.square, m):
            return
        solve_factored(F.square, m, F.column)
        blocked = False
        largest = 0.0
        for j in range(n):
            s = plus_products(0.0, F.C[:, j], F.column, m)
            F.step[j] = s
            q = F.trial[j]
            if again == 0 and (
                (s > 0.0 and q >= limits.q_max[j] - MARGIN) or (s < 0.0 and q <= limits.q_min[j] + MARGIN)
            ):
                blocked = True
                F.C[:m, j] = 0.0
            largest = max(largest, abs(s))
        if not blocked:
            break
    share = LONGEST_STEP / largest if largest > LONGEST_STEP else 1.0
    for j in range(n):
        q = F.trial[j] + share * F.step[j]
        if share * F.step[j] != 0.0:
            q = min(max(q, limits.q_min[j] + MARGIN), limits.q_max[j] - MARGIN)
        F.trial[j] = q


@jit
def time_to_rest(faults: Any, limits: Any, F: Any) -> float:
    """The cost of the way to ``F.trial``: max_h max(dq/v_max, 2 sqrt(dq/a_max)) + 0.3 |dq_i|, [s].

    A posture in which gravity would carry the free joint away, d g_i/d q_i < 0, costs 0.3 more.
    """
    longest = 0.0
    for k in range(faults.working):
        j = faults.order[k]
        d = abs(F.trial[j] - F.start[j])
        longest = max(longest, d / limits.v_max[j], 2.0 * sqrt(d / limits.a_max[j]))
    longest += FREE_TRAVEL * abs(F.trial[F.joint] - F.start[F.joint])
    return longest + (UPRIGHT if F.slope[F.joint] < 0.0 else 0.0)


@jit
def _keep(faults: Any, limits: Any, chain: Any, F: Any) -> None:
    """Note the posture ``F.trial``, unless it is known."""
    for a in range(F.found):
        apart = 0.0
        for j in range(chain.n):
            apart = max(apart, abs(F.rests[a, j] - F.trial[j]))
        if apart < APART:
            return
    assign(F.rests[F.found], F.trial, chain.n)
    F.rest_costs[F.found] = time_to_rest(faults, limits, F)
    F.found += 1


@jit
def take_nearest(chain: Any, F: Any) -> bool:
    """The cheapest posture that has not been taken yet becomes ``F.rest``; whether there is one."""
    best = -1
    for a in range(F.found):
        if F.rest_costs[a] < inf and (best < 0 or F.rest_costs[a] < F.rest_costs[best]):
            best = a
    if best < 0:
        return False
    F.rest_costs[best] = inf
    assign(F.rest, F.rests[best], chain.n)
    return True


@jit
def seek(K: Any, F: Any, iterations: int) -> bool:
    """At most so many iterations of the present start; whether it is done, the posture noted."""
    for _ in range(iterations):
        size = residual(K, F)
        if not size < inf:
            return True
        if size < PRECISION:
            _keep(K.faults, K.limits, K.chain, F)
            return True
        if F.iteration >= ITERATIONS:
            return True
        improve(K.limits, K.chain, F)
        F.iteration += 1
    return False
