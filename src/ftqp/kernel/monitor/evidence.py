"""What speaks for a failure: an adaptive CUSUM for each hypothesis of each joint.

    G <- max(0, G + kappa (mu z - mu^2/2) - what contradicts the hypothesis),    z = r/sqrt(S)

The shift mu that is tested is the last residual, between 3 and 8 standard deviations, with its sign: it is
known before z is seen, so that E[exp(gain)] <= 1 on a healthy joint whatever it was, and a level h is passed
at most exp(-h) times an independent look (Wald's identity; Lorden and Pollak 2005). So the one threshold of
a decision follows from the false alarms that are allowed. What contradicts is a likelihood, too.
Source: docs/theory/monitor.md, "Evidence".
"""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import TORQUE_DRIVE
from ftqp.kernel.layout.feedback_rooms import SERVO
from ftqp.kernel.layout.thresholds import GEAR, LEAST_SHIFT, MOST_SHIFT
from ftqp.kernel.maths.elementary import sqrt
from ftqp.kernel.monitor.servos import (
    DROOP,
    creep_of,
    direction,
    is_strained,
    may_stick,
    noise_of,
    variance,
)

USUAL_TIME = 0.2
"""In so long [s], as servos take to stop, a fault may be learned as a droop before evidence rises. What is so
for longer is usual: how far ahead of an arm its command is, and what disturbs it."""


@jit
def _sum(G: Any, i: int, gain: float, top: float) -> None:
    """One more look: a sum that is neither below zero nor so high that it would take long to come back."""
    G[i] = min(max(G[i] + gain, 0.0), top)


@jit
def _gain(K: Any, z: float, z_old: float) -> float:
    """kappa (mu z - mu^2/2), with the shift mu that the last look had.

    Of torques no look tells more than the largest shift: one that begins at once may come from outside.
    """
    shift = min(max(abs(z_old), LEAST_SHIFT), MOST_SHIFT)
    z = z if z_old > 0.0 else -z
    if K.feedback.kind == TORQUE_DRIVE:
        z = min(z, MOST_SHIFT)
    return float(K.monitor.kappa * (shift * z - 0.5 * shift * shift))


@jit
def forget_evidence(K: Any, all_joints: bool = True) -> None:
    """Nothing is supposed of any joint, or of none that moves."""
    M = K.monitor
    for i in range(K.chain.n):
        if M.rests[i] and not all_joints:
            continue
        M.G[i] = M.G_lock[i] = M.G_free[i] = 0.0
        M.anchor[i] = M.means[0, i]


@jit
def _of_a_lock(K: Any, i: int) -> float:
    """z of joint i as far as a lock explains it: by what it was sent since it stands, and what it taught."""
    M, z, theta, before = K.monitor, K.monitor.z_sharp[i], K.monitor.theta[i], K.monitor.safe[1, i]
    if K.feedback.kind == TORQUE_DRIVE:
        return float(z)
    if M.rests[i] == 0:
        M.asked[i] = M.u_f[2, i] - max(theta[0], 0.0) * M.D * (M.u_f[1, i] - M.u_f[2, i])
    taught = theta[DROOP] - before[DROOP] + (theta[DROOP + 1] - before[DROOP + 1]) * M.weight[i]
    most: float = (abs(M.u_f[2, i] - M.asked[i]) + abs(taught)) / sqrt(M.S_sharp[i])
    return min(max(z, -most), most)


@jit
def weigh(K: Any, i: int, counts: bool) -> None:
    """The sums of joint i after a look; where it does not count only what contradicts does."""
    M, theta, P, z = K.monitor, K.monitor.theta[i], K.monitor.P[i], K.monitor.z[i]
    gain = _gain(K, z, M.z_old[i]) if counts else 0.0
    z_lock = _of_a_lock(K, i)
    sharp = _gain(K, z_lock, M.z_sharp_old[i]) if counts else 0.0
    _sum(M.G, i, gain, M.top)
    # where it was last zero a change began: what was learned since is taken back
    if M.G[i] == 0.0 and (K.state.ticks - M.safe_at[i]) * K.state.dt > USUAL_TIME:
        M.safe_at[i] = K.state.ticks
        for r in range(SERVO):
            M.safe[1, i, r], M.safe[0, i, r] = M.safe[0, i, r], theta[r]
            for c in range(SERVO):
                M.safe_P[1, i, r, c], M.safe_P[0, i, r, c] = M.safe_P[0, i, r, c], P[r, c]
    d = M.means[0, i] - M.anchor[i]  # a joint that stands has not moved since
    blur = 4.0 * noise_of(K, i) / M.every + GEAR * GEAR
    _sum(M.G_lock, i, sharp - 0.5 * d * d / blur, M.top)
    if M.G_lock[i] == 0.0:
        M.anchor[i] = M.means[0, i]
        if M.G[i] == 0.0 and M.found[i] == 0:
            M.began[i] = K.state.ticks
    # a motor that is off: the torque that its motion would need, m a + f + b + s g + i M a, is none
    M.phi[0], M.phi[1], M.phi[2] = 0.0, M.a[i], direction(M.v[i], creep_of(K, i))
    M.phi[3], M.phi[4], M.phi[5] = 1.0, M.weight[i], M.inertia[i]
    by_torque = K.feedback.kind == TORQUE_DRIVE
    torque = M.weight[i] if by_torque else 0.0
    for r in range(SERVO):
        torque += M.phi[r] * theta[r]
    unsure = 0.3 * theta[1] * M.a[i]
    doubt = M.spread[i] + unsure * unsure + variance(P, M.phi)
    driven = by_torque and M.a[i] * M.r[i] > 0.0  # what is sent speeds it up, as it does a rotor nobody told
    if M.r[i] * M.r[i] <= 9.0 * doubt or may_stick(K, i) or driven:
        gain = min(gain, 0.0)
    _sum(M.G_free, i, gain - 0.5 * M.kappa * torque * torque / doubt, M.top)
    M.z_old[i], M.z_sharp_old[i] = z, z_lock


@jit
def blur_of(K: Any, i: int) -> float:
    """Standard deviation of the filtered place of joint i."""
    return 0.5 * sqrt(noise_of(K, i) * K.monitor.w * K.state.dt)


@jit
def stands(K: Any, i: int) -> bool:
    """Whether joint i has not moved over the last three looks, noise aside, or is moved by its load."""
    M = K.monitor
    room: float = 4.0 * sqrt(2.0 * noise_of(K, i) / M.every) + GEAR
    return bool(abs(M.means[0, i] - M.means[3, i]) < room or is_strained(K, i))
