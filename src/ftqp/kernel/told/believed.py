"""What is believed of a joint, as its code and its limits."""

from math import inf
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.latches.giving_up import restore
from ftqp.kernel.layout.enums import AS_TOLD, BRAKING, FREE, HEALTHY, INSTANT, LOCKED, MEASURED, TORQUE_DRIVE
from ftqp.kernel.layout.other_records import IS_LOCKED_NOW, SWINGS_NOW
from ftqp.kernel.told.measured import who_leads, window_ticks

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
        if faults.code[i] != FREE:  # else it is known to swing, and only its friction is told
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
    for p in range(scene.pairs):
        scene.look[p] = 0


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
    if K.feedback.kind == TORQUE_DRIVE or K.feedback.fresh == AS_TOLD or K.feedback.exact:
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
