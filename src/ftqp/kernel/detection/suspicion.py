"""Whether a residual is larger than those of a healthy arm, and for how long."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.detection_room import BANKS, RESIDUALS, SLOW, WINDOW
from ftqp.kernel.layout.enums import (
    ACCELERATION_SLOW,
    ERROR_RESIDUAL,
    MOTOR_FAST,
    MOTOR_SLOW,
    OWN_FAST,
    OWN_SLOW,
    TORQUE_FAST,
    TORQUE_SLOW,
)
from ftqp.kernel.maths.elementary import larger, select
from ftqp.kernel.maths.side_by_side import WIDTH, is_set, largest_of, put, several

SETTLED = 100
"""Ticks after a reset that the slow observer needs to forget the noise of its first sample."""
CALM_AGAIN = 0.5
"""A suspicion calms down while z is below this."""


@jit
def _active(D: Any, r: int) -> bool:
    """Whether a residual is there: that of torques needs them, and some time after a reset."""
    if r == TORQUE_SLOW or r == TORQUE_FAST or r == OWN_SLOW or r == OWN_FAST:
        return D.has_effort != 0 and D.known != 0
    if r == MOTOR_SLOW or r == MOTOR_FAST:
        return D.has_motor != 0 and D.ticks > D.settle
    return r == ERROR_RESIDUAL or D.ticks > SETTLED


@jit
def suspect(D: Any) -> float:
    """z, the largest size/room over joints and residuals; z of every joint is left in ``z``.

    The size of a torque residual is what it has beside the friction that is not known.
    Source: docs/theory/detection.md, "Suspicion".
    """
    worst = 0.0
    for at in range(0, D.n, WIDTH):
        for b in range(BANKS):
            d = several(D.d[b], at)
            put(D.x[ACCELERATION_SLOW + b], at, d)
            put(D.excess[ACCELERATION_SLOW + b], at, abs(d))
            if D.has_motor:
                put(D.excess[MOTOR_SLOW + b], at, abs(several(D.x[MOTOR_SLOW + b], at)))
        z = 0.0 * several(D.e, at)
        for r in range(RESIDUALS):
            if _active(D, r):
                size = several(D.excess[r], at)
                put(D.peak[r], at, larger(several(D.peak[r], at), size))
                z = larger(z, size * several(D.sharp[r], at))
        z = select(is_set(D.blind, at), 0.0, z)
        put(D.z, at, z)
        worst = max(worst, largest_of(z))
    D.worst = worst
    return worst


@jit
def remember(D: Any, then: int) -> None:
    """Keep this tick's samples, reference speed, slow acceleration and effort among the last ones."""
    at_now = D.at
    for at in range(0, D.n, WIDTH):
        put(D.kept[at_now], at, several(D.seen, at))
        put(D.kept_v[at_now], at, several(D.past_v[then], at))
        put(D.kept_effort[at_now], at, several(D.motor_torque, at))
        if D.has_effort == 0:
            put(D.kept_x[at_now], at, several(D.d[SLOW], at))


@jit
def step_back(D: Any, ago: int) -> int:
    """Where the rings of the last samples keep the one that was ``ago`` ticks before this one."""
    return (D.at - ago) & (WINDOW - 1)
