"""How far the arm is from its command, and how fast the path may therefore go on."""

from typing import Any

from ftqp.kernel.feedback.error_band import error_band
from ftqp.kernel.feedback.persistence import persisted
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.latches.settling import latch
from ftqp.kernel.layout.enums import HEALTHY, POSITION_DRIVE, STOPPED_BY_DEVIATION
from ftqp.kernel.layout.hypotheses import LAGS
from ftqp.kernel.layout.thresholds import SCALED_FROM
from ftqp.kernel.maths.elementary import sqrt
from ftqp.kernel.rows.task_rows import component_of

FULL_SPEED_TO = 0.6
"""Up to this gap the path runs at full speed; it stands at a gap of 1."""
HELD_BACK = 0.5
"""A command that is held back from its reference by 0.8 of how far it may lead lets the path stand: sooner,
the others would rest before it is clear who does not follow."""
RATE_TIME = 0.05
"""A rate approaches what is wanted with this time constant [s] ..."""
FASTEST_FALL, FASTEST_RISE = 5.0, 2.0
"""... but falls and rises by no more than these [1/s]."""
DEVIATION_SAMPLES = 4
"""The arm is stopped when it is beyond the emergency thresholds on so many samples in a row."""


@jit
def norms(task: Any, kinematics: Any, error: Any) -> tuple[Any, Any]:
    """Norms of a six-vector along W over the task's rows: position [m], rotation [rad]."""
    linear = angular = 0.0
    for k in range(task.m):
        e = component_of(task, kinematics, task.rows[k], 0, error)
        if task.rows[k] < 3:
            linear += e * e
        else:
            angular += e * e
    return sqrt(linear), sqrt(angular)


@jit
def _joint_gap(faults: Any, feedback: Any, chain: Any, past: Any) -> float:
    """max |q_u - q_r| / error band over healthy joints; who is farthest."""
    then = slot(feedback, feedback.latency)
    gap = 0.0
    for i in range(chain.n):
        if faults.code[chain.lead[i]] == HEALTHY:
            g = abs(feedback.seen[i] - past.q[then, i]) / error_band(feedback, past, i)
            if g > gap:
                gap = g
                feedback.isolated_joint = i
    return gap


@jit
def measure_gap(K: Any) -> None:
    """g, what the arm leaves uncorrected, in units of what is tolerated: of d + c, and of every joint.

    A torque arm's joints do not count: their own loops take back what they leave, and a light wrist that was
    off while the tip was where it should be let the path wait until the arm was stopped.
    It decides what is done; what is said is decided by the true error. An arm farther away than the emergency
    thresholds on four samples is stopped.
    Source: docs/theory/feedback.md, "The gap".
    """
    feedback, watch = K.feedback, K.watch
    feedback.gap = 0.0
    if K.monitor.on and not feedback.has_tip:
        held_back = FULL_SPEED_TO + HELD_BACK * K.monitor.full if K.monitor.full > 0.0 else 0.0
        silent = 1.0 if feedback.silent > feedback.patience else 0.0
        odd = K.monitor.worst if feedback.kind == POSITION_DRIVE else 0.0  # else its loop takes it back
        feedback.gap, feedback.tip_gap, feedback.far = max(odd, held_back, silent), 0.0, 0
        joints = _joint_gap(K.faults, feedback, K.chain, K.past)  # lets no path wait, but is said
        persisted(K.state, feedback, LAGS, 0, max(feedback.gap, joints) > 1.0)
        feedback.isolated_joint = K.monitor.suspect
        return
    if not feedback.displaced and feedback.exact:
        feedback.far = feedback.persistence[LAGS, 0] = 0
        return
    for k in range(6):
        feedback.left[k] = feedback.off[k] + feedback.c[k]
    position, rotation = norms(K.task, K.kinematics, feedback.left)
    gap = max(position / feedback.tolerance, rotation / feedback.rotation_tolerance)
    feedback.tip_gap = gap
    joints = _joint_gap(K.faults, feedback, K.chain, K.past)
    persisted(K.state, feedback, LAGS, 0, joints > 1.0)
    feedback.gap = max(gap, joints) if K.monitor.on else gap
    if feedback.silent > feedback.patience:  # of an arm that rests its model knows best
        feedback.gap = max(feedback.gap, 1.0)
    beyond = position > watch.stop_position or rotation > watch.stop_rotation
    feedback.far = feedback.far + 1 if beyond else 0
    if feedback.far >= DEVIATION_SAMPLES and watch.latched == 0:
        latch(watch, STOPPED_BY_DEVIATION)


@jit
def approach(rate: float, wanted: float, dt: float) -> float:
    """How fast a rate changes towards what is wanted [1/s]."""
    return min(max((wanted - rate) / max(RATE_TIME, dt), -FASTEST_FALL), FASTEST_RISE)


@rare_jit
def stand_by(feedback: Any) -> None:
    """The whole arm is held: there is no gap to be closed, nobody's patience ends, and the path stands."""
    feedback.gap = feedback.rate = feedback.rate_change = 0.0
    feedback.far = 0


@jit
def wait(K: Any) -> None:
    """The rate of the path: 1 up to a gap of 0.6, 0 at a gap of 1, changing smoothly.

    rate' = clip((clip((1 - g)/0.4, 0, 1) - rate)/0.05 s, -5, 2). During a stop it rests. A path waits for as
    long as it takes: that an arm lags is never a reason to stop it.
    Source: docs/theory/feedback.md, "The gap".
    """
    watch, feedback, dt = K.watch, K.feedback, K.state.dt
    feedback.rate_change = 0.0
    if watch.latched:
        return
    wanted = min(max((1.0 - feedback.gap) / (1.0 - FULL_SPEED_TO), 0.0), 1.0)
    if wanted == 1.0 and feedback.rate == 1.0:
        return
    change = approach(feedback.rate, wanted, dt)
    rate = feedback.rate + dt * change
    if rate > SCALED_FROM:
        rate = 1.0
    feedback.rate_change = change
    feedback.rate = max(rate, 0.0)
