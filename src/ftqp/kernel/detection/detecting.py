"""One tick of a detector: sensors, observers, residuals, suspicion, verdict, finding."""

from math import inf
from typing import Any

from ftqp.kernel.detection.acceleration_banks import observe_accelerations
from ftqp.kernel.detection.carried import begin_load
from ftqp.kernel.detection.effort import compare_torques, feel_arm
from ftqp.kernel.detection.encoders import read_encoders
from ftqp.kernel.detection.fault_isolation import isolate_fault
from ftqp.kernel.detection.standing import follow_motion
from ftqp.kernel.detection.suspicion import CALM_AGAIN, remember, suspect
from ftqp.kernel.detection.usual import begin_usual, take_usual
from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.layout.detection_room import WINDOW
from ftqp.kernel.layout.enums import (
    ACCELERATION_FAST,
    ERROR_RESIDUAL,
    IS_BIASED,
    IS_DEGRADED,
    IS_DROPPED,
    IS_FREE,
    IS_FROZEN,
    IS_LOCKED,
)
from ftqp.kernel.layout.hypotheses import CALM_TICKS, LONGEST_FIT, STANDING_VERDICTS, VERDICTS
from ftqp.kernel.maths.elementary import is_finite
from ftqp.kernel.maths.side_by_side import WIDTH, all_of, put, several

ALL_QUIET, WATCHING, FOUND = 0, 1, 2
"""What a tick answers: nothing to see, a suspicion, a new finding."""
TORQUE_COUNTS = 0.5
"""What is odd about a joint's torque tells half as much of its motion as what is odd about the motion."""
AFTER_START = 0.1
"""Lost torque is not found sooner after a reset [s], because friction and servos that come loose look so, and
so does what a reset leaves in observers."""


@rare_jit
def _decide_torques(D: Any) -> None:
    """Which torques there are, by those of the first tick: asked for, measured, or both."""
    D.asked = 1 if D.got_effort else 0
    D.has_effort = 1 if D.has_inertia and (D.got_effort or D.got_tau) else 0
    D.has_motor = 1 if D.got_effort and D.got_tau else 0


@rare_jit
def begin(D: Any) -> None:
    """The first tick after a reset: the arm is where its first samples, or the reset, say."""
    D.fresh = 0
    D.now = D.at = D.ticks = 0
    D.watch = D.quiet = D.said = D.agreed = D.waiting = D.pause = 0
    D.suspect = D.said_of = D.fitted = -1
    D.touched = 0
    D.worst = 0.0
    for i in range(D.n):
        q = D.q_ref[i] - D.dt * D.v_ref[i]
        D.good[i] = D.q[i] if is_finite(D.q[i]) else q
        D.raw[i] = D.good[i]
        D.step[i] = D.travel[i] = D.hop[i] = D.deviation[i] = 0.0
        D.went[i] = D.gone[i] = 0.0
        D.same[i] = D.missing[i] = D.off[i] = D.turns[i] = D.sensor[i] = 0
        D.kinds[i] = 0
        D.blind[i] = 1 if D.believed[i] else 0
        for ago in range(D.span):
            s = D.span - ago if ago > 0 else 0
            D.past_q[s, i], D.past_v[s, i], D.past_a[s, i] = q - ago * D.dt * D.v_ref[i], D.v_ref[i], 0.0
            D.past_effort[s, i] = D.effort[i]
        for s in range(WINDOW):
            D.kept[s, i], D.kept_v[s, i], D.kept_x[s, i] = D.good[i], 0.0, 0.0
            D.kept_effort[s, i] = D.effort[i]
        for b in range(len(D.s)):
            D.s[b, i], D.w[b, i], D.d[b, i] = D.good[i] - q + D.latency * D.dt * D.v_ref[i], 0.0, 0.0
            for k in range(3):
                D.f[b, k, i] = D.band[b, k, i] = D.motor[b, k, i] = 0.0
        D.psi_before[i] = D.loose_before[i] = 0.0
    begin_usual(D)
    begin_load(D)


@jit
def _keep_command(D: Any) -> None:
    """The reference at the end of this tick, for the sample that will be compared with it."""
    for at in range(0, D.n, WIDTH):
        put(D.past_q[D.now], at, several(D.q_ref, at))
        put(D.past_v[D.now], at, several(D.v_ref, at))
        put(D.past_a[D.now], at, several(D.a_ref, at))
        put(D.past_effort[D.now], at, several(D.effort, at))


@jit
def _find(D: Any, i: int, kinds: int, onset: float, share: float) -> None:
    """Joint i has failed."""
    D.kinds[i] = kinds
    D.since[i] = D.ticks
    D.onset[i] = onset
    D.share[i] = share


@rare_jit
def _find_sensors(D: Any) -> None:
    """The joints whose sensors have just been lost."""
    for i in range(D.n):
        if D.sensor[i] != 0 and D.kinds[i] == 0:
            ago = 3
            if D.sensor[i] == IS_FROZEN:
                ago = D.same[i]
            elif D.sensor[i] == IS_DROPPED:
                ago = D.missing[i]
            elif D.sensor[i] == IS_BIASED:
                ago = D.off[i]
            _find(D, i, D.sensor[i], float(max(D.ticks - ago, 0)), D.hop[i])


