"""Whether a joint without motor and brake is only measured, or swings as its dynamics say.

    reported or found -> MEASURED: nothing but measured; the others make up for where it is seen to go
                  -> FREE: once its dynamics have foretold the last 50 ms better than standing and coasting do

Where nobody measures, each sample is what the planner itself foretold, and the joint is FREE at once.
Source: docs/theory/free-swinging.md, "Measured first".
"""

from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.commands.believed import who_leads, window_ticks
from ftqp.kernel.commands.stops import release
from ftqp.kernel.free.swinging import free_velocity, viscous_friction
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import FREE, MEASURED, STOPPED_BY_FREE_JOINT
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.rows.failed_joints import sort_joints

BETTER = 2.0
"""The swing leaves less than one in so many of the squares that coasting leaves, so that it is believed of
a joint that friction robs of up to 0.41 of what pulls at it, 0.59^2 = 2 0.41^2, and noise is no reason."""
FALLS = 1e-4
"""... and coasting leaves this, as a root of the mean square [rad or m]. Derived: a t^2/2 over WINDOW leaves
a WINDOW^2/(12 sqrt 5), so that it is 1 rad/s2. What accelerates less is made up for as it is seen."""
AGREES = 1e-9
"""A sample so near to what was foretold a tick ago is no measurement [rad or m]: rounding is less, and a
joint that friction holds is off by a dt^2/2. Plant ``kinematic`` agrees to as much, by convention."""


@rare_jit
def foretell(K: Any, first: bool) -> None:
    """Look at the samples of this tick: a joint that does not swing as foretold is measured, and back."""
    faults, free, feedback, n = K.faults, K.free, K.feedback, K.chain.n
    changed = False
    measured = 0
    for i in range(n):
        if faults.code[i] == FREE and free.trust[i] > 0:
            free.trust[i] -= 1
            if not first and abs(feedback.innovation[i]) > AGREES:
                _measure_only(K, i)
                changed = True
        if faults.code[i] == MEASURED:
            measured += 1
    if measured > 0:
        changed = _compare(K) or changed
    if changed:
        sort_joints(faults, K.chain)
    if changed or (measured > 0 and free.joint < 0):
        who_leads(faults, K.chain, free)


@jit
def _measure_only(K: Any, i: int) -> None:
    """A joint that was taken to swing is measured; a stop because of it is no more."""
    free, watch = K.free, K.watch
    K.faults.code[i] = MEASURED
    free.contact[i], free.tau_stop[i], free.trust[i], free.window = 0, 0.0, 0, 0
    if watch.latched and watch.reason == STOPPED_BY_FREE_JOINT:
        release(watch, K.feedback, K.chain)


@jit
def _compare(K: Any) -> bool:
    """One tick of the window; at its end, whether one of the measured joints is now held to swing."""
    state, faults, free, feedback, n = K.state, K.faults, K.free, K.feedback, K.chain.n
    if free.window == 0:
        for i in range(n):
            free.v_before[i] = feedback.v_hat[i]
            free.begun_at[i] = free.swung[i] = feedback.seen[i]
            free.swung_v[i] = feedback.v_hat[i]
            for k in range(3):
                free.coasting[i, k] = free.swinging[i, k] = 0.0
        free.window = 1
        return False
    supposed = K.supposed
    for i in range(n):
        supposed.q[i], supposed.v[i] = feedback.q_hat[i], feedback.v_hat[i]
    forward_kinematics(K, supposed)
    motion(K, supposed)
    dynamics(K, supposed)
    t = free.window * state.dt
    for i in range(n):
        if faults.code[i] == MEASURED:
            _swing_on(state, faults, K.limits, feedback, K.kinematics, K.chain, free, i)
            _add(free.coasting[i], t, feedback.seen[i] - free.begun_at[i])
            _add(free.swinging[i], t, feedback.seen[i] - free.swung[i])
            if 2 * free.window <= window_ticks(state.dt):
                free.halfway[i] = feedback.seen[i]
    assign(free.v_before, feedback.v_hat, n)
    samples = free.window
    free.window += 1
    if samples < window_ticks(state.dt):
        return False
    free.window = 0
    swings = False
    for i in range(n):
        if faults.code[i] == MEASURED:
            coasting = left_by_a_line(free.coasting[i], samples, state.dt)
            swinging = left_by_a_line(free.swinging[i], samples, state.dt)
            before, after = free.halfway[i] - free.begun_at[i], feedback.seen[i] - free.halfway[i]
            gains = abs(after) > abs(before)  # friction alone makes no joint faster
            if gains and BETTER * swinging < coasting and coasting > samples * FALLS * FALLS:
                faults.code[i] = FREE
                swings = True
    return swings


@jit
def _swing_on(
    state: Any, faults: Any, limits: Any, feedback: Any, kinematics: Any, chain: Any, free: Any, i: int
) -> None:
    """Joint i as it would swing on for dt, while all others move as they were seen to."""
    M, dt, v = kinematics.M, state.dt, free.swung_v[i]
    drive = -kinematics.h[i] - faults.friction[i] * v  # the joint's own friction is a part of h
    for j in range(chain.n):
        if j != i:
            drive -= M[i, j] * (feedback.v_hat[j] - free.v_before[j]) / dt
    after = free_velocity(M[i, i], drive, v, viscous_friction(faults, chain, i), faults.coulomb[i], dt)
    q = free.swung[i] + dt * after
    if (q < limits.q_min[i] and after < 0.0) or (q > limits.q_max[i] and after > 0.0):
        q, after = free.swung[i], 0.0
    free.swung[i], free.swung_v[i] = q, after


@jit
def _add(sums: Any, t: float, y: float) -> None:
    """Sum y, t y and y^2."""
    sums[0] += y
    sums[1] += t * y
    sums[2] += y * y


@jit
def left_by_a_line(sums: Any, samples: int, dt: float) -> float:
    """What the straight line that fits best leaves of sum y^2, at t = dt, 2 dt ... samples dt.

    A motion that differs from a foretold one by a line differs by where and how fast it began, which is not
    known to the noise of the sensor. A joint that stands is one that coasts at no speed.
    """
    mean = 0.5 * (samples + 1) * dt
    spread = samples * (samples * samples - 1.0) / 12.0 * dt * dt
    off = sums[0] / samples
    slope = (sums[1] - mean * sums[0]) / spread
    return max(sums[2] - samples * off * off - spread * slope * slope, 0.0)
