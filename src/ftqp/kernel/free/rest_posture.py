"""Postures in which the free joint can rest while the tip is where it should be."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.gravity import gravity_torque
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.arm.pose_error import rotation_vector
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import AXIS_KEPT, NOTHING_KEPT, POSE_KEPT
from ftqp.kernel.maths.cholesky import factor, solve_factored

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
    for j in range(n):
        supposed.q[j] = F.trial[j]
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
        for j in range(n):
            C[1 + r, j] = kinematics.J[r, j]
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
    R, T, c, C = kinematics.R_tip, F.goal_rotation, F.c, F.C
    if F.rows == POSE_KEPT:
        e0, e1, e2 = rotation_vector(
            R[0] * T[0] + R[1] * T[1] + R[2] * T[2],
            R[0] * T[3] + R[1] * T[4] + R[2] * T[5],
            R[0] * T[6] + R[1] * T[7] + R[2] * T[8],
            R[3] * T[0] + R[4] * T[1] + R[5] * T[2],
            R[3] * T[3] + R[4] * T[4] + R[5] * T[5],
            R[3] * T[6] + R[4] * T[7] + R[5] * T[8],
            R[6] * T[0] + R[7] * T[1] + R[8] * T[2],
            R[6] * T[3] + R[7] * T[4] + R[8] * T[5],
            R[6] * T[6] + R[7] * T[7] + R[8] * T[8],
        )
        a0 = a1 = a2 = 0.0
    else:
        u0, u1, u2 = task.axis[2], task.axis[5], task.axis[8]
        a0, a1, a2 = (
            R[0] * u0 + R[1] * u1 + R[2] * u2,
            R[3] * u0 + R[4] * u1 + R[5] * u2,
            R[6] * u0 + R[7] * u1 + R[8] * u2,
        )
        b0, b1, b2 = (
            T[0] * u0 + T[1] * u1 + T[2] * u2,
            T[3] * u0 + T[4] * u1 + T[5] * u2,
            T[6] * u0 + T[7] * u1 + T[8] * u2,
        )
        e0, e1, e2 = b1 * a2 - b2 * a1, b2 * a0 - b0 * a2, b0 * a1 - b1 * a0
    c[4], c[5], c[6] = TURN_LENGTH * e0, TURN_LENGTH * e1, TURN_LENGTH * e2
    for j in range(chain.n):
        w0, w1, w2 = kinematics.J[3, j], kinematics.J[4, j], kinematics.J[5, j]
        along = a0 * w0 + a1 * w1 + a2 * w2
        C[4, j] = TURN_LENGTH * (w0 - along * a0)
        C[5, j] = TURN_LENGTH * (w1 - along * a1)
        C[6, j] = TURN_LENGTH * (w2 - along * a2)


@jit
def improve(limits: Any, chain: Any, F: Any) -> None:
    """One step of Gauss and Newton of least norm, dq = -C' (C C' + 1e-6)^-1 c, at most 0.25 rad a joint.

    A joint at the end of its range that the step would move further out takes no part in it.
    """
    n, m = chain.n, F.unknowns
    for again in range(2):
        for a in range(m):
            for b in range(a + 1):
                s = DAMPING if a == b else 0.0
                for j in range(n):
                    s += F.C[a, j] * F.C[b, j]
                F.square[a, b] = s
            F.column[a] = -F.c[a]
        if not factor(F.square, m):
            return
        solve_factored(F.square, m, F.column)
        blocked = False
        largest = 0.0
        for j in range(n):
            s = 0.0
            for a in range(m):
                s += F.C[a, j] * F.column[a]
            F.step[j] = s
            q = F.trial[j]
            if again == 0 and (
                (s > 0.0 and q >= limits.q_max[j] - MARGIN) or (s < 0.0 and q <= limits.q_min[j] + MARGIN)
            ):
                blocked = True
                for a in range(m):
                    F.C[a, j] = 0.0
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
    for j in range(chain.n):
        F.rests[F.found, j] = F.trial[j]
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
    for j in range(chain.n):
        F.rest[j] = F.rests[best, j]
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
