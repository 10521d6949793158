"""An unreported force at the tip of a torque arm, distinguished from a motor that does not obey."""

from math import sqrt
from typing import Any

from ftqp.kernel.feedback.doubt import CLEAR, EXPLAINS, UNUSUAL, noise_of_missing
from ftqp.kernel.feedback.persistence import persisted
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.hypotheses import ALONE_AGAIN, TOUCHED
from ftqp.kernel.layout.thresholds import ROUNDING
from ftqp.kernel.maths.linear_systems import factor, solve_factored
from ftqp.kernel.monitor.verdicts import PUSHES

BETTER = 0.3
"""A force at the tip leaves no more than this share of what the best single motor leaves, because three
numbers explain more than one by themselves."""
OVER = 0.25
"""A touch is over at this share of the most that it was, or at half of what is unusual."""
FEWEST = 5
"""Of fewer joints three numbers explain nearly everything."""
ADOPTED = 0.5
"""A push that lasts for longer than pushes do is a load, which is usual after this time [s]."""


@jit
def _force(feedback: Any, kinematics: Any, scratch: Any, n: int, r: Any, share: Any, out: Any) -> float:
    """f of min sum_i ((r_i - J_i' f)/share_i)^2 into ``out``: the part of the squares that it explains."""
    S, J = scratch.square, kinematics.J
    total = 0.0
    for a in range(3):
        out[a] = 0.0
        for b in range(a + 1):
            S[a, b] = 0.0
    for i in range(n):
        w = 1.0 / (share[i] * share[i])
        total += w * r[i] * r[i]
        for a in range(3):
            out[a] += w * J[a, i] * r[i]
            for b in range(a + 1):
                S[a, b] += w * J[a, i] * J[b, i]
    ridge = ROUNDING * (S[0, 0] + S[1, 1] + S[2, 2])  # where the arm is singular there is a force, too
    for a in range(3):
        S[a, a] += ridge
    asked0, asked1, asked2 = out[0], out[1], out[2]
    if total <= 0.0 or not factor(S, 3):
        return 0.0
    solve_factored(S, 3, out)
    explained: float = (asked0 * out[0] + asked1 * out[1] + asked2 * out[2]) / total
    return explained


@jit
def _one_motor(limits: Any, n: int, r: Any) -> tuple[float, float]:
    """The part of sum_i (r_i/tau_max_i)^2 that the largest has alone, and how large that is."""
    total = most = 0.0
    for i in range(n):
        x = r[i] / limits.tau_max[i]
        total += x * x
        most = max(most, x * x)
    return (most / total if total > 0.0 else 1.0), sqrt(most)


@jit
def is_push(K: Any, r: Any) -> bool:
    """Whether a force at the tip explains torques r that are unusual, and no single motor does.

    A motor that does not obey shows up in its own row, a force at the tip in all of them, J' f. In units of
    the torque limits the force has to explain 85 % of the squares, and to leave a third at most of what the
    best motor leaves.
    """
    feedback, n = K.feedback, K.chain.n
    best, size = _one_motor(K.limits, n, r)
    if size < UNUSUAL or n < FEWEST:
        return False
    explained = _force(feedback, K.kinematics, K.scratch, n, r, K.limits.tau_max, feedback.push_at_tip)
    return explained > EXPLAINS and 1.0 - explained < BETTER * (1.0 - best)


@jit
def detect_touch(K: Any) -> None:
    """Whether something pushes the tip: ``touched``, for so many ticks, with the force ``push_at_tip``.

    It is looked for in the mean over 20 ms.
    Source: docs/theory/feedback.md, "The monitor".
    """
    feedback = K.feedback
    _, size = _one_motor(K.limits, K.chain.n, feedback.missing)
    if size < 0.5 * UNUSUAL and not feedback.touched:
        feedback.persistence[TOUCHED, 0] = 0
        return
    pushed = is_push(K, feedback.missing) and not _is_noise(K)
    if persisted(K.state, feedback, TOUCHED, 0, pushed) and not feedback.touched:
        feedback.touched = 1
        feedback.strongest = 0.0
        feedback.persistence[ALONE_AGAIN, 0] = 0
    if not feedback.touched:
        return
    feedback.touched += 1
    feedback.strongest = max(feedback.strongest, size)
    little = OVER * max(feedback.strongest, 2.0 * UNUSUAL)
    if persisted(K.state, feedback, ALONE_AGAIN, 0, size < little):
        feedback.touched = 0
    elif feedback.touched * K.state.dt > PUSHES:
        adopt(K)


@jit
def adopt(K: Any) -> None:
    """What is unusual becomes usual: nothing is taken for a push meanwhile."""
    K.feedback.touched = 0
    K.feedback.persistence[TOUCHED, 0] = -int(ADOPTED / K.state.dt)


@jit
def _is_noise(K: Any) -> bool:
    """Whether no joint's torque stands out of its noise."""
    feedback = K.feedback
    for i in range(K.chain.n):
        if feedback.missing[i] * feedback.missing[i] > CLEAR * CLEAR * noise_of_missing(K, i):
            return False
    return True
