"""The status report: what the operator is told of the arm, beside what the QP says of itself."""

from typing import Any

from ftqp.kernel.feedback.error_band import OUT_TIME
from ftqp.kernel.feedback.gap import norms
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import INVALID_INPUT, LAGGING, OK, RELAXED, SCALED
from ftqp.kernel.layout.thresholds import OUTSIDE_FROM, OUTSIDE_SIGMAS
from ftqp.kernel.maths.elementary import any_of
from ftqp.kernel.maths.side_by_side import WIDTH, several

BACK = 0.5
"""The lag is over when every error is below this share of its tolerance ..."""
BACK_TIME = 0.05
"""... for this long [s], so that a report does not flicker. A guess that the campaigns have not
contradicted."""


@jit
def see_error(task: Any, feedback: Any, kinematics: Any, past: Any) -> None:
    """e: from the measured tip to the target of the same time, (6,), and its norms.

    That is the reference's error to the given target at that time, less d.
    """
    if feedback.latency == 0:
        for k in range(6):
            task.seen[k] = task.error[k] - feedback.off[k]
    else:
        then = slot(feedback, feedback.latency)
        for k in range(6):
            past.error[feedback.now, k] = task.error[k]
        source = then if past.known[then] else feedback.now
        for k in range(6):
            task.seen[k] = past.error[source, k] - feedback.off[k]
    task.position_error, task.rotation_error = norms(task, kinematics, task.seen)


@jit
def _is_measured_outside(limits: Any, feedback: Any, chain: Any) -> bool:
    """Whether a joint is measured beyond its range, farther than by six standard deviations of the noise.

    The reference, at which the QP is posed, may be inside all the while.
    """
    room = OUTSIDE_FROM + OUTSIDE_SIGMAS * feedback.sigma
    for at in range(0, chain.n, WIDTH):
        q = several(feedback.seen, at)
        if any_of((q < several(limits.q_min, at) - room) | (q > several(limits.q_max, at) + room)):
            return True
    return False


@jit
def report_status(state: Any, limits: Any, task: Any, feedback: Any, chain: Any, outcome: int) -> int:
    """The status: INVALID_INPUT of a refused sample, LAGGING with hysteresis, else the QP's own outcome.

    It is LAGGING when the measured tip is beyond the task's tolerance, or a joint has been outside its
    error band for 20 ms, until everything is within half of that for 50 ms; and while a joint is measured
    beyond its range. Where the QP itself says that the task is relaxed or scaled, and the arm follows the
    command, that goes first.
    """
    dt = state.dt
    if not feedback.active:
        return outcome
    e = max(task.position_error / feedback.tolerance, task.rotation_error / feedback.rotation_tolerance)
    if e > 1.0 or feedback.out * dt > OUT_TIME - 0.5 * dt:
        feedback.lagging, feedback.settled = 1, 0
    elif feedback.lagging:
        feedback.settled = feedback.settled + 1 if max(e, feedback.gap) < BACK else 0
        if feedback.settled * dt > BACK_TIME - 0.5 * dt:
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
