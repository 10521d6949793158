"""The look-ahead: how the healthy joints are to swing so that the free one meets its stop softly, or never.

The plan U says for each healthy joint and each of three segments of 0.2 s which share u of a_max it takes,
u in {-1, 0, 1}, or that it brakes; after the segments all brake. One rollout a tick tries one other value.
Source: docs/theory/free-swinging.md, "Look-ahead".
"""

from math import cos, inf, sin, sqrt
from typing import Any

from ftqp.kernel.arm.dynamics import gravity_torque
from ftqp.kernel.arm.kinematics import forward_kinematics
from ftqp.kernel.free.swinging import (
    ROLLOUT_STEP,
    braked,
    farthest,
    free_velocity,
    is_worth,
    mark_places,
    swing_on,
    sync_model,
    viscous_friction,
    within_limits,
)
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.other_records import SEGMENTS

LONG_STEPS = 200
"""Steps of the rollout that says whether it is safe to hold still ..."""
LATER_STEP, LATER_STEPS = 0.02, 1000
"""... and length [s] and number of those that follow the free joint alone after that."""
SOFTLY = 0.3
"""A stop that is met later, no faster than this, is not worth moving the others for [rad/s or m/s]."""
HANGING = 1e-3
"""A joint slower than this hangs where gravity draws it [rad/s or m/s]."""
NO_SLOPE = 1e-9
"""A change of gravity's torque below this is none [N m/rad]. Rounding leaves less, 1e-13 of a torque of 1e3 N
m."""
TOUCH_SPEED = 0.05
"""A stop that is met no faster than this is touched [rad/s or m/s]."""
SEGMENT = 0.2
"""Length of a segment of the plan [s]."""
HORIZON_STEPS = 80
"""Steps of a look-ahead's rollout."""
BRAKE = 2.0
"""In the plan: the joint comes to rest. A convention, because shares of a_max lie within -1 and 1."""
ROLLOUTS = 3
"""Rollouts in a tick of the search."""
VALUES = 3
"""Other values than the plan's own that a segment of a joint may have."""
BOUNDARY = 0.005
"""The present plan is rolled out from the present state so often [s]."""
GAIN_NEEDED = 1e-3
"""A trial is kept when it lowers the cost by that much. Less would not be seen, as the cost is a speed
[rad/s]."""
SETTLING_COST = 0.02
"""Nothing is tried while there is no impact ahead and the cost is no more than that."""
FINAL_SPEED, TOP_SPEED, TRAVEL = 0.05, 0.02, 0.01
"""Weights of the free joint's speed in the end, its largest speed, and the way of the healthy joints. The
speed of an impact has the weight 1."""
TORQUE_SHARE = 0.95
"""Share of a torque limit beyond which torque costs."""


@jit
def begin_plan(F: Any, n: int) -> None:
    """All joints brake."""
    for s in range(SEGMENTS):
        for j in range(n):
            F.plan[s, j] = BRAKE
    F.phase = 0.0
    F.countdown = 0
    F.candidate = 0
    F.quiet = 0


@jit
def shift_plan(F: Any, n: int) -> None:
    """Time goes on: a segment that is over makes room for a new one in which all joints brake."""
    F.phase += F.dt
    while F.phase >= SEGMENT - 1e-9:
        F.phase -= SEGMENT
        F.countdown = 0
        for j in range(n):
            for s in range(SEGMENTS - 1):
                F.plan[s, j] = F.plan[s + 1, j]
            F.plan[SEGMENTS - 1, j] = BRAKE


@jit
def planned(state: Any, limits: Any, F: Any, j: int, time: float, left: float, dt: float) -> float:
    """The acceleration of joint j at a time since the first segment began; it brakes when none is left."""
    segment = int(time / SEGMENT + 1e-9)
    value = F.plan[segment, j] if segment < SEGMENTS and left > 0.0 else BRAKE
    a = braked(state, limits, j, dt) if value == BRAKE else value * limits.a_max[j]
    return within_limits(state, limits, j, a, dt)


