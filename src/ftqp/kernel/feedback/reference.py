"""The state at which the QP is posed: the planner's own last command, and what failed joints really do."""

from typing import Any

from ftqp.kernel.arm.kinematics import mimic, mimic_places
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import FREE, HEALTHY, LOCKED, MEASURED, POSITION_DRIVE
from ftqp.kernel.layout.thresholds import BESIDE, NOISE_LEVELS, STILL, STILL_SAMPLES, UNLIMITED
from ftqp.kernel.maths.elementary import any_of, is_finite
from ftqp.kernel.maths.side_by_side import WIDTH, load_lanes, store_lanes

FOLLOW = 0.05
"""A resting joint's place in the reference takes this share of what the sensor says each tick, so that noise
does not reach the others."""

SPEED_MARGIN = 0.04
"""Share of the speed limits that is left to servos, because the end of an acceleration makes one overshoot by
a_max/(e w_n): 2 to 3 % of the limits of common arms at 15 Hz (docs/theory/feedback.md, "The reference"),
beside noise and loads ..."""
SWINGING_MARGIN = 0.12
"""... and beside a joint without motor and brake, measured or swinging, whose pull they do not know."""


@jit
def rest_speed(feedback: Any) -> float:
    """A failed joint that is observed to be slower than this [rad/s or m/s] may as well stand."""
    rest: float = STILL + NOISE_LEVELS * feedback.sigma * feedback.failed_noise
    return rest


@jit
def update_reference(state: Any, faults: Any, feedback: Any, chain: Any, past: Any) -> None:
    """(q_r, v_r) into ``state``: the last command; of failed joints the observed state.

    A joint that brakes or swings counts as it is observed now. A locked joint at rest has velocity zero, and
    its place follows the sensor slowly, so that its noise does not shake the others.
    Source: docs/theory/feedback.md, "The reference".
    """
    now = feedback.now
    rest = rest_speed(feedback)
    for at in range(0, chain.n, WIDTH):
        store_lanes(state.q, at, load_lanes(state.q_command, at))
        store_lanes(state.v, at, load_lanes(state.v_command, at))
    for k in range(faults.working, chain.n):
        i = faults.order[k]
        q, v = feedback.q_now[i], feedback.v_now[i]
        if faults.code[i] == LOCKED or faults.code[i] == MEASURED:
            feedback.still[i] = feedback.still[i] + 1 if abs(feedback.v_hat[i]) < rest else 0
            if feedback.still[i] >= STILL_SAMPLES:
                held = state.q_command[i]
                q = held + FOLLOW * (feedback.seen[i] - held)
                v = 0.0
            if faults.code[i] == LOCKED:
                v = 0.0
        past.q[now, i], past.v[now, i] = q, v
        state.q[i], state.v[i] = q, v
    if chain.mimics and faults.working < chain.n:
        mimic_places(chain, state.q)
        mimic(chain, state.v)
        mimic_places(chain, past.q[now])
        mimic(chain, past.v[now])


@jit
def place_of(limits: Any, gate: Any, i: int, wanted: float) -> float:
    """A position that may be sent to joint i: in its range, or no farther outside than the last one."""
    last = gate.sent[i]
    low, high = min(limits.q_min[i], last), max(limits.q_max[i], last)
    return min(max(wanted, low), high)


@rare_jit
def return_to_work(K: Any, i: int) -> None:
    """A joint that had failed works again: where it begins, within its speed limit, and what it is sent.

    An arm that takes positions stands where it was sent, if the joint obeys; the lead is added again when it
    is sent. Another begins where it is predicted, which is as near to its sample as it can have moved since.
    Either may be beyond the range: it is led back from there as after a reset. At the end of its range, where
    a stop holds it, it is not on its way out; what noise makes of its velocity is none.
    """
    gate, state, feedback, limits, past = K.gate, K.state, K.feedback, K.limits, K.past
    top = min(limits.v_max[i], UNLIMITED)
    v = min(max(gate.v[i], -top), top) if abs(gate.v[i]) > rest_speed(feedback) else 0.0
    gate.v[i] = state.v_command[i] = v
    if feedback.kind == POSITION_DRIVE:
        ahead = K.monitor.stated_lead[i] * v + K.monitor.droop[i]
        q = place_of(limits, gate, i, gate.sent[i] - ahead)
    else:
        good = feedback.bad[i] == 0 and is_finite(state.q[i])
        most, seen = (feedback.latency + 1) * state.dt * top, state.q[i] if good else gate.sent[i]
        q = min(max(gate.q[i], seen - most), seen + most)
    gate.q[i] = state.q_command[i] = q
    if (gate.q[i] <= limits.q_min[i] and v < 0.0) or (gate.q[i] >= limits.q_max[i] and v > 0.0):
        gate.v[i] = state.v_command[i] = 0.0
    for s in range(feedback.span):
        past.q[s, i] = gate.q[i]


@rare_jit
def take_jump(K: Any) -> None:
    """After a joint was locked at once: the observer takes the jump of the velocities that is believed."""
    feedback, past, state = K.feedback, K.past, K.state
    if feedback.active and feedback.latency == 0:
        for i in range(K.chain.n):
            jump = state.v[i] - past.v[feedback.now, i]
            feedback.v_hat[i] += jump
            feedback.v_now[i] += jump


@jit
def leave_margin(faults: Any, feedback: Any, chain: Any, past: Any) -> None:
    """The reference keeps below the speed limits from when a healthy joint was first seen beside its command.

    A servo answers the end of an acceleration with an overshoot, a_max/(e wn) at wn, and noise and loads add
    theirs. An arm that follows exactly needs none.
    Source: docs/theory/feedback.md, "The reference".
    """
    if feedback.exact:
        return
    then = slot(feedback, feedback.latency)
    if feedback.speed_margin == 0.0:
        for i in range(chain.n):
            if faults.code[chain.lead[i]] == HEALTHY and abs(feedback.seen[i] - past.q[then, i]) > BESIDE:
                feedback.speed_margin = SPEED_MARGIN
    else:
        feedback.speed_margin = SPEED_MARGIN
        for k in range(faults.working, chain.n):
            code = faults.code[faults.order[k]]
            if code == FREE or code == MEASURED:
                feedback.speed_margin = SWINGING_MARGIN


@jit
def follows(feedback: Any, chain: Any, past: Any) -> bool:
    """Whether every sample is the reference of its time to the last bit, as on an arm that obeys exactly."""
    then = slot(feedback, feedback.latency)
    for at in range(0, chain.n, WIDTH):
        if any_of(abs(load_lanes(feedback.seen, at) - load_lanes(past.q[then], at)) > 0.0):
            return False
    return True
