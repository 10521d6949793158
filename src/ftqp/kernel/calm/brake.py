"""The displacement that is left to go, what of the error it can remove, and how fast it may be asked for."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.calm.rest import IMPATIENT, LEAST
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import ACCELERATION
from ftqp.kernel.maths.cholesky import factor, solve_factored

SHARE = 0.45
"""Share of the braking deceleration that the way to the goal counts on. Chosen by
`python studies/study_calm.py --seed 17` (docs/evidence/settling.md, "Targets that stand")."""
FINE = 0.005
"""Share of the velocity limits that feedback asks for in the last millimetre of a target that has stood for
IMPATIENT: less than what counts as rest. It grows as the fourth power of a larger error; a step up there made
an arm hunt for ever across that millimetre (tests/robustness/test_hunting_at_a_millimetre.py). Chosen by the
same command as SHARE, `python studies/study_calm.py --seed 17`."""


@jit
def way_to_go(task: Any, calm: Any, count: int, soft: float) -> float:
    """Delta over the free joints and the share of the error that it can remove.

    Delta = (A'A + D + soft 1)^-1 (A'e + kick),  rho = (A'e + kick)'Delta/(e'e)
    """
    W, delta = calm.work, calm.delta
    square = 0.0
    for k in range(task.m):
        square += calm.e[k] * calm.e[k]
    for a in range(count):
        i = calm.free[a]
        delta[a] = calm.gradient[i] + calm.kick[i]
        for b in range(a + 1):
            j = calm.free[b]
            s = calm.D[i, j]
            for k in range(task.m):
                s += calm.A[k, i] * calm.A[k, j]
            W[a, b] = s
        W[a, a] += soft
    if not factor(W, count):
        return 1.0
    solve_factored(W, count, delta)
    rho = 0.0
    for a in range(count):
        i = calm.free[a]
        rho += (calm.gradient[i] + calm.kick[i]) * delta[a]
    return rho / square if square > 0.0 else 1.0


@jit
def braked(limits: Any, calm: Any, count: int, rate: float, square: float) -> float:
    """beta = min_i sqrt(2 SHARE a_brake_i |Delta_i|) / (rate |Delta_i|), at most 1.

    It is the share of the error that feedback may ask for: never a speed from which the arm cannot brake
    before the point it goes to. Velocity limits do not count here, they are bounds of the QP: a joint that
    runs at its limit does not slow the others. ``rate`` is that of the feedback [1/s], ``square`` e'e.
    """
    fine = FINE * max(1.0, square / LEAST) ** 2 if calm.stood >= IMPATIENT else inf
    beta = 1.0
    for a in range(count):
        i = calm.free[a]
        size = abs(calm.delta[a])
        top = sqrt(2.0 * SHARE * limits.a_brake[i] * size)
        if fine < inf:
            top = min(top, fine * limits.v_max[i])
        if rate * size * beta > top:
            beta = top / (rate * size)
    return beta


@jit
def feedback_rate(state: Any, task: Any, kp: float) -> float:
    """How fast the feedback alone brings the error down [1/s]: kp/kv, or kp at the velocity level."""
    if state.level == ACCELERATION:
        return kp / task.kv if task.kv > 0.0 else 0.0
    return kp