@rare_jit
def _judge(D: Any, K: Any, then: int) -> int:
    """The verdict of a tick of suspicion, and whether it makes a finding."""
    feel_arm(D, K, then)
    for i in range(D.n):
        D.deviation[i] = max(D.deviation[i], TORQUE_COUNTS * D.z[i])
        for r in range(ERROR_RESIDUAL, ACCELERATION_FAST + 1):
            D.deviation[i] = max(D.deviation[i], D.excess[r, i] * D.sharp[r, i])
    joint, kinds = isolate_fault(D, K, then)
    if D.ticks * D.dt < AFTER_START and kinds & (IS_FREE + IS_DEGRADED) and not kinds & IS_LOCKED:
        kinds = 0
    if joint >= 0 and kinds != 0:
        for k in range(7):
            hit = 1.0 if kinds & (1 << k) else 0.0
            D.tally[joint, k] += 0.2 * (hit - D.tally[joint, k])
    if kinds != 0 and joint == D.said_of and kinds == D.said:
        D.agreed += 1
    else:
        D.agreed = 1 if kinds != 0 else 0
    D.said_of, D.said = joint, kinds
    if D.agreed < (STANDING_VERDICTS if kinds & IS_LOCKED else VERDICTS):
        return WATCHING
    _find(D, joint, kinds, float(max(D.ticks - D.watch, 0)), D.fit_share)
    D.waiting = 1
    return FOUND


@rare_jit
def _mend(D: Any) -> None:
    """In place of what is no number: the torque, or the reference, of the tick before, at rest."""
    for i in range(D.n):
        if not is_finite(D.tau[i]):
            D.tau[i] = D.tau_before[i]
        if not is_finite(D.effort[i]):
            D.effort[i] = D.past_effort[D.now, i]
        if not is_finite(D.q_ref[i]) or not is_finite(D.v_ref[i]) or not is_finite(D.a_ref[i]):
            D.q_ref[i] = D.past_q[D.now, i] if is_finite(D.past_q[D.now, i]) else 0.0
            D.v_ref[i] = D.a_ref[i] = 0.0


@jit
def _accept(D: Any) -> None:
    """Torques that were left out, or are no numbers, are those of the tick before."""
    for at in range(0, D.n, WIDTH):
        if D.has_motor and D.got_tau == 0:
            put(D.tau, at, several(D.tau_before, at))
        if D.has_effort and D.asked and D.got_effort == 0:
            put(D.effort, at, several(D.past_effort[D.now], at))
        odd = several(D.q_ref, at) + several(D.v_ref, at) + several(D.a_ref, at)
        odd = odd + several(D.tau, at) + several(D.effort, at)
        if not all_of(abs(odd) < inf):
            _mend(D)
        put(D.tau_before, at, several(D.tau, at))


@jit
def _look_anew(D: Any) -> None:
    """Forget what was said and fitted of a suspicion, which begins, or begins anew."""
    D.fitted = D.suspect = -1
    D.agreed = D.watch = 0
    for i in range(D.n):
        D.deviation[i] = 0.0


@part_jit
def detect_tick(D: Any, K: Any) -> int:
    """One tick: ALL_QUIET, WATCHING or FOUND; samples, torques and reference are in D.

    Samples of this tick are compared with the reference that earlier ticks led to, ``latency`` ticks late.
    Source: docs/theory/detection.md.
    """
    if D.fresh:
        _decide_torques(D)
        _mend(D)
        begin(D)
    else:
        _accept(D)
        D.ticks += 1
        D.at = (D.at + 1) & (WINDOW - 1)
    then = D.now - D.latency
    if then < 0:
        then += D.span
    D.has_dynamics = 0
    news = read_encoders(D, K, then)
    observe_accelerations(D)
    if D.has_effort:
        compare_torques(D, K, then)
    take_usual(D)
    z = suspect(D)
    remember(D, then)
    follow_motion(D, then)
    D.now = D.now + 1 if D.now + 1 < D.span else 0
    _keep_command(D)
    answer = ALL_QUIET
    if news > 0:
        _find_sensors(D)
        D.waiting = 1
        answer = FOUND
    if D.watch == 0 and z <= 1.0:
        return answer
    if D.watch == 0:
        D.held = D.touched = 0
        _look_anew(D)
    D.watch += 1
    D.held += 1
    D.quiet = D.quiet + 1 if z < CALM_AGAIN else 0
    if D.quiet > CALM_TICKS or (D.watch > LONGEST_FIT and z <= 1.0):
        D.watch = D.quiet = D.touched = 0
        D.suspect = -1
        return answer
    if D.watch > LONGEST_FIT:
        _look_anew(D)
        D.watch = 1
    if D.waiting == 0 and D.pause == 0:
        answer = max(answer, _judge(D, K, then))
    if D.pause > 0:
        D.pause -= 1
    return max(answer, WATCHING)
