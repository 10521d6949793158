"""Poses by Newton steps: how far the tip is from one, postures brought to it, and back into a tube."""

from math import acos, atan2, inf, sin, sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import mimic_places
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.maths.vectors import cross, inner, length
from ftqp.kernel.search.looks import pose_arm

SPACING = 0.05
"""In a tube the tip is looked at in places no farther apart than this [rad or m]."""
EXACT = 1e-14
"""A squared error below this is none [m2]. Rounding."""
STEPS, LONGEST = 40, 0.7
"""Newton steps of a start, and the longest of them [rad or m]. Guesses."""


@jit
def _turn_error(K: Any, T: Any, e: Any) -> None:
    """The turn of the tip from a pose, times a length; of its z axis alone along the axes of the pose."""
    W, R = K.ways, K.ahead.R_tip
    if W.has_axis:
        tip, goal = (R[2], R[5], R[8]), (T[2], T[6], T[10])
        turn = cross(goal, tip)
        sine = length(turn)
        f = W.length * (atan2(sine, inner(tip, goal)) / sine if sine > 0.0 else 1.0)
        for k in range(3):
            e[3 + k] = f * inner((T[k], T[4 + k], T[8 + k]), turn)
        return
    c = w0 = w1 = w2 = 0.0
    for i in range(3):
        r0, r1, r2 = R[3 * i], R[3 * i + 1], R[3 * i + 2]
        d0 = r0 * T[0] + r1 * T[1] + r2 * T[2]
        d1 = r0 * T[4] + r1 * T[5] + r2 * T[6]
        d2 = r0 * T[8] + r1 * T[9] + r2 * T[10]
        c += d0 if i == 0 else (d1 if i == 1 else d2)
        w0 += 0.0 if i == 0 else (-d2 if i == 1 else d1)
        w1 += d2 if i == 0 else (0.0 if i == 1 else -d0)
        w2 += -d1 if i == 0 else (d0 if i == 1 else 0.0)
    t = acos(min(max(0.5 * (c - 1.0), -1.0), 1.0))
    f = W.length * (0.5 * t / sin(t) if 1e-6 < t < 3.14159 else (0.5 if t < 1.0 else 1.0))
    e[3], e[4], e[5] = f * w0, f * w1, f * w2


@jit
def tip_error(K: Any, T: Any) -> None:
    """The way of the tip from a pose, (6,): place, and turn times a length."""
    e, o = K.ways.e, K.ahead.o_tip
    for i in range(3):
        e[i] = o[i] - T[4 * i + 3]
    _turn_error(K, T, e)


@jit
def tip_rows(K: Any, T: Any) -> None:
    """The Jacobian of ``tip_error`` over the joints that work, (6, n); other columns are zero."""
    W, J = K.ways, K.ahead.J
    for j in range(K.chain.n):
        f = 1.0 if W.free[j] else 0.0
        for i in range(3):
            W.A[i, j] = f * J[i, j]
            turn = J[3 + i, j]
            if W.has_axis:
                turn = T[i] * J[3, j] + T[4 + i] * J[4, j] + T[8 + i] * J[5, j]
            W.A[3 + i, j] = f * W.length * turn


@jit
def _joint_step(W: Any, rows: int, j: int) -> float:
    s = 0.0
    for i in range(6):
        s -= W.A[i, j] * W.M[i, 6] if rows >> i & 1 else 0.0
    return s


@jit
def newton_step(K: Any, q: Any, rows: int, damping: float, longest: float) -> None:
    """A damped Newton step in some rows, within limits: (A A' + damping) y = e, dq = -A'y.

    A joint that stands at its limit and would go beyond is left out, and the step is made again.
    """
    W, n, M, held = K.ways, K.chain.n, K.ways.M, 0
    for _ in range(3):
        for i in range(6):
            for k in range(i, 6):
                s = 0.0
                for j in range(n):
                    s += 0.0 if held >> j & 1 else W.A[i, j] * W.A[k, j]
                M[i, k] = s if rows >> i & 1 and rows >> k & 1 else 0.0
            if rows >> i & 1:
                M[i, i] += damping
                M[i, 6] = W.e[i]
            else:
                M[i, i], M[i, 6] = 1.0, 0.0
        for i in range(6):  # Cholesky, the upper triangle, the right side with it
            for k in range(i, 7):
                s = M[i, k]
                for p in range(i):
                    s -= M[p, i] * M[p, k]
                M[i, k] = sqrt(max(s, 1e-18)) if k == i else s / M[i, i]
        for i in range(5, -1, -1):
            s = M[i, 6]
            for k in range(i + 1, 6):
                s -= M[i, k] * M[k, 6]
            M[i, 6] = s / M[i, i]
        most, more = 0.0, held
        for j in range(n):
            s = _joint_step(W, rows, j) if W.free[j] and not held >> j & 1 else 0.0
            most = max(most, abs(s))
            if (s > 0.0 and q[j] >= W.q_max[j]) or (s < 0.0 and q[j] <= W.q_min[j]):
                more |= 1 << j
        if more == held:
            break
        held = more
    share = min(1.0, longest / most) if most > 0.0 else 0.0
    for j in range(n):
        if W.free[j] and not held >> j & 1:
            q[j] = min(max(q[j] + share * _joint_step(W, rows, j), W.q_min[j]), W.q_max[j])
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
