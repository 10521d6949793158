"""Which joint explains the residuals of all: a torque at joint j moves every joint along M^-1 e_j."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.detection_room import BANKS, SLOW
from ftqp.kernel.layout.enums import ACCELERATION_SLOW, TORQUE_SLOW
from ftqp.kernel.maths.cholesky import factor, solve_factored

MODEL_SHARE = 0.1
"""Error of the inertia's model: a residual of torque may have so much of what all joints ask of it. A guess
that `python studies/detection.py` has not contradicted."""


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
    b = _disturbance(D, of_torque)
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
    """The joint that explains the residuals best, or -1.

    Source: docs/theory/detection.md, "Which joint".
    """
    if not factor_inertia(D, K):
        return -1
    knows = D.has_effort != 0 and D.asked != 0 and D.known != 0
    joint, loud = by_direction(D, knows)
    if not loud and D.has_effort and D.known:
        other = by_torque(D, K)
        if other >= 0:
            return other
    return joint
