"""Rotors, a load and dry friction that the model of a torque arm lacks, learned while it moves.

No gain holds an arm whose rotors are fifty times what the model says of a wrist: what the heaviest needs
is too much for the lightest. So the inertia is learned, by least squares with exponential forgetting over
all joints, and the arm that formulas see is the model with what was learned.
Source: docs/theory/feedback.md, "What the model lacks".
"""

from math import sqrt
from typing import Any

from ftqp.kernel.arm.dynamics import join
from ftqp.kernel.feedback.doubt import bounded_limit
from ftqp.kernel.feedback.inertia_equations import SENSE, add_sample, take
from ftqp.kernel.feedback.inertia_squares import solve
from ftqp.kernel.feedback.learned_delay import KNOWN_AFTER, follow_delay, forget_delay
from ftqp.kernel.feedback.pairs import gain_reduced
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.feedback.touch import adopt
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import FREE, HEALTHY, MEASURED
from ftqp.kernel.layout.feedback_rooms import KEPT, UNKNOWNS
from ftqp.kernel.layout.thresholds import PUSHED

STUCK = 0.25
"""A joint slower than this share of ``SENSE`` sticks, if it should move."""
PUSHED_TIME = 0.5
"""Its friction is then taken for more and more, up to ``PUSHED`` of its torque limit within this time [s]."""
AT_LAST = 1.0
"""After this time [s] they count as distinguished."""
LEAST_MASS = 1e-3
"""A load lighter than this [kg] is none, because its place, its first moment by its mass, is noise."""
FARTHEST = 0.15
"""A load's centre is at most so far beyond the tip [m], as a wrong one has inertia by the square."""
SUSPECTED_TIME = 0.3
"""The rotor of a joint of a soft pair counts for all that may be missing after this time [s] at the earliest:
a motor that is dead looks like a rotor, too, but for less than 0.1 s (tests/control/test_pairs.py)."""
KEPT_FOR = 20
"""Estimates from one that is kept to the next: a tenth of a second. The oldest one that is kept, which is
gone back to, so is from half a second ago, longer than a fault goes unnoticed."""


@jit
def forget_learned(K: Any) -> None:
    """The arm is its model again, and nothing is known of what it lacks."""
    learned = K.learned
    for i in range(K.chain.n):
        learned.rotor[i] = learned.friction[i] = learned.used[i] = learned.slowness[i] = 0.0
        learned.sigma[i], learned.missed[i] = learned.doubt, 1.0
        learned.noise[i] = K.feedback.sigma * K.feedback.sigma
    for k in range(4):
        learned.load[k] = 0.0
    if learned.based:
        _apply(K)
    forget_delay(K)
    learned.based = learned.estimates = 0


@jit
def _begin(K: Any) -> None:
    """What the model says now is the base; what was learned beside it stays."""
    learned, chain = K.learned, K.chain
    body = chain.tip_joint
    learned.based = 1
    adopt(K)
    learned.base_mass = chain.mass[body]
    learned.base_lever, learned.base_stoutness = chain.lever[body], chain.stoutness[body]
    t = chain.tip_translation
    learned.reach = FARTHEST + sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2])
    for k in range(3):
        learned.base_com[k] = chain.com[body, k]
    for k in range(6):
        learned.base_inertia[k] = chain.inertia[body, k]
    for i in range(chain.n):
        learned.base_armature[i] = chain.armature[i]
    learned.working = K.faults.working
    _forget_news(K)
    _keep_alone(K)
    _apply(K)


@jit
def _forget_joint(learned: Any, i: int) -> None:
    """What joint i said counts no more."""
    for k in range(UNKNOWNS):
        learned.moment[i, k] = 0.0
        for l in range(UNKNOWNS):
            learned.information[i, k, l] = 0.0


@jit
def _forget_news(K: Any) -> None:
    """The filters begin anew, and what was added so far counts no more."""
    K.learned.samples = 0
    for i in range(K.chain.n):
        _forget_joint(K.learned, i)


