"""What is believed of a joint, as its code and its limits."""

from math import inf
from typing import Any

from ftqp.kernel.arm.dynamics import dynamics, join
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.latches.settling import latch, restore
from ftqp.kernel.layout.enums import (
    AS_STATED,
    BRAKING,
    FREE,
    HEALTHY,
    INSTANT,
    IS_BIASED,
    IS_DROPPED,
    IS_FREE,
    IS_FROZEN,
    LOCKED,
    MAKE_UP,
    MEASURED,
    STOPPED_BY_SECOND_FREE,
    TORQUE_DRIVE,
    VELOCITY,
)
from ftqp.kernel.layout.other_records import DOUBTED, IS_LOCKED_NOW, LEFT_ALONE, SWINGS_NOW, WORKS_STILL
from ftqp.kernel.maths.linear_systems import assign

WINDOW = 0.05
"""Motion that is looked at as a whole [s]. A convention: a joint that falls has gone 12 mrad by then."""
LEAST_SAMPLES = 8
"""Samples of a window at least, because a line through fewer leaves hardly anything of their noise."""


@jit
def window_ticks(dt: float) -> int:
    """Ticks of a window."""
    return max(LEAST_SAMPLES, int(WINDOW / dt + 0.5))


@jit
def who_leads(faults: Any, chain: Any, free: Any) -> None:
    """The search begins anew where a joint swings; where joints are only measured, the task leads."""
    measured = -1
    for i in range(chain.n):
        if faults.code[i] == FREE:
            free.joint = -1
            return
        if faults.code[i] == MEASURED and measured < 0:
            measured = i
    if measured >= 0:
        free.joint, free.mode, free.impact_side = measured, MAKE_UP, 0


LOCK_SHARE = 0.25
"""Default deceleration of a joint that is being locked, as a share of its acceleration limit.

With the full limit healthy joints saturate when they compensate (``docs/theory/joint-failures.md``).
"""


@jit
def _limit(limits: Any, given: Any, fault: Any, i: int) -> None:
    """The limits that are left of joint i: a share of each, and the part of its range that was said."""
    limits.v_max[i] = given.v_max[i] * fault.velocity
    limits.a_max[i] = given.a_max[i] * fault.acceleration
    limits.tau_max[i] = given.tau_max[i] * fault.torque if given.torque_limits else inf
    low, high = given.q_min[i], given.q_max[i]
    limits.q_min[i] = max(fault.q_min, low) if abs(fault.q_min) < inf else low
    limits.q_max[i] = min(fault.q_max, high) if abs(fault.q_max) < inf else high


@jit
def _lock(faults: Any, given: Any, fault: Any, i: int, was: int) -> None:
    """Lock joint i: locked it stays so, braking it goes on from where it is."""
    rate = fault.deceleration
    faults.lock_rate[i] = rate if abs(rate) < inf else LOCK_SHARE * given.a_max[i]
    faults.reset_mode = fault.reset
    if was == LOCKED:
        return
    faults.code[i] = INSTANT if fault.mode == 1 else BRAKING


@jit
def believe(faults: Any, limits: Any, given: Any, fault: Any, goes_on: int) -> None:
    """Believe a fault of a joint, or that it works, whatever was believed of it before."""
    i = fault.joint
    was = faults.code[i] if goes_on else HEALTHY
    _limit(limits, given, fault, i)
    faults.friction[i] = faults.coulomb[i] = 0.0
    if fault.kind == IS_LOCKED_NOW:
        _lock(faults, given, fault, i, was)
    elif fault.kind == SWINGS_NOW:
        if faults.code[i] != FREE:  # else it is known to swing, and only its friction is given
            faults.code[i] = MEASURED
        faults.friction[i] = fault.damping
        faults.coulomb[i] = fault.friction + given.coulomb[i]
    else:
        faults.code[i] = HEALTHY


@jit
def swings(faults: Any, chain: Any) -> bool:
    """Whether a joint is believed to have neither motor nor brake."""
    for i in range(chain.n):
        if faults.code[i] == FREE or faults.code[i] == MEASURED:
            return True
    return False


@jit
def falls(faults: Any, chain: Any) -> bool:
    """Whether one of them is held to swing as its dynamics say."""
    for i in range(chain.n):
        if faults.code[i] == FREE:
            return True
    return False


