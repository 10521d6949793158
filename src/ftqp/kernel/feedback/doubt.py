"""How much torque the motor of a healthy joint may seem to lack: noise, and what of the arm is not known."""

from typing import Any

from ftqp.kernel.jit import jit

TORQUE_NOISE = 0.01
"""Share of a joint's torque limit that the equation of its torque misses for other reasons than it has rows
for."""
UNUSUAL = 2.0 * TORQUE_NOISE
"""Torques are unusual from this share of a joint's limit, beside noise: two deviations of what is missed."""
CLEAR = 4.0
"""So many standard deviations of what a joint may seem to lack are no noise. With six a motor that had failed
was left out too late for the others."""
EXPLAINS = 0.8
"""What is unusual has one cause, a motor, a pair or a push, if that explains so much of its squares."""
LEAST_LIMIT, UNBOUNDED = 1e-6, 1e3
"""Torque limits beyond these [N m or N] count as these where shares of them are noise, because some arms have
none, and some motors have lost theirs."""


@jit
def bounded_limit(limits: Any, i: int) -> float:
    """The torque limit of joint i of which shares are taken [N m or N]."""
    limit: float = min(max(limits.tau_max[i], LEAST_LIMIT), UNBOUNDED)
    return limit


@jit
def noise_of_missing(K: Any, i: int) -> float:
    """Variance of ``missing`` by the noise of all samples."""
    felt, total = K.feedback.missing_noise, 0.0
    for j in range(K.chain.n):
        m = K.feedback.M[i, j] * max(K.held.sigma[j], K.feedback.sigma)
        total += m * m
    variance: float = felt * felt * total
    return variance


@jit
def doubt(K: Any, i: int) -> float:
    """Variance of what joint i may seem to lack: noise, its rotor, and what its equation was seen to miss.

    What a model misses it misses of more than one joint, and a motor that fails of its own alone: so that
    counts as far as another equation misses as much.
    """
    learned, others = K.learned, 0.0
    variance = noise_of_missing(K, i)
    if learned.on:
        for j in range(K.chain.n):
            if j != i:
                others = max(others, learned.missed[j])
        rotor, limit = learned.sigma[i] * K.state.a_command[i], TORQUE_NOISE * bounded_limit(K.limits, i)
        variance += rotor * rotor + min(learned.missed[i], others) * limit * limit
    return variance
