"""The status report: what the operator reads of the arm, next to what the QP says of itself."""

from math import inf
from typing import Any

from ftqp.kernel.feedback.gap import norms
from ftqp.kernel.feedback.persistence import has_persisted, persisted
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import INVALID_INPUT, LAGGING, NO_BRAKES, OK, RELAXED, SCALED, TORQUE_DRIVE
from ftqp.kernel.layout.hypotheses import FOLLOWS, LAGS, MEAN_TIME
from ftqp.kernel.layout.thresholds import GOES_ON, NOISE_LEVELS, OUTSIDE_FROM, STANDS
from ftqp.kernel.maths.elementary import any_of
from ftqp.kernel.maths.side_by_side import WIDTH, load_lanes

BACK = 0.5
"""The lag is over when every error is below this share of its tolerance for a while, so that a report does
not flicker."""


@jit
def task_error(task: Any, feedback: Any, kinematics: Any, past: Any) -> None:
    """e: from the measured tip to the target of the same time, (6,), and its norms.

    That is the reference's error to the given target at that time, less d.
    """
    if feedback.span > 2:
        for k in range(6):
            past.error[feedback.now, k] = task.error[k]
    if feedback.latency == 0:
        for k in range(6):
            task.seen[k] = task.error[k] - feedback.off[k]
    else:
        then = slot(feedback, feedback.latency)
        source = then if past.known[then] else feedback.now
        for k in range(6):
            task.seen[k] = past.error[source, k] - feedback.off[k]
    task.position_error, task.rotation_error = norms(task, kinematics, task.seen)


@jit
def _is_measured_outside(limits: Any, feedback: Any, chain: Any) -> bool:
    """Whether a joint is measured beyond its range, farther than by six standard deviations of the noise.

    The reference, at which the QP is posed, may be inside all the while.
    """
    room = OUTSIDE_FROM + NOISE_LEVELS * feedback.sigma
    for at in range(0, chain.n, WIDTH):
        q = load_lanes(feedback.seen, at)
        if any_of((q < load_lanes(limits.q_min, at) - room) | (q > load_lanes(limits.q_max, at) + room)):
            return True
    return False


@jit
def report_status(state: Any, limits: Any, task: Any, feedback: Any, chain: Any, terms: Any,
                  outcome: int) -> int:  # fmt: skip
    """The status: INVALID_INPUT of a refused sample, LAGGING with hysteresis, else the QP's own outcome.

    It is LAGGING when the measured tip, or a further task that is required, is beyond the tolerance, or a
    joint has been outside its error band for 20 ms, until everything is within half of that for 50 ms; and
    while a joint is measured beyond its range. Where the QP itself says that the task is relaxed or scaled,
    and the arm follows the command, that goes first.
    """
    if not feedback.active:
        return outcome
    e = max(task.position_error / feedback.tolerance, task.rotation_error / feedback.rotation_tolerance)
    if terms.count:
        e = max(e, terms.worst)
    if e > 1.0 or has_persisted(state, feedback, LAGS, 0):
        feedback.lagging, feedback.persistence[FOLLOWS, 0] = 1, 0
    elif feedback.lagging and persisted(state, feedback, FOLLOWS, 0, max(e, feedback.gap) < BACK):
        feedback.lagging = 0
    if outcome != OK and outcome != RELAXED and outcome != SCALED:
        return outcome
    if feedback.refused:
        return INVALID_INPUT
    if feedback.lagging and (outcome == OK or feedback.gap >= 1.0):
        return LAGGING
    if outcome == OK and _is_measured_outside(limits, feedback, chain):
        return LAGGING
    return outcome


@rare_jit
def goes_on(K: Any, at_rest: bool) -> bool:
    """Whether a joint that works is seen to move in a stop ``at_rest``: ``moving``, fastest by its own limit.

    The mean of its observed speed exceeds 5 % of its limit, or has not been below 2 % since. A joint whose
    sample is refused is not seen; on a torque arm without brakes nobody knows whether such a one rests.
    Source: docs/theory/feedback.md, "Stops".
    """
    feedback, limits, faults = K.feedback, K.limits, K.faults
    if not feedback.active:
        return False
    noise = NOISE_LEVELS * feedback.sigma * feedback.failed_noise
    share, worst = min(1.0, K.state.dt / MEAN_TIME), STANDS if feedback.moving > 0 else GOES_ON
    feedback.moving = 0
    for k in range(faults.working):
        i = faults.order[k]
        v = 0.0 if feedback.bad[i] else abs(feedback.v_hat[i])
        feedback.going[i] += share * (v - feedback.going[i])
        top = limits.v_max[i] if limits.v_max[i] < inf else 1.0
        fast = (feedback.going[i] - noise) / top
        if feedback.lost[i] and feedback.kind == TORQUE_DRIVE and feedback.brakes == NO_BRAKES:
            fast = inf
        if at_rest and fast > worst:
            feedback.moving, worst = i + 1, fast
    return feedback.moving > 0