@jit
def _keep(K: Any) -> None:
    """The present estimates are kept, and the oldest kept ones are not any more."""
    learned = K.learned
    learned.until_kept = KEPT_FOR
    for at in range(KEPT - 1, 0, -1):
        for i in range(K.chain.n):
            learned.kept_rotor[at, i] = learned.kept_rotor[at - 1, i]
            learned.kept_friction[at, i] = learned.kept_friction[at - 1, i]
            learned.kept_sigma[at, i] = learned.kept_sigma[at - 1, i]
        for k in range(4):
            learned.kept_load[at, k] = learned.kept_load[at - 1, k]
    for i in range(K.chain.n):
        learned.kept_rotor[0, i], learned.kept_friction[0, i] = learned.rotor[i], learned.friction[i]
        learned.kept_sigma[0, i] = learned.sigma[i]
    for k in range(4):
        learned.kept_load[0, k] = learned.load[k]


@jit
def _keep_alone(K: Any) -> None:
    """Of all that is kept nothing but the present estimates is left."""
    for _ in range(KEPT):
        _keep(K)


@jit
def _take_back(K: Any) -> None:
    """What was learned is what it was half a second ago."""
    learned = K.learned
    for i in range(K.chain.n):
        learned.rotor[i], learned.friction[i] = (
            learned.kept_rotor[KEPT - 1, i],
            learned.kept_friction[KEPT - 1, i],
        )
        learned.sigma[i] = learned.kept_sigma[KEPT - 1, i]
    for k in range(4):
        learned.load[k] = learned.kept_load[KEPT - 1, k]


@jit
def _go_back(K: Any) -> None:
    """A joint has failed, or works again: what was learned while nobody knew of it counts no more.

    What the others have said holds all the same, as their torques were what was sent, and counts again at
    once: a wrist that has to move now has no time to wait for other news.
    """
    learned = K.learned
    _take_back(K)
    for i in range(K.chain.n):
        if K.faults.code[i] != HEALTHY:
            _forget_joint(learned, i)
        if K.faults.code[i] == FREE or K.faults.code[i] == MEASURED:
            learned.friction[i], learned.until_free = K.faults.coulomb[i], learned.start
    _keep_alone(K)
    _apply(K)


@rare_jit
def forget_since_held(K: Any) -> None:
    """All joints are held: what was learned of their brakes, as friction and a load, counts no more."""
    if K.learned.on and K.learned.based:
        _take_back(K)
        K.learned.samples = 0
        _keep_alone(K)
        _apply(K)


@jit
def _weigh(K: Any, i: int, more: float) -> None:
    """Joint i counts so much heavier from now on: torques that were fed forward stay.

    So it is beside a failed joint, and as long as what the model lacks is not known yet.

    With m = M/(M + more) what was sent made m a, the disturbance beside it is d + (1 - m) a, and what is fed
    forward of it is m d.
    """
    feedback, past = K.feedback, K.past
    heavier = feedback.M[i, i] + more
    if more == 0.0 or not feedback.M[i, i] > 0.0 or not heavier > 0.0:
        return
    m = feedback.M[i, i] / heavier
    feedback.d_hat[i] += (1.0 - m) * past.a[slot(feedback, feedback.latency + 1), i]
    for s in range(feedback.span):
        past.a[s, i] *= m


