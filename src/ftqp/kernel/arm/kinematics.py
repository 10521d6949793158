"""Kinematics of a chain or a tree; world axes, twists linear then angular at the tip's origin.

Joints that mimic others: q_m = ratio q_l + offset, so that the leader's column carries what they move.

A mimic joint stays a joint of the tree: kinematics, drift and the torques of its body are as of any other.
What is linear in accelerations is folded: with a = E a', column l of J E is J_l + ratio J_m, M becomes E'M E
and h E'h. The mimic joint's own column is then zero, and its command is the image of its leader's.
Source: docs/theory/joint-limits.md, "Joints that mimic others".
"""

from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.maths.side_by_side import WIDTH, joint_sines, lane_mask
from ftqp.kernel.maths.vectors import ZERO, Vector, cross, minus, plus, rotated, three, times, write


@jit
def moves(chain: Any, joint: int, body: int) -> bool:
    """Whether a body moves with a joint: it is on the way from the base to it."""
    return (chain.ancestors[body] >> joint) & 1 != 0


@jit
def turned(kinematics: Any, body: int, x: Any) -> Vector:
    """A vector of a joint's frame along W; of the base where there is no joint."""
    return three(x) if body < 0 else rotated(kinematics.R[body], three(x))


@jit
def point_of(kinematics: Any, body: int, x: Any) -> Vector:
    """A point of a joint's frame in W."""
    p = turned(kinematics, body, x)
    return p if body < 0 else plus(p, three(kinematics.o[body]))


@jit
def point_column(kinematics: Any, chain: Any, joint: int, p: Vector) -> Vector:
    """Column of a joint in the Jacobian of a point that moves with it: z x (p - o), or z where it slides."""
    z = three(kinematics.axis_w[joint])
    return z if chain.prismatic[joint] else cross(z, minus(p, three(kinematics.o[joint])))


@jit
def point_drift(kinematics: Any, chain: Any, body: int, p: Vector) -> Vector:
    """Jdot v of a point of a body, given in W; needs ``motion``."""
    w, r = three(kinematics.w[body]), minus(p, three(kinematics.o[body]))
    turning = cross(three(kinematics.alpha[body]), r)
    at_origin = plus(three(kinematics.acc[body]), three(chain.gravity))
    return plus(plus(at_origin, turning), cross(w, cross(w, r)))


@jit
def fold_row(chain: Any, row: Any) -> None:
    """Columns of joints that mimic others are added to those of their leaders."""
    for m in range(chain.n):
        l = chain.lead[m]
        if l != m:
            row[l] += chain.ratio[m] * row[m]
            row[m] = 0.0


@jit
def fold_square(chain: Any, S: Any, own: float) -> None:
    """E'S E of a square matrix of the joints, with ``own`` on the diagonal of those that mimic others."""
    for m in range(chain.n):
        l = chain.lead[m]
        if l == m:
            continue
        ratio = chain.ratio[m]
        for i in range(chain.n):
            S[i, l] += ratio * S[i, m]
            S[i, m] = 0.0
        for j in range(chain.n):
            S[l, j] += ratio * S[m, j]
            S[m, j] = 0.0
        S[m, m] = own


@jit
def spread_by(chain: Any) -> float:
    """By how much folding makes the norm of a square matrix grow at most: |E|^2 <= 1 + sum ratio^2."""
    most = 1.0
    for m in range(chain.n):
        if chain.lead[m] != m:
            most += chain.ratio[m] * chain.ratio[m]
    return most


@jit
def fold_columns(kinematics: Any, chain: Any) -> None:
    """J with folded columns; ``J_each`` keeps each joint's own, which second derivatives need."""
    J, each = kinematics.J, kinematics.J_each
    for k in range(6):
        for i in range(chain.n):
            each[k, i] = J[k, i]
        fold_row(chain, J[k])


@jit
def columns(kinematics: Any, chain: Any) -> Any:
    """The tip's Jacobian with a column for every joint by itself."""
    return kinematics.J_each if chain.mimics else kinematics.J


