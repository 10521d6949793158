"""What torque disturbs each joint of a torque arm: for long, which is fed forward, and what is unusual.

That is (M d)_i of the accelerations d that disturb the joints: what acts on joint i beside what its motor
was sent. Of a joint that does not obey it is its own row alone, however the others are carried along: what
it was to do and does not is no torque.
Source: docs/theory/feedback.md, "The torque drive".
"""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.layout.hypotheses import TOUCHED
from ftqp.kernel.layout.thresholds import LATELY

USUAL_TIME = 0.1
"""What has disturbed a joint for so long [s] is a load, not a fault. With 0.2 a soft joint that was braked
got no name."""


@jit
def follow_disturbance(K: Any) -> None:
    """The torque (M d)_i of long into ``tau_slow``, d of joints that work and what it does to free ones."""
    feedback, faults, free, M, d = K.feedback, K.faults, K.free, K.feedback.M, K.feedback.d_hat
    for k in range(faults.working, K.chain.n):
        feedback.tau_slow[faults.order[k]] = 0.0
    if feedback.thrown > 0.0:  # an impact is no disturbance that lasts
        return
    for k in range(faults.working):
        i = faults.order[k]
        if feedback.bad[i]:
            continue
        torque = 0.0
        for l in range(faults.working):
            torque += M[i, faults.order[l]] * d[faults.order[l]]
        for l in range(faults.working, faults.movable):
            f = faults.order[l]
            for m in range(faults.working if free.contact[f] == 0 else 0):
                torque -= M[i, f] * M[f, faults.order[m]] * d[faults.order[m]] / M[f, f]
        feedback.tau_slow[i] += K.learned.slowness[i] * (torque - feedback.tau_slow[i])


@jit
def note_missing(K: Any) -> None:
    """The torque (M d)_i less what is usual of it, in a short mean, into ``missing``.

    While the tip is touched what is usual stays. A joint that mimics another has no motor.
    """
    state, faults, feedback, chain = K.state, K.faults, K.feedback, K.chain
    M, d, usual, missing = feedback.M, feedback.d_hat, feedback.baseline, feedback.missing
    feedback.samples += 1
    share, lately = min(1.0, max(state.dt / USUAL_TIME, 1.0 / feedback.samples)), min(1.0, state.dt / LATELY)
    if feedback.touched or feedback.persistence[TOUCHED, 0] > 0:
        share = 0.0
    for i in range(chain.n):
        if faults.code[i] != HEALTHY or chain.lead[i] != i:
            missing[i] = 0.0
            continue
        rho = -usual[i]
        for j in range(chain.n):
            rho += M[i, j] * d[j]
        usual[i] += share * rho
        missing[i] += lately * (rho - missing[i])
