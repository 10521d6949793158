"""Which joint explains the residuals of all: a torque at joint j moves every joint along M^-1 e_j."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.detection_room import BANKS, SLOW
from ftqp.kernel.layout.enums import ACCELERATION_SLOW, TORQUE_SLOW
from ftqp.kernel.layout.hypotheses import SURE_OF_PUSH
from ftqp.kernel.maths.linear_systems import factor, solve_factored

MODEL_SHARE = 0.1
"""Error of the inertia's model: a residual of torque may have so much of what all joints ask of it."""


PUSH_SHARE = 0.85
"""A force at the tip explains this share of the disturbance ..."""
PUSH_BETTER = 0.3
"""... and leaves no more than this share of what the best joint leaves, because three numbers explain more
than one by themselves."""
FEWEST = 5
"""Of fewer joints three numbers explain nearly everything."""
LONGEST_PUSH = 1.0
"""A push explains a whole suspicion, because it is clearest when it begins, but for no longer [s]."""
RIDGE = 1e-6
"""Of the trace, so that a direction in which the arm is singular has a force, too: rounding."""


@jit
def factor_inertia(D: Any, K: Any) -> bool:
    """The Cholesky factor of M, for columns of its inverse."""
    for i in range(D.n):
        for j in range(i + 1):
            D.factor[i, j] = K.kinematics.M[i, j]
    return factor(D.factor, D.n)


@jit
def inverse_column(D: Any, j: int) -> None:
    """M^-1 e_j into ``column``: what a torque at joint j does to every joint."""
    for i in range(D.n):
        D.column[i] = 1.0 if i == j else 0.0
    solve_factored(D.factor, D.n, D.column)


@jit
def _louder_bank(D: Any, slow: int) -> int:
    """The bank of a residual that stands out more; ``slow`` is the residual in the slow one."""
    most, bank = -1.0, SLOW
    for b in range(BANKS):
        for i in range(D.n):
            z = 0.0 if D.blind[i] else D.excess[slow + b, i] * D.sharp[slow + b, i]
            if z > most:
                most, bank = z, b
    return bank


@jit
def _disturbance(D: Any, of_torque: bool) -> int:
    """The accelerations that need a cause, into ``odd``, and their bank: M^-1 r, or d."""
    if of_torque:
        b = _louder_bank(D, TORQUE_SLOW)
        for i in range(D.n):
            D.odd[i] = 0.0 if D.blind[i] else D.x[TORQUE_SLOW + b, i]
        solve_factored(D.factor, D.n, D.odd)
        return b
    b = _louder_bank(D, ACCELERATION_SLOW)
    for i in range(D.n):
        D.odd[i] = D.d[b, i]
    return b


@jit
def by_direction(D: Any, of_torque: bool) -> tuple[int, bool]:
    """The joint j whose motion, along u_j = M^-1 e_j, explains most of the disturbance y; both over rooms.

    With the torque known the explained share is (u_j . y)^2/(|u_j|^2 |y|^2). Else the loops of the others
    answer, and that of joint j may be gone: its own part is free, (y_j^2 + (u' . y')^2/|u'|^2)/|y|^2 with
    the others' parts y' and u'. The second value says whether y is beyond its rooms.
    """
    b = D.bank = _disturbance(D, of_torque)
    total = 0.0
    for i in range(D.n):
        y = 0.0 if D.blind[i] else D.odd[i] * D.sharp[ACCELERATION_SLOW + b, i]
        total += y * y
    best, most = -1, -1.0
    for j in range(D.n):
        D.score[j] = 0.0
        if D.blind[j]:
            continue
        inverse_column(D, j)
        along = length = own = 0.0
        for i in range(D.n):
            if not D.blind[i]:
                u = D.column[i] * D.sharp[ACCELERATION_SLOW + b, i]
                y = D.odd[i] * D.sharp[ACCELERATION_SLOW + b, i]
                if i == j and not of_torque:
                    own = y * y
                else:
                    along += u * y
                    length += u * u
        if total > 0.0:
            D.score[j] = (own + (along * along / length if length > 0.0 else 0.0)) / total
        if D.score[j] > most:
            best, most = j, D.score[j]
    return best, total > 1.0