@jit
def swing_as_foretold(K: Any) -> None:
    """Of joints that are measured it is foretold that they swing, until a sample says that they do not.

    So it is where every sample has been the command: such an arm is a model, or it rests; and at the begin.
    Beside torque drives it is foretold whatever is seen (docs/theory/free-swinging.md, "Measured first").
    """
    for i in range(K.chain.n):
        if K.faults.code[i] == MEASURED:
            K.faults.code[i] = FREE
            K.free.trust[i] = 0 if K.feedback.kind == TORQUE_DRIVE else window_ticks(K.state.dt)


@jit
def look_again(scene: Any) -> None:
    """Every pair of bodies is looked at in the next tick: what the arm can brake is another now."""
    scene.look[: scene.pairs] = 0


@jit
def begin_to_believe(K: Any, given: Any) -> None:
    """After another joint is believed to have failed, or to work: what begins anew with it."""
    free = K.free
    K.qp.warm = K.watch.stopped = 0
    K.task.late, K.task.wait = 0, K.task.patience
    now = swings(K.faults, K.chain)
    K.limits.dynamic = 1 if given.dynamic or now else 0
    if not now and not given.swings:
        return
    free.joint = -1
    free.window = 0
    for i in range(K.chain.n):
        free.contact[i], free.tau_stop[i] = 0, 0.0
    if K.feedback.kind == TORQUE_DRIVE or K.feedback.fresh == AS_STATED or K.feedback.exact:
        swing_as_foretold(K)
    who_leads(K.faults, K.chain, free)
    if now:
        free.allowed = given.allowed
        K.cascade.external = 0
    else:
        free.impact_side = 0
        K.cascade.external = given.external
        restore(K.task, K.terms, K.qp)
    given.swings = 1 if now else 0


UNKNOWN_ERROR = 1.0
"""What a failure leaves of the error before it is found, in thresholds of the emergency stop beside the one:
nobody could keep the task meanwhile. It ends where the arm can rest within the threshold."""


@rare_jit
def respond(K: Any, given: Any, i: int) -> int:
    """What becomes of joint i by what the monitor says of it now, what is known of it by others aside.

    WORKS_STILL where a finding is taken back, IS_LOCKED_NOW, SWINGS_NOW; LEFT_ALONE where nothing is new, or
    the arm is stopped because of its sensor; DOUBTED where it seems to swing beside another that has failed,
    and the arm is stopped.
    """
    found, last = K.monitor.found[i], K.monitor.counted[i]
    K.monitor.news = 0
    K.monitor.counted[i] = found
    if found == last:
        return LEFT_ALONE
    if found == 0:
        return WORKS_STILL
    K.watch.left = max(K.watch.left, UNKNOWN_ERROR)
    if (found == IS_BIASED or found == IS_DROPPED or found == IS_FROZEN) and K.watch.latched:
        return LEFT_ALONE
    if found != IS_FREE:
        return IS_LOCKED_NOW
    for j in range(K.chain.n):
        if K.faults.code[j] != HEALTHY:
            if K.watch.latched == 0:
                latch(K.watch, STOPPED_BY_SECOND_FREE)
            return DOUBTED
    return SWINGS_NOW if given.may_swing else IS_LOCKED_NOW


@rare_jit
def believe_found(K: Any, given: Any) -> None:
    """Believe what becomes of each joint by ``respond``, where nobody else does."""
    faults = K.faults
    for i in range(K.chain.n):
        becomes = respond(K, given, i)
        if becomes == IS_LOCKED_NOW:
            faults.lock_rate[i] = LOCK_SHARE * given.a_max[i]
            faults.code[i] = BRAKING
        elif becomes == SWINGS_NOW:
            faults.code[i] = MEASURED
            faults.friction[i], faults.coulomb[i] = 0.0, given.coulomb[i]
        elif becomes == WORKS_STILL:
            faults.code[i] = HEALTHY
    begin_to_believe(K, given)
    look_again(K.scene)
    if swings(faults, K.chain):  # as ``count_on`` has it; a lock leaves the rest of that as it is
        K.limits.on_demand, K.limits.guard = 0, 0.0


@jit
def forget_finding(K: Any, i: int) -> None:
    """What was found of joint i, and that its sensor was lost: another says what becomes of it."""
    M = K.monitor
    M.found[i] = M.counted[i] = 0
    K.feedback.lost[i], K.feedback.spent[i] = 0, 0.0
    M.G[i] = M.G_lock[i] = M.G_free[i] = 0.0


MARGIN = 1.3
"""Bias and inertia beyond what was sampled that ``guard`` allows for."""
LEAST_SHARE = 0.05
"""Share of a_max that braking counts on at least, so that it counts on something where gravity leaves
nothing."""