TOO_FAR = 1e6
"""What a plan costs beside all else whose links go farther than they may [rad/s]. A convention, as no impact
is so fast."""
CLEAR_FOR = 20
"""After so many looks ahead without an impact none is reported any more, a tenth of a second: a search that
goes to and fro between two plans counts as one."""


@part_jit
def look_ahead(K: Any, F: Any, phase: float, left: float, give_up: float, steps: int) -> float:
    """The cost J of the plan from ``base_q``, ``base_v`` on; it ends early once it exceeds ``give_up``.

    ``left``: how long the plan counts; then all joints brake.

    J = v_imp + 0.05 |v_i(H)| + 0.02 max |v_i| + max(0, max |tau_h|/tau_max - 0.95) + 0.01 sum |q(H) - q(0)|

    The first impact's time, speed, energy and side, the free joint's swing and the links' reach are kept.
    """
    chain, faults, supposed, kinematics = K.chain, K.faults, K.supposed, K.kinematics
    n, i, dt = chain.n, F.joint, ROLLOUT_STEP
    for j in range(n):
        supposed.q[j], supposed.v[j] = F.base_q[j], F.base_v[j]
    hit = top = torque = 0.0
    F.impact_speed = F.impact_energy = F.reach = 0.0
    F.lowest = F.highest = supposed.q[i]
    for k in range(steps):
        for c in range(faults.working):
            j = faults.order[c]
            F.a[j] = planned(supposed, K.limits, F, j, phase + k * dt, left - k * dt, dt)
        sync_model(K)
        F.reach = max(F.reach, farthest(kinematics, n, F))
        inertia = kinematics.M[i, i]
        impact, share = swing_on(supposed, faults, K.limits, kinematics, chain, F, dt)
        if impact > 0.0 and F.impact_speed == 0.0:
            F.impact_speed, F.impact_time = impact, (k + 1) * dt
            F.impact_energy = 0.5 * inertia * impact * impact
            F.side = -1 if supposed.q[i] <= K.limits.q_min[i] else 1
        hit = max(hit, impact)
        top = max(top, abs(supposed.v[i]))
        torque = max(torque, share - TORQUE_SHARE)
        F.lowest, F.highest = min(F.lowest, supposed.q[i]), max(F.highest, supposed.q[i])
        if hit + TOP_SPEED * top + torque > give_up:
            return give_up + 1.0
    F.reach = sqrt(F.reach)
    if not is_worth(F, F.reach, F.impact_energy, 0.0):
        hit += TOO_FAR
    way = 0.0
    for c in range(faults.working):
        j = faults.order[c]
        way += abs(supposed.q[j] - F.base_q[j])
    return hit + FINAL_SPEED * abs(supposed.v[i]) + TOP_SPEED * top + torque + TRAVEL * way


@jit
def _later_impact(K: Any, F: Any) -> float:
    """How fast the free joint meets a stop later, all others at rest; 0 where it comes to hang before.

    Others at rest make it a pendulum: M_ii is constant, and of a revolute joint gravity's torque is
    g cos d + g' sin d, d the way it has gone. It is followed for 20 s. One that still lingers near a posture
    from which gravity carries it away, g' < 0, falls later: inf. One without gravity drifts, whatever the
    others do: 0.
    """
    i, supposed, limits, coulomb = F.joint, K.supposed, K.limits, K.faults.coulomb[F.joint]
    inertia, turns = K.kinematics.M[i, i], K.chain.prismatic[i] == 0
    forward_kinematics(K, K.supposed)
    torque = gravity_torque(K.kinematics, K.chain, i, F.slope)
    slope = steep = F.slope[i]
    if abs(torque) < NO_SLOPE and abs(slope) < NO_SLOPE:
        return 0.0
    friction, begun, q, v = (
        viscous_friction(K.faults, K.chain, i),
        supposed.q[i],
        supposed.q[i],
        supposed.v[i],
    )
    for _ in range(LATER_STEPS):
        g = torque
        if turns:
            s, c = sin(q - begun), cos(q - begun)
            g, steep = torque * c + slope * s, slope * c - torque * s
        v = free_velocity(inertia, -g - friction * v, v, friction, coulomb, LATER_STEP)
        q += LATER_STEP * v
        if (q <= limits.q_min[i] and v <= 0.0) or (q >= limits.q_max[i] and v >= 0.0):
            return abs(v)
        if (abs(v) < HANGING and steep > NO_SLOPE) or (v == 0.0 and abs(g) < coulomb):
            return 0.0
    return 0.0 if steep > -NO_SLOPE else inf


