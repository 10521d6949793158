"""Two joints of a torque arm that turn about nearly the same axis, one of which does not obey."""

from math import sqrt
from typing import Any

from ftqp.kernel.feedback.doubt import CLEAR, EXPLAINS, UNUSUAL, doubt
from ftqp.kernel.feedback.error_band import error_band
from ftqp.kernel.feedback.persistence import persisted
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.layout.hypotheses import BOTH_OBEY
from ftqp.kernel.layout.thresholds import GOES_ON, NOISE_LEVELS

PARALLEL = 0.7
"""Two axes are nearly one when M_ij^2/(M_ii M_jj) is larger. Where one of both lacks torque that is unusual,
in the mean over ``LATELY``, what corrects both is left to their own motors until both are where their
commands are. An iiwa14 whose joint 1 or 3 had lost its motor was shaken by noise without it
(docs/theory/feedback.md, "Two joints on nearly one axis")."""

NEAR = 0.3
"""A joint obeys when its error is below this share of its band, and it goes no faster than its command."""


@jit
def partner(feedback: Any, chain: Any, j: int) -> int:
    """The joint that does almost the same as joint j, or -1.

    Beside a joint that gives way the inertia of the other is M_ii (1 - M_ij^2/(M_ii M_jj)): too little for a
    loop with delay.
    """
    M = feedback.M
    found, most = -1, PARALLEL
    for i in range(chain.n):
        alike = M[i, j] * M[i, j] / (M[i, i] * M[j, j])
        if i != j and alike > most:
            found, most = i, alike
    return found


@jit
def tracks_command(state: Any, limits: Any, feedback: Any, past: Any, j: int) -> bool:
    """Whether joint j is where its command is, and as fast."""
    off = abs(feedback.q_now[j] - state.q_command[j])
    slower = abs(feedback.v_now[j] - state.v_command[j])
    noise = NOISE_LEVELS * feedback.sigma * feedback.failed_noise
    near: bool = off < NEAR * error_band(feedback, past, j)
    return near and slower < GOES_ON * limits.v_max[j] + noise


@jit
def _missing(K: Any) -> int:
    """The joint whose motor alone explains what has been unusual for a while, or -1."""
    limits, feedback, chain = K.limits, K.feedback, K.chain
    M, missing = feedback.M, feedback.missing
    worst, most, total = -1, 0.0, 0.0
    for i in range(chain.n):
        energy = missing[i] * missing[i] / M[i, i]
        total += energy
        if energy > most:
            worst, most = i, energy
    if worst < 0 or most < EXPLAINS * total or abs(missing[worst]) < UNUSUAL * limits.tau_max[worst]:
        return -1
    far = CLEAR * sqrt(doubt(K, worst))
    return worst if abs(missing[worst]) > far else -1


@rare_jit
def reduce_gain(K: Any) -> None:
    """The feedback of a suspect and of the joint on the same axis is soft until both obey again.

    Which of the two fails is not asked: a loop that is stable beside either is enough.
    Source: docs/theory/feedback.md, "Two joints on nearly one axis".
    """
    feedback, faults = K.feedback, K.faults
    if faults.working == K.chain.n and not feedback.touched:
        suspect = _missing(K)
        other = partner(feedback, K.chain, suspect) if suspect >= 0 else -1
        if other >= 0:
            if not feedback.softened:
                feedback.soft_one, feedback.soft_other = suspect, other
            feedback.softened, feedback.persistence[BOTH_OBEY, 0] = 1, 0
    if not feedback.softened:
        return
    one, another = feedback.soft_one, feedback.soft_other
    agree = tracks_command(K.state, K.limits, feedback, K.past, one)
    agree = agree and tracks_command(K.state, K.limits, feedback, K.past, another)
    obey = persisted(K.state, feedback, BOTH_OBEY, 0, agree)
    failed = faults.code[one] != HEALTHY or faults.code[another] != HEALTHY
    if failed or obey:
        feedback.softened = 0


@jit
def gain_reduced(feedback: Any, i: int) -> bool:
    """Whether the feedback of joint i is soft."""
    soft: bool = feedback.softened != 0 and (i == feedback.soft_one or i == feedback.soft_other)
    return soft
