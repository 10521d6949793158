"""The error band of a joint, and what the others answered for one that is known to have failed."""

from typing import Any

from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.thresholds import BAND_TIME, ERROR_BAND, NOISE_LEVELS
from ftqp.kernel.maths.linear_systems import factor, solve_factored


@jit
def error_band(feedback: Any, past: Any, i: int) -> float:
    """The tracking error that joint i may have: 0.02 + 6 sigma + 0.1 s |v_r|."""
    v: float = abs(past.v[slot(feedback, feedback.latency), i])
    return ERROR_BAND + NOISE_LEVELS * feedback.sigma + BAND_TIME * v


@rare_jit
def redistribute_disturbance(K: Any, f: int) -> None:
    """Joint f is known to have failed: what it did not do is no disturbance of a torque arm any more.

    Until then it was to have an acceleration that it had not, by d_f. The others answered for it and saw
    M_HH d_H = -M_Hf d_f. So d_H += M_HH^-1 M_Hf d_f, and what was sent to them lately counts as so much less;
    what f did counts as what it was to do.
    """
    feedback, past, faults = K.feedback, K.past, K.faults
    M, S, column = feedback.M, K.scratch.square, K.scratch.impulse
    count = 0
    for k in range(faults.working):
        i = faults.order[k]
        if i != f:
            feedback.others[count] = i
            count += 1
    for a in range(count):
        i = feedback.others[a]
        column[a] = M[i, f]
        for b in range(a + 1):
            S[a, b] = M[i, feedback.others[b]]
    if not factor(S, count):
        return
    solve_factored(S, count, column)
    for a in range(count):
        i = feedback.others[a]
        feedback.d_hat[i] += column[a] * feedback.d_hat[f]
        for ago in range(feedback.latency + 2):
            past.a[slot(feedback, ago), i] -= column[a] * feedback.d_hat[f]