@jit
def weigh_holding(K: Any, F: Any) -> tuple[float, float]:
    """How far links go, and the energy of the free joint's impact, if the others brake and hold still."""
    i, supposed, limits = F.joint, K.supposed, K.limits
    look_ahead(K, F, 0.0, 0.0, inf, LONG_STEPS)
    reach, energy = F.reach, F.impact_energy
    stands = supposed.q[i] <= limits.q_min[i] or supposed.q[i] >= limits.q_max[i]
    if F.impact_speed == 0.0 and not stands:
        later = _later_impact(K, F)
        energy = 0.5 * K.kinematics.M[i, i] * later * later
    return reach, energy


@jit
def begin_judging(K: Any, F: Any) -> None:
    """From here on plans are compared with holding still; needs the state of the arm in the room supposed."""
    for j in range(K.chain.n):
        F.base_q[j], F.base_v[j] = F.q[j], F.v[j]
        K.supposed.q[j], K.supposed.v[j] = F.q[j], F.v[j]
    forward_kinematics(K, K.supposed)
    mark_places(K.kinematics, K.chain.n, F)
    F.held_reach, F.held_energy = weigh_holding(K, F)


@jit
def braking_is_safe(K: Any, F: Any) -> bool:
    """Whether all joints may brake from ``base_q``, ``base_v`` on."""
    i, supposed, limits = F.joint, K.supposed, K.limits
    look_ahead(K, F, 0.0, 0.0, inf, LONG_STEPS)
    if F.impact_speed > TOUCH_SPEED:
        return False
    stands = supposed.q[i] <= limits.q_min[i] or supposed.q[i] >= limits.q_max[i]
    return stands or _later_impact(K, F) <= SOFTLY


@jit
def try_another(K: Any, F: Any) -> None:
    """Try the next other value of the plan, joint by joint, segment by segment; keep what is better."""
    faults = K.faults
    at = F.candidate
    F.candidate = (at + 1) % (SEGMENTS * faults.working * VALUES)
    value = at % VALUES
    j = faults.order[(at // VALUES) % faults.working]
    s = at // (VALUES * faults.working)
    old = F.plan[s, j]
    if value >= old + 1.0:
        value += 1
    F.plan[s, j] = value - 1.0  # the values -1, 0, 1, 2 in order, without its own
    cost = look_ahead(K, F, F.base_phase, F.left, F.best - GAIN_NEEDED, HORIZON_STEPS)
    if cost < F.best - GAIN_NEEDED:
        F.best = cost
    else:
        F.plan[s, j] = old


@jit
def search(K: Any, F: Any) -> None:
    """One rollout: of the present plan from the present state every 5 ms, else of another plan."""
    n = K.chain.n
    if F.countdown <= 0:
        for j in range(n):
            F.base_q[j], F.base_v[j] = F.q[j], F.v[j]
        F.base_phase = F.phase
        F.best = look_ahead(K, F, F.phase, F.left, inf, HORIZON_STEPS)
        if F.best >= TOO_FAR and F.left > 0.0:  # what has become of this plan is worse than to hold still
            begin_plan(F, n)
            F.best = look_ahead(K, F, F.phase, F.left, inf, HORIZON_STEPS)
        F.countdown = F.period
        F.quiet = 1 if F.impact_speed == 0.0 and F.best <= SETTLING_COST else 0
        free = K.free
        F.clear_for += 1
        if F.impact_speed > 0.0:
            F.clear_for, free.impact_side = 0, F.side
            free.impact_time, free.impact_speed = F.impact_time, F.impact_speed
            free.impact_energy = F.impact_energy
        elif F.clear_for > CLEAR_FOR:
            free.impact_side = 0
        free.swing, free.reach = 0.5 * (F.highest - F.lowest), F.reach
    elif not F.quiet and F.left > 0.0:
        try_another(K, F)
