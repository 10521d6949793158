"""The load at the tip that nobody told of, by what it weighs at all joints at once."""

from typing import Any

from ftqp.kernel.detection.acceleration_banks import through
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.detection_room import LOAD_EVERY, LOADS, SLOW
from ftqp.kernel.layout.enums import TORQUE_SLOW
from ftqp.kernel.maths.linear_systems import factor, solve_factored
from ftqp.kernel.maths.side_by_side import put, several
from ftqp.kernel.maths.vectors import ZERO, Vector, column, cross, inner, minus, plus, three, times

UNLIKELY = (1.0, 0.1)
"""A load of so many kg, or of so many kg m beside the tip, takes evidence: the prior
(docs/theory/detection.md, "Loads")."""
AT_FIRST = 100.0
"""The mean square of a residual begins at so many times the least that counts."""
ALIKE = 6.0
"""So many neighbouring samples of the slow residual tell as much as one."""


@jit
def _columns(kinematics: Any, chain: Any, out: Any, a: Vector) -> None:
    """J_v' a and J_w' (R_k x a), k = 1, 2, 3: what a mass and its first moments take of joints."""
    J, R, n = kinematics.J, kinematics.R_tip, chain.n
    for i in range(n):
        out[0, i] = inner(column(J, 0, i), a)
    for k in range(3):
        m = cross((R[k], R[3 + k], R[6 + k]), a)
        for i in range(n):
            out[1 + k, i] = inner(column(J, 3, i), m)


@jit
def weigh(D: Any, K: Any, then: int) -> None:
    """What a mass at the tip, and its first moments along the tip's axes, take of each joint.

    A mass m with its centre at c from the tip takes J_v' m a + J_w' (R m c x a), a the tip's acceleration
    less gravity's. ``pull`` is that of the reference's acceleration, ``jolt`` that of what the slow observer
    sees beside it. What the load takes by turning itself is left out.
    Source: docs/theory/detection.md, "Loads".
    """
    kinematics, n = K.kinematics, D.n
    J = kinematics.J
    a, d = minus(three(kinematics.drift), three(K.chain.gravity)), ZERO
    for i in range(n):
        own = column(J, 0, i)
        a, d = plus(a, times(D.past_a[then, i], own)), plus(d, times(D.d[SLOW, i], own))
    _columns(kinematics, K.chain, D.pull, a)
    _columns(kinematics, K.chain, D.jolt, d)


@jit
def feel_load(D: Any, at: int, late: int, share: float) -> Any:
    """``strain``: F[pull] + jolt less its mean, of a block of joints: what a load makes of residuals."""
    total = 0.0 * several(D.e, at)
    for k in range(LOADS):
        drawn = through(D.drawn[k], at, several(D.pull[k], at), D.pole[SLOW]) + several(D.jolt[k], at)
        put(D.kept_pull[D.at, k], at, drawn)
        mean = several(D.usual_pull[k], at)
        mean = mean + share * (several(D.kept_pull[late, k], at) - mean)
        put(D.usual_pull[k], at, mean)
        put(D.strain[k], at, drawn - mean)
        total = total + D.load[k] * (drawn - mean)
    return total


@jit
def learn_load(D: Any) -> None:
    """The load of least squares sum (r - strain load)^2/(6 s^2), r the slow residual without any load.

    s^2 is the mean square of what each joint's residual has beside the load; neighbouring samples are alike.

    What was seen fades within some seconds; a load that nothing shows is none.
    Source: docs/theory/detection.md, "Loads".
    """
    if D.ticks % LOAD_EVERY != 0:
        return
    for a in range(LOADS):
        D.load_sum[a] *= D.load_fade
        for b in range(a + 1):
            D.load_square[a, b] *= D.load_fade
    for i in range(D.n):
        if D.blind[i]:
            continue
        x = D.x[TORQUE_SLOW, i]
        D.spread[i] = x * x + D.load_fade * (D.spread[i] - x * x)
        trust = 1.0 / (ALIKE * D.spread[i] + D.finest[i])
        y = -x
        for a in range(LOADS):
            y += D.strain[a, i] * D.load[a]
        for a in range(LOADS):
            x = trust * D.strain[a, i]
            D.load_sum[a] += x * y
            for b in range(a + 1):
                D.load_square[a, b] += x * D.strain[b, i]
    for a in range(LOADS):
        for b in range(a + 1):
            D.load_factor[a, b] = D.load_square[a, b]
        least = UNLIKELY[0] if a == 0 else UNLIKELY[1]
        D.load_factor[a, a] += 1.0 / (least * least)
    if factor(D.load_factor, LOADS):
        for a in range(LOADS):
            D.load[a] = D.load_sum[a]
        solve_factored(D.load_factor, LOADS, D.load)


@jit
def begin_load(D: Any) -> None:
    """No load is known yet."""
    for a in range(LOADS):
        D.load[a] = D.load_sum[a] = 0.0
        for b in range(LOADS):
            D.load_square[a, b] = 0.0
        for i in range(D.n):
            D.usual_pull[a, i] = D.drawn[a, 0, i] = D.drawn[a, 1, i] = D.drawn[a, 2, i] = 0.0
    for i in range(D.n):
        D.spread[i] = AT_FIRST * D.finest[i]