@jit
def followers(chain: Any, at: int) -> Any:
    """Which of the joints at .. at + 7 mimic others: what may leave of those is decided by their leaders."""
    which = lane_mask(0, at)
    for m in range(at, min(at + WIDTH, chain.n)):
        if chain.lead[m] != m:
            which = which | (lane_mask(m + 1, at) & ~lane_mask(m, at))
    return which


@jit
def mimic(chain: Any, x: Any) -> None:
    """Velocities, accelerations or steps of joints that mimic others, from those of their leaders."""
    for m in range(chain.n):
        if chain.lead[m] != m:
            x[m] = chain.ratio[m] * x[chain.lead[m]]


@jit
def mimic_places(chain: Any, q: Any) -> None:
    """The same of places."""
    for m in range(chain.n):
        if chain.lead[m] != m:
            q[m] = chain.ratio[m] * q[chain.lead[m]] + chain.offset[m]


@part_jit
def forward_kinematics(K: Any, state: Any) -> None:
    """T_i = T_parent (rotation_i, translation_i) Rz(q_i), or Tz(q_i) for a prismatic joint; the tip; J."""
    joint_sines(state, K.kinematics, K.chain)
    frames(state, K.kinematics, K.chain)
    jacobian(K.kinematics, K.chain)


@part_jit
def tip_of(K: Any, state: Any) -> None:
    """The same without J, which stays that of another state."""
    joint_sines(state, K.kinematics, K.chain)
    frames(state, K.kinematics, K.chain)


@jit
def _frame(
    kinematics: Any, body: int
) -> tuple[float, float, float, float, float, float, float, float, float, float, float, float]:
    """Rotation and origin of a joint's frame, or those of the base."""
    if body < 0:
        return 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
    R, o = kinematics.R[body], kinematics.o[body]
    return R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8], o[0], o[1], o[2]


@jit
def frames(state: Any, kinematics: Any, chain: Any) -> None:
    """Every joint's frame and the tip, from the sines and cosines of the joints."""
    n = chain.n
    # the frame before, in registers; at first that of the base
    x0 = y1 = z2 = 1.0
    x1 = x2 = y0 = y2 = z0 = z1 = o0 = o1 = o2 = 0.0
    for i in range(n):
        if chain.parent[i] != i - 1:
            x0, x1, x2, y0, y1, y2, z0, z1, z2, o0, o1, o2 = _frame(kinematics, chain.parent[i])
        P = chain.rotation[i]
        s, c = kinematics.sine[i], kinematics.cosine[i]
        # rotation_i Rz(q_i) first: it does not wait for the frames before
        L0, L1, L3, L4 = c * P[0] + s * P[1], c * P[1] - s * P[0], c * P[3] + s * P[4], c * P[4] - s * P[3]
        L6, L7 = c * P[6] + s * P[7], c * P[7] - s * P[6]
        L2, L5, L8 = P[2], P[5], P[8]
        t0, t1, t2 = chain.translation[i, 0], chain.translation[i, 1], chain.translation[i, 2]
        o0 = o0 + x0 * t0 + x1 * t1 + x2 * t2
        o1 = o1 + y0 * t0 + y1 * t1 + y2 * t2
        o2 = o2 + z0 * t0 + z1 * t1 + z2 * t2
        x0, x1, x2 = x0 * L0 + x1 * L3 + x2 * L6, x0 * L1 + x1 * L4 + x2 * L7, x0 * L2 + x1 * L5 + x2 * L8
        y0, y1, y2 = y0 * L0 + y1 * L3 + y2 * L6, y0 * L1 + y1 * L4 + y2 * L7, y0 * L2 + y1 * L5 + y2 * L8
        z0, z1, z2 = z0 * L0 + z1 * L3 + z2 * L6, z0 * L1 + z1 * L4 + z2 * L7, z0 * L2 + z1 * L5 + z2 * L8
        if chain.prismatic[i]:
            o0, o1, o2 = o0 + state.q[i] * x2, o1 + state.q[i] * y2, o2 + state.q[i] * z2
        R, o, axis = kinematics.R[i], kinematics.o[i], kinematics.axis_w[i]
        R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8] = x0, x1, x2, y0, y1, y2, z0, z1, z2
        o[0], o[1], o[2] = o0, o1, o2
        axis[0], axis[1], axis[2] = x2, y2, z2
    if chain.tip_joint != n - 1:
        x0, x1, x2, y0, y1, y2, z0, z1, z2, o0, o1, o2 = _frame(kinematics, chain.tip_joint)
    P, R = chain.tip_rotation, kinematics.R_tip
    t0, t1, t2 = chain.tip_translation[0], chain.tip_translation[1], chain.tip_translation[2]
    for k in range(3):
        R[k] = x0 * P[k] + x1 * P[3 + k] + x2 * P[6 + k]
        R[3 + k] = y0 * P[k] + y1 * P[3 + k] + y2 * P[6 + k]
        R[6 + k] = z0 * P[k] + z1 * P[3 + k] + z2 * P[6 + k]
    p0 = o0 + x0 * t0 + x1 * t1 + x2 * t2
    p1 = o1 + y0 * t0 + y1 * t1 + y2 * t2
    p2 = o2 + z0 * t0 + z1 * t1 + z2 * t2
    kinematics.o_tip[0], kinematics.o_tip[1], kinematics.o_tip[2] = p0, p1, p2


