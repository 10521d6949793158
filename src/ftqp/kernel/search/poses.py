"""Poses by Newton steps: how far the tip is from one, postures brought to it, and back into a tube."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import jacobian, mimic_places
from ftqp.kernel.arm.pose_error import tool_turn, turn_between
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.maths.linear_systems import factor, solve_factored
from ftqp.kernel.maths.vectors import times, write
from ftqp.kernel.search.looks import pose_arm

SPACING = 0.05
"""In a tube the tip is looked at in places no farther apart than this [rad or m]."""
EXACT = 1e-14
"""A squared error below this is none [m2]. Rounding."""
STEPS, LONGEST = 40, 0.7
"""Newton steps of a start, and the longest of them [rad or m]. Guesses."""


@jit
def tip_error(K: Any, T: Any) -> None:
    """The way of the tip from a pose, (6,): place, and turn times a length, or that of its z axis alone."""
    W, e, R, o = K.ways, K.ways.e, K.ahead.R_tip, K.ahead.o_tip
    for i in range(3):
        e[i] = o[i] - T[4 * i + 3]
    if W.has_axis:
        write(e, 3, times(-W.length, tool_turn(R, T)))
    else:
        write(e, 3, times(W.length, turn_between(R, 3, T, 4)))


@jit
def tip_rows(K: Any, T: Any) -> None:
    """The Jacobian of ``tip_error`` over the joints that work, (6, n); other columns are zero."""
    W, J = K.ways, K.ahead.J
    jacobian(K.ahead, K.chain)
    for j in range(K.chain.n):
        f = 1.0 if W.free[j] else 0.0
        for i in range(3):
            W.A[i, j] = f * J[i, j]
            turn = J[3 + i, j]
            if W.has_axis:
                turn = T[i] * J[3, j] + T[4 + i] * J[4, j] + T[8 + i] * J[5, j]
            W.A[3 + i, j] = f * W.length * turn


@jit
def _joint_step(W: Any, j: int) -> float:
    s = 0.0
    for i in range(6):
        s -= W.A[i, j] * W.y[i]
    return s


@jit
def newton_step(K: Any, q: Any, rows: int, damping: float, longest: float) -> None:
    """A damped Newton step in some rows, within limits: (A A' + damping) y = e, dq = -A'y.

    A joint that stands at its limit and would go beyond is left out, and the step is made again.
    """
    W, n, M, y, held = K.ways, K.chain.n, K.ways.M, K.ways.y, 0
    for _ in range(3):
        for i in range(6):
            counts = rows >> i & 1
            for k in range(i + 1):
                s = 0.0
                for j in range(n):
                    s += 0.0 if held >> j & 1 else W.A[i, j] * W.A[k, j]
                M[i, k] = s if counts and rows >> k & 1 else 0.0
            M[i, i] += damping if counts else 1.0
            y[i] = W.e[i] if counts else 0.0
        if not factor(M, 6):
            return
        solve_factored(M, 6, y)
        most, more = 0.0, held
        for j in range(n):
            s = _joint_step(W, j) if W.free[j] and not held >> j & 1 else 0.0
            most = max(most, abs(s))
            if (s > 0.0 and q[j] >= W.q_max[j]) or (s < 0.0 and q[j] <= W.q_min[j]):
                more |= 1 << j
        if more == held:
            break
        held = more
    share = min(1.0, longest / most) if most > 0.0 else 0.0
    for j in range(n):
        if W.free[j] and not held >> j & 1:
            q[j] = min(max(q[j] + share * _joint_step(W, j), W.q_min[j]), W.q_max[j])
    if K.chain.mimics:
        mimic_places(K.chain, q)


@jit
def squared(W: Any, rows: int, first: int) -> float:
    """The square of the tip's error in three of its rows, as far as they count."""
    s = 0.0
    for i in range(first, first + 3):
        s += W.e[i] * W.e[i] if rows >> i & 1 else 0.0
    return s


@part_jit
def comes_to(K: Any, q: Any, T: Any) -> bool:
    """Newton steps from q to a pose in the goal's rows; whether they get there, or end within tolerances."""
    W, last = K.ways, inf
    for k in range(STEPS):
        pose_arm(K, q)
        W.looks += 1
        tip_error(K, T)
        place, turn = squared(W, W.goal_rows, 0), squared(W, W.goal_rows, 3)
        s = W.left = place + turn
        if s < EXACT:
            return True
        if k == STEPS - 1 or (k > 12 and k % 4 == 0 and s > 0.8 * last):
            within = place <= W.tolerance[0] * W.tolerance[0] and turn <= W.tolerance[1] * W.tolerance[1]
            if within or s > 1e-3:
                return within
        last = s if k % 4 == 0 else last
        tip_rows(K, T)
        newton_step(K, q, W.goal_rows, 0.05 * s + 1e-12, LONGEST)
    return False


@jit
def _outside(K: Any) -> float:
    """How far the tip is outside the tube; ``e`` becomes what is to be taken back, from the nearest pose."""
    W, o = K.ways, K.ahead.o_tip
    best, least = 0, inf
    for k in range(W.tube if W.tube > 1 else 0):
        T, d = W.tube_pose[k], 0.0
        for i in range(3):
            d += (o[i] - T[4 * i + 3]) * (o[i] - T[4 * i + 3])
        if d < least:
            best, least = k, d
    W.near_pose = best
    tip_error(K, W.tube_pose[best])
    out = 0.0
    for p in range(2):
        s = 0.0
        for i in range(3 * p, 3 * p + 3):
            W.e[i] = W.e[i] if W.rows >> i & 1 else 0.0
            s += W.e[i] * W.e[i]
        left = max(0.0, sqrt(s) - W.radius[p])
        out = max(out, left)
        for i in range(3 * p, 3 * p + 3):
            W.e[i] *= 1.01 * left / sqrt(s) if s > 0.0 else 0.0
    return out


@jit
def led_back(K: Any, q: Any) -> bool:
    """Lead q back into the tube, a little inside its wall; whether it got there."""
    W = K.ways
    for _ in range(10):
        pose_arm(K, q)
        W.looks += 1
        if _outside(K) <= 1e-6:
            return True
        tip_rows(K, W.tube_pose[W.near_pose])
        newton_step(K, q, W.rows, 1e-7, 0.3)
    return False


@part_jit
def is_in_tube(K: Any, c: Any, size: float, far: float) -> bool:
    """Whether the tip stays in the tube between the ends of a way c0 + c1 s + c2 s^2 that is so far."""
    W, count = K.ways, max(2, int(far / SPACING) + 1)
    for k in range(1, count):
        s = size * k / count
        for j in range(K.chain.n):
            W.near[j] = c[0, j] + s * (c[1, j] + s * c[2, j])
        pose_arm(K, W.near)
        W.looks += 1
        if _outside(K) > W.slack:
            return False
    return True
