"""Holding the tip: linear feedback to a rest posture, and the rollout that says whether it will get there.

Source: docs/theory/free-swinging.md, "Keeping the task".
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.gravity import gravity_torque
from ftqp.kernel.free.swept import farthest, is_worth
from ftqp.kernel.free.swinging import ROLLOUT_STEP, braked, see_arm, swing_on, viscous_friction, within_limits
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import (
    NOT_REFUSED,
    NOTHING_KEPT,
    OFF_IN_THE_END,
    OFF_THE_WAY,
    STOP_TOUCHED,
    TOO_WEAK,
)
from ftqp.kernel.maths.riccati import begin_doubling, double

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
    for k in range(w):
        F.moving[k] = faults.order[k]
    F.moving[w] = i
    see_arm(K)
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
            s = 0.0
            for r in range(3):
                s += J[r, j] * J[r, F.moving[b]]
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
    """How surely Coulomb friction holds the free joint, in [0, 1]: it hardly moves, and little pulls at it.

    Between no and yes it changes evenly, so that noise does not throw the others to and fro.
    """
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
        see_arm(K)
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