HOLD_SHARE = 0.98
"""Share of the torque left of a joint that has lost some with which motions are planned, so that the rest is
there for what its servo adds: a joint without it was left behind by its reference, until it fell. A guess."""


@jit
def sample(K: Any, rows: Any) -> None:
    """|h| and |M| of an arm at states: each row has q and v, (n,), and gets |h|, (n,), and |M|, (n, n)."""
    state, kinematics, n = K.state, K.kinematics, K.chain.n
    for s in range(len(rows)):
        row = rows[s]
        for i in range(n):
            state.q[i], state.v[i] = row[i], row[n + i]
        forward_kinematics(K, state)
        motion(K, state)
        dynamics(K, state)
        for i in range(n):
            row[2 * n + i] = abs(kinematics.h[i])
            for j in range(n):
                row[3 * n + i * n + j] = abs(kinematics.M[i, j])


@jit
def _kappa(rows: Any, n: int, a_max: Any, tau_max: Any, margin: float) -> float:
    """The largest kappa with |h_i| + kappa sum_j |M_ij| a_max_j <= tau_max_i in all samples."""
    least = inf
    for s in range(len(rows)):
        row = rows[s]
        for i in range(n):
            left = tau_max[i] - margin * row[2 * n + i]
            if left < inf:
                needed = 0.0
                for j in range(n):
                    needed += row[3 * n + i * n + j] * a_max[j]
                least = min(least, left / (margin * needed))
    return least


@jit
def reserve(rows: Any, n: int, a_max: Any, tau_max: Any, out: Any) -> None:
    """The shares of a_max with which every joint can brake at once, and up to which torque limits hold."""
    out.share = min(max(_kappa(rows, n, a_max, tau_max, 1.0), LEAST_SHARE), 1.0)
    out.guard = min(max(_kappa(rows, n, a_max, tau_max, MARGIN), 0.0), 1.0)


@jit
def count_on(K: Any, given: Any, rows: Any, out: Any) -> None:
    """The deceleration that viability counts on, and when torque limits are looked at."""
    limits, n, limited = K.limits, K.chain.n, len(rows) > 0
    look_again(K.scene)
    limits.weakened = 0
    for i in range(n):
        weak = limited and K.faults.code[i] == HEALTHY and limits.tau_max[i] < given.tau_max[i]
        limits.tau_hold[i] = HOLD_SHARE * limits.tau_max[i] if weak else inf
        limits.weakened += 1 if weak else 0
    on_demand = limited and given.on_demand != 0 and limits.weakened == 0 and not swings(K.faults, K.chain)
    out.share = 1.0
    out.guard = 0.0
    if limited:
        reserve(rows, n, limits.a_max, limits.tau_max, out)
    for i in range(n):
        limits.a_brake[i] = out.share * limits.a_max[i]
    limits.on_demand = 1 if on_demand else 0
    limits.guard = out.guard if on_demand and K.state.level == VELOCITY else 0.0


@jit
def load(chain: Any, given: Any, payload: Any) -> None:
    """The body at the tip with a load instead of the last one; mass 0 is none."""
    body, R, t, c = given.body, given.tip_rotation, given.tip_translation, payload.com
    join(
        chain, body, given.body_mass, given.body_com, given.body_inertia, given.body_stoutness, payload.mass,
        t[0] + R[0] * c[0] + R[1] * c[1] + R[2] * c[2],
        t[1] + R[3] * c[0] + R[4] * c[1] + R[5] * c[2],
        t[2] + R[6] * c[0] + R[7] * c[1] + R[8] * c[2],
    )  # fmt: skip
    I, own = payload.inertia, chain.inertia[body]
    k = 0
    for r in range(3):
        for s in range(r, 3):
            for a in range(3):
                for b in range(3):
                    own[k] += R[3 * r + a] * I[3 * a + b] * R[3 * s + b]
            k += 1
    chain.stoutness[body] += 0.5 * (I[0] + I[4] + I[8])


@jit
def carry(K: Any, A: Any, given: Any, payload: Any) -> None:
    """The arm by itself and the record's with a load; what was learned of it before is learned anew."""
    load(A.chain, given, payload)
    learned, chain = K.learned, K.chain
    if learned.based:
        assign(chain.armature, learned.base_armature, chain.n)
    load(chain, given, payload)
    learned.based = 0
    learned.load[:4] = 0.0