@jit
def jacobian(kinematics: Any, chain: Any) -> None:
    """J of the tip, from the frames."""
    J, p = kinematics.J, three(kinematics.o_tip)
    for i in range(chain.n):
        if not moves(chain, i, chain.tip_joint):
            J[0, i] = J[1, i] = J[2, i] = J[3, i] = J[4, i] = J[5, i] = 0.0
            continue
        axis = three(kinematics.axis_w[i])
        if chain.prismatic[i]:
            J[0, i], J[1, i], J[2, i] = axis
            J[3, i] = J[4, i] = J[5, i] = 0.0
        else:
            J[0, i], J[1, i], J[2, i] = cross(axis, minus(p, three(kinematics.o[i])))
            J[3, i], J[4, i], J[5, i] = axis
    if chain.mimics:
        fold_columns(kinematics, chain)


@part_jit
def motion(K: Any, state: Any) -> None:
    """w, alpha and the acceleration of the origin of every frame, at zero joint acceleration.

    The base is given the acceleration -gravity, as in the recursive Newton-Euler algorithm; ``drift``, (6,),
    is the tip's classical acceleration Jdot v, in which that offset is taken back.
    """
    chain, kinematics = K.chain, K.kinematics
    n, rest = chain.n, times(-1.0, three(chain.gravity))
    w, alpha, a, o = ZERO, ZERO, rest, ZERO
    for i in range(n + 1):
        above = chain.parent[i] if i < n else chain.tip_joint
        origin = three(kinematics.o[i]) if i < n else three(kinematics.o_tip)
        if above != i - 1:  # a branch: go on from where it hangs
            w, alpha, a = ZERO, ZERO, rest
            if above >= 0:
                w, alpha = three(kinematics.w[above]), three(kinematics.alpha[above])
                a, o = three(kinematics.acc[above]), three(kinematics.o[above])
        if above >= 0:  # a += alpha x r + w x (w x r)
            r = minus(origin, o)
            a = plus(a, plus(cross(alpha, r), cross(w, cross(w, r))))
        o = origin
        if i < n:
            axis, v = three(kinematics.axis_w[i]), state.v[i]
            turning = cross(w, axis)
            if chain.prismatic[i]:  # Coriolis: 2 w x z v
                a = plus(a, times(2.0 * v, turning))
            else:
                alpha, w = plus(alpha, times(v, turning)), plus(w, times(v, axis))
            write(kinematics.w[i], 0, w)
            write(kinematics.alpha[i], 0, alpha)
            write(kinematics.acc[i], 0, a)
    write(kinematics.drift, 0, plus(a, three(chain.gravity)))
    write(kinematics.drift, 3, alpha)
