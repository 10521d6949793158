"""How much of the torque that is asked for a motor still gives, and since when: fitted as ticks go by."""

from typing import Any

from ftqp.kernel.detection.suspicion import step_back
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.detection_room import BANKS, ONSETS
from ftqp.kernel.layout.enums import MOTOR_SLOW, TORQUE_SLOW

APART = 4
"""Ticks between two onsets that are compared."""


@jit
def _grow(D: Any, c: int, demand: float) -> None:
    """G, the demand since onset c filtered by F, one tick on, in both banks."""
    for b in range(BANKS):
        p = D.pole[b]
        x = demand
        for k in range(3):
            D.g[c, b, k] = p * D.g[c, b, k] + (1.0 - p) * x
            x = D.g[c, b, k]


@jit
def begin_fit(D: Any, i: int) -> None:
    """Take joint i: the onsets lie 0, 4, ... 28 ticks back, and the demand since is filtered again."""
    D.fitted = i
    D.fit_xx = 0.0
    for c in range(ONSETS):
        D.fit_gg[c] = D.fit_gx[c] = 0.0
        for b in range(BANKS):
            for k in range(3):
                D.g[c, b, k] = 0.0
        for ago in range(APART * c, 0, -1):
            _grow(D, c, D.kept_effort[step_back(D, ago), i])


@jit
def _demand(D: Any, K: Any, i: int, then: int) -> float:
    """What the motor of joint i is asked for: as it was told, or what the reference's motion takes."""
    if D.asked:
        return D.motor_torque[i]
    total: float = K.kinematics.h[i]
    for j in range(D.n):
        total += K.kinematics.M[i, j] * D.past_a[then, j]
    return total


@jit
def fit_share(D: Any, K: Any, i: int, then: int) -> None:
    """s - 1 = sum G x/sum G^2 with the onset that leaves the least of sum x^2, G = F[demand since the onset].

    x is the residual of torque, or what the motor gives beside what it was asked for where both are measured,
    or M d behind a servo; each bank over its room.
    Source: docs/theory/detection.md, "Lost torque".
    """
    if D.fitted != i:
        begin_fit(D, i)
    demand = _demand(D, K, i, then)
    kind = MOTOR_SLOW if D.has_motor else TORQUE_SLOW
    for c in range(ONSETS):
        _grow(D, c, demand)
    for b in range(BANKS):
        if D.has_motor or (D.has_effort and D.known):
            x = D.x[kind + b, i]
            room = D.room[kind + b, i]
        else:
            x = 0.0
            for j in range(D.n):
                x += K.kinematics.M[i, j] * D.d[b, j]
            room = 1.0 + 2.0 * b
        weight = 1.0 / (room * room)
        D.fit_xx += weight * x * x
        for c in range(ONSETS):
            g = D.g[c, b, 2]
            D.fit_gg[c] += weight * g * g
            D.fit_gx[c] += weight * g * x
    best = -1.0
    D.fit_share, D.fit_onset, D.fit_size = 1.0, 0.0, 0.0
    for c in range(ONSETS):
        if D.fit_gg[c] > 0.0:
            gain = D.fit_gx[c] * D.fit_gx[c] / D.fit_gg[c]
            if gain > best:
                best = gain
                D.fit_share = 1.0 + D.fit_gx[c] / D.fit_gg[c]
                D.fit_onset = float(APART * c)
                D.fit_best = c
    D.fit_spread = best / D.fit_xx if D.fit_xx > 0.0 else 0.0
    D.fit_size = demand