@jit
def _apply(K: Any) -> None:
    """The arm that formulas see is the model with what was learned.

    Of a rotor its least likely value counts: a loop that takes a joint for lighter than it is stays stable.
    That of a joint of a soft pair counts for more little by little.
    """
    learned, chain = K.learned, K.chain
    for i in range(chain.n):
        least = max(abs(learned.rotor[i]) - learned.sigma[i], 0.0)
        used = least if learned.rotor[i] > 0.0 else -least
        if gain_reduced(K.feedback, i):
            used = min(used, learned.used[i] + learned.doubt * learned.every * K.state.dt / SUSPECTED_TIME)
        if K.faults.working < chain.n or not is_known(K.state, learned):
            _weigh(K, i, used - learned.used[i])
        learned.used[i] = used
        chain.armature[i] = learned.base_armature[i] + used
        if K.faults.code[i] == FREE:
            K.faults.coulomb[i] = learned.friction[i]
    body, m = chain.tip_joint, learned.load[0]
    if not m > LEAST_MASS:
        chain.mass[body] = learned.base_mass
        chain.lever[body], chain.stoutness[body] = learned.base_lever, learned.base_stoutness
        for k in range(3):
            chain.com[body, k] = learned.base_com[k]
        for k in range(6):
            chain.inertia[body, k] = learned.base_inertia[k]
        return
    x, y, z = learned.load[1] / m, learned.load[2] / m, learned.load[3] / m
    join(
        chain,
        body,
        learned.base_mass,
        learned.base_com,
        learned.base_inertia,
        learned.base_stoutness,
        m,
        x,
        y,
        z,
    )


@jit
def is_known(state: Any, learned: Any) -> bool:
    """Whether what the arm does beside its model has been learned, so that the rest of it is a fault.

    Where samples are refused so often that nothing is learned, a second is waited for it.
    """
    known: bool = learned.on == 0 or learned.estimates >= KNOWN_AFTER or state.ticks * state.dt > AT_LAST
    return known


@jit
def _pace(K: Any) -> None:
    """How fast each joint's disturbance is fed forward: as fast as is stable for what its inertia may be.

    With J the true inertia and M the model's a loop of the bandwidth w that feeds its disturbance forward
    at the corner c is stable if M/J > c w/((c + 2 w)(w + 2 c)), which is c/(2 w) where c is small; M/J
    may be M/(M + 2 sigma), and c is w/2 of it. A light joint that sticks would then wait for ever: it is
    pushed harder.
    """
    learned, feedback, M = K.learned, K.feedback, K.feedback.M
    for i in range(K.chain.n):
        inertia = M[i, i]
        share = inertia / (inertia + 2.0 * learned.sigma[i]) if inertia > 0.0 else 1.0
        learned.slowness[i] = learned.gain * share
        sticks = abs(feedback.v_hat[i]) < STUCK * SENSE and abs(K.state.v_command[i]) > SENSE
        most = PUSHED * bounded_limit(K.limits, i)
        if sticks and learned.friction[i] < most:
            learned.friction[i] += most * learned.every * K.state.dt / PUSHED_TIME


@jit
def _estimate(K: Any) -> None:
    """The least squares have the equations of this tick, too; every tenth of a second their solution is kept.

    The first one takes the place of the model, which is known to be wrong where the first one is.
    """
    learned = K.learned
    take(K)
    solve(K)
    follow_delay(K)
    learned.estimates += 1
    learned.until_kept -= 1 - K.feedback.softened  # what a suspected pair says is not gone back to
    if learned.estimates == KEPT_FOR:
        _keep_alone(K)
    elif learned.until_kept <= 0:
        _keep(K)
    _apply(K)


@rare_jit
def learn(K: Any, as_stated: bool, first: bool) -> None:
    """Learn from this tick's samples what the model lacks, and let the arm that formulas see have it.

    Every few ticks; the others only go through the filters. When a joint fails, or works again, what was
    learned lately is forgotten. A sample that was refused begins the filters anew.
    """
    learned, feedback = K.learned, K.feedback
    if not learned.on:
        return
    if as_stated:
        forget_learned(K)
    if not learned.based:
        _begin(K)
    if K.faults.working != learned.working:
        learned.working = K.faults.working
        _go_back(K)
    if feedback.refused or first:
        learned.samples = 0
    if feedback.refused:
        return
    add_sample(K)
    if learned.samples % learned.every == 0:
        if learned.samples > learned.wait:
            _estimate(K)
        _pace(K)