@jit
def is_push(D: Any, K: Any, best: float) -> bool:
    """Whether a force at the tip explains the disturbance y, and no single joint does.

    A torque at joint j moves every joint along M^-1 e_j, a force f at the tip along M^-1 J' f, three columns.
    They have to explain 85 % of |y|^2, y over its rooms, and to leave a third at most of what the best joint
    leaves, ``best`` being what that explains. ``odd`` is y.
    Source: docs/theory/detection.md, "Touches".
    """
    J, b, n = K.kinematics.J, D.bank, D.n
    total, seen = 0.0, 0
    for i in range(n):
        seen += 1 - D.blind[i]
    if seen < FEWEST:
        return False
    for a in range(3):
        for i in range(n):
            D.column[i] = J[a, i]
        solve_factored(D.factor, n, D.column)
        D.pushed[a] = 0.0
        for i in range(n):
            sharp = 0.0 if D.blind[i] else D.sharp[ACCELERATION_SLOW + b, i]
            D.along[a, i] = D.column[i] * sharp
            y = D.odd[i] * sharp
            D.pushed[a] += D.along[a, i] * y
            if a == 0:
                total += y * y
    trace = 0.0
    for a in range(3):
        for c in range(a + 1):
            D.gram[a, c] = 0.0
            for i in range(n):
                D.gram[a, c] += D.along[a, i] * D.along[c, i]
        trace += D.gram[a, a]
    for a in range(3):
        D.gram[a, a] += RIDGE * trace
    asked0, asked1, asked2 = D.pushed[0], D.pushed[1], D.pushed[2]
    if total <= 0.0 or not factor(D.gram, 3):
        return False
    solve_factored(D.gram, 3, D.pushed)
    share = (asked0 * D.pushed[0] + asked1 * D.pushed[1] + asked2 * D.pushed[2]) / total
    touch: bool = share > PUSH_SHARE and 1.0 - share < PUSH_BETTER * (1.0 - best)
    return touch


@jit
def by_torque(D: Any, K: Any) -> int:
    """The joint with the largest |r_i|/sqrt(T_i^2 + (0.1 sum_k |M_ik d_k|)^2), or -1 where all are usual.

    The second term keeps a heavy joint's fault from light ones, in whose torques it leaks.
    """
    M = K.kinematics.M
    best, most = -1, 0.5
    for i in range(D.n):
        if D.blind[i]:
            continue
        for b in range(BANKS):
            leak = 0.0
            for k in range(D.n):
                if k != i:
                    leak += abs(M[i, k] * D.d[b, k])
            room, leak = D.room[TORQUE_SLOW + b, i], MODEL_SHARE * leak
            square = room * room + leak * leak
            size = D.excess[TORQUE_SLOW + b, i]
            if size * size > most * most * square:
                best, most = i, size / square**0.5
    return best


@jit
def culprit(D: Any, K: Any) -> int:
    """The joint that explains the residuals best, or -1; also where a force at the tip does.

    Source: docs/theory/detection.md, "Which joint".
    """
    if not factor_inertia(D, K):
        return -1
    knows = D.has_effort != 0 and D.asked != 0 and D.known != 0
    joint, loud = by_direction(D, knows)
    if D.touched < SURE_OF_PUSH:
        D.touched = D.touched + 1 if joint >= 0 and is_push(D, K, D.score[joint]) else 0
    else:
        D.touched += 1
    if D.touched * D.dt > LONGEST_PUSH:
        D.touched = 0
    if D.touched:
        return -1
    if not loud and D.has_effort and D.known:
        other = by_torque(D, K)
        if other >= 0:
            return other
    return joint
