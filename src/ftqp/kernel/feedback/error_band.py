"""The error band of a joint, and joints that are out of hand although nobody has said that they failed."""

from typing import Any

from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.latches.stop_latch import latch
from ftqp.kernel.layout.enums import ALL_BRAKES, HEALTHY, NO_BRAKES, STOPPED_BY_LAG, TORQUE_DRIVE
from ftqp.kernel.maths.cholesky import factor, solve_factored

ERROR_BAND = 0.02
"""A joint may always be this far [rad or m] from its command ..."""
BAND_TIME = 0.1
"""... farther by what its command moves in this time [s] ..."""
BAND_SIGMAS = 6.0
"""... and by so many standard deviations of its sensor's noise, because noise alone exceeds six twice in 1e9
samples. The others are guesses that the campaigns have not contradicted."""

OUT_TIME = 0.02
"""Outside its error band for this long [s] a joint lags behind; during a stop it asks for its brake. A guess
that the campaigns have not contradicted."""

OVERSPEED = 0.2
"""A joint that goes on faster than asked, and than its limit, by this share of the limit ..."""
OVERSPEED_TIME = 0.01
"""... for this long [s] is out of hand ..."""
SERVO_TIME = 0.1
"""... or for this long where a servo holds it, because that comes back by itself when it was pushed. All of
these are guesses that the campaigns have not contradicted."""


@jit
def error_band(feedback: Any, past: Any, i: int) -> float:
    """The tracking error that joint i may have: 0.02 + 6 sigma + 0.1 s |v_r|."""
    v: float = abs(past.v[slot(feedback, feedback.latency), i])
    return ERROR_BAND + BAND_SIGMAS * feedback.sigma + BAND_TIME * v


@rare_jit
def part_with(K: Any, f: int) -> None:
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
        feedback.d_slow[i] += column[a] * feedback.d_slow[f]
        for ago in range(feedback.latency + 2):
            past.a[slot(feedback, ago), i] -= column[a] * feedback.d_hat[f]


@jit
def _ask(feedback: Any, i: int) -> None:
    """Joint i asks for its brake, if the arm has any: else its own loop is all that can bring it back."""
    if feedback.brakes != NO_BRAKES:
        feedback.asks[i] = 1


@jit
def find_out_of_hand(K: Any) -> None:
    """Finds the joints that are out of hand: whatever the drive, they ask for their brakes.

    They are those outside their error band for 20 ms while the arm is stopped, and those that are 20 % of
    the limit faster than both their command and their limit for 10 ms, 100 ms with servos: that stops the
    arm, too, and always where it has but one brake for all.
    Source: docs/theory/feedback.md, "Stops".
    """
    feedback, past, watch, dt = K.feedback, K.past, K.watch, K.state.dt
    if feedback.exact and not feedback.any_counted:
        return
    feedback.any_counted = 0
    then = slot(feedback, feedback.latency)
    time = OVERSPEED_TIME if feedback.kind == TORQUE_DRIVE else SERVO_TIME
    for i in range(K.chain.n):
        if K.faults.code[K.chain.lead[i]] != HEALTHY:
            feedback.outside_band[i] = feedback.hurried[i] = 0
            continue
        out = watch.latched and abs(feedback.seen[i] - past.q[then, i]) > error_band(feedback, past, i)
        feedback.outside_band[i] = feedback.outside_band[i] + 1 if out else 0
        top = K.limits.v_max[i]
        fast = abs(feedback.v_hat[i]) > OVERSPEED * top + max(top, abs(past.v[then, i]))
        feedback.hurried[i] = feedback.hurried[i] + 1 if fast else 0
        if out or fast:
            feedback.any_counted = 1
        if feedback.hurried[i] * dt > time - 0.5 * dt:
            _ask(feedback, i)
            if watch.latched == 0 and (watch.stop_samples > 0 or feedback.brakes == ALL_BRAKES):
                latch(watch, STOPPED_BY_LAG)
                feedback.culprit = i
        if feedback.outside_band[i] * dt > OUT_TIME - 0.5 * dt:
            _ask(feedback, i)
