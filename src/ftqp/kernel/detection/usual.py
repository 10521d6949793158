"""What residuals usually are: means of the last moments, which take loads and friction nobody knows of."""

from typing import Any

from ftqp.kernel.detection.acceleration_banks import through
from ftqp.kernel.detection.carried import feel_load, learn_load
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.detection_room import BANKS, SLOW, WINDOW
from ftqp.kernel.layout.enums import ERROR_RESIDUAL, OWN_SLOW, TORQUE_SLOW
from ftqp.kernel.maths.elementary import larger, select
from ftqp.kernel.maths.side_by_side import WIDTH, put, several

LATE = 60
"""Samples by which the means are late, so that they do not take a fault for usual."""
LEARNED = 140
"""Means of fewer samples are not relied upon."""
LONGEST_HOLD = 200
"""The means stand still during a suspicion, but for so many ticks at most: what stays so long is usual."""
FRICTION_UNSURE = 0.3
"""Friction may be so much of itself larger or smaller than it was when it was identified."""
UNLEARNED = 0.5
"""Before its mean is known, this share of the distance from the reference counts."""


@jit
def begin_usual(D: Any) -> None:
    """Nothing is usual yet."""
    D.held = D.taken = D.known = 0
    for i in range(D.n):
        D.usual[i] = D.usual_e[i] = D.usual_side[i] = 0.0
        D.rub[0, i] = D.rub[1, i] = D.rub[2, i] = 0.0


@jit
def _turned(D: Any, at: int, late: int, share: float) -> Any:
    """|F[side] less its mean|, of a block of joints: 2 after a reversal, 0 while all goes on."""
    side = through(D.rub, at, several(D.side, at), D.pole[SLOW])
    put(D.kept_side[D.at], at, side)
    mean = several(D.usual_side, at)
    mean = mean + share * (several(D.kept_side[late], at) - mean)
    put(D.usual_side, at, mean)
    return abs(side - mean)


@jit
def take_usual(D: Any) -> None:
    """Means of 0.2 s, 60 samples late, of e and of the torque residual; both less their means are compared.

    Source: docs/theory/detection.md, "Residuals".
    """
    late = (D.at - LATE) & (WINDOW - 1)
    learned = D.taken >= LEARNED
    share = 0.0
    if D.ticks > LATE + D.settle and (D.watch == 0 or not learned or D.held > LONGEST_HOLD):
        D.taken += 1
        share = max(D.slowness, 1.0 / D.taken)
    D.known = 1 if D.taken >= LEARNED else 0
    count = 1.0 if D.known else UNLEARNED
    for at in range(0, D.n, WIDTH):
        e, mean = several(D.e, at), several(D.usual_e, at)
        put(D.kept_e[D.at], at, e)
        mean = mean + share * (several(D.kept_e[late], at) - mean)
        put(D.usual_e, at, mean)
        put(D.x[ERROR_RESIDUAL], at, e - mean)
        put(D.excess[ERROR_RESIDUAL], at, count * abs(e - mean))
        if D.has_effort:
            mean = several(D.usual, at)
            put(D.kept_x[D.at], at, several(D.x[TORQUE_SLOW + SLOW], at))
            mean = mean + share * (several(D.kept_x[late], at) - mean)
            put(D.usual, at, mean)
            mean = mean - feel_load(D, at, late, share)
            band = FRICTION_UNSURE * several(D.coulomb, at) * _turned(D, at, late, share)
            for b in range(BANKS):
                rest = several(D.x[TORQUE_SLOW + b], at) - mean
                beyond = larger(abs(rest) - several(D.excess[TORQUE_SLOW + b], at) - band, 0.0)
                put(D.x[TORQUE_SLOW + b], at, rest)
                put(D.excess[TORQUE_SLOW + b], at, beyond)
                own = beyond * several(D.light, at)
                size = beyond * several(D.sharp[TORQUE_SLOW + b], at)
                put(D.excess[OWN_SLOW + b], at, select(size < several(D.faint, at), 0.0, own))
    if D.has_effort and share > 0.0:
        learn_load(D)
