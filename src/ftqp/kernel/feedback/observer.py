"""Where each joint is, how fast it moves, and what acceleration disturbs it: three states a joint."""

from typing import Any

from ftqp.kernel.arm.dynamics import dynamics
from ftqp.kernel.arm.kinematics import forward_kinematics, motion
from ftqp.kernel.feedback.error_band import redistribute_disturbance
from ftqp.kernel.feedback.inertia_equations import sense
from ftqp.kernel.feedback.reference import return_to_work
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import ACCELERATION, HEALTHY, TORQUE_DRIVE
from ftqp.kernel.layout.thresholds import FASTEST, UNLIMITED
from ftqp.kernel.maths.elementary import any_of, larger, select, smaller
from ftqp.kernel.maths.side_by_side import WIDTH, is_set, load_lanes, store_lanes


@jit
def advanced(state: Any, q: Any, v: Any, a: Any) -> tuple[Any, Any]:
    """(q, v) after dt at the acceleration a, by the planner's own formula of its level."""
    dt = state.dt
    after = v + dt * a
    return (q + dt * (v + 0.5 * dt * a) if state.level == ACCELERATION else q + dt * after), after


@jit
def corrected(state: Any, z: Any, q: Any, v: Any, e: Any) -> tuple[Any, Any, Any]:
    """(q^, v^) from the predicted (q, v) and the innovation e, and the change of d^; z is the pole."""
    dt, s = state.dt, 1.0 - z
    return q + (1.0 - z * z * z) * e, v + 1.5 * s * s * (1.0 + z) / dt * e, s * s * s / (dt * dt) * e


@jit
def plausible(state: Any, v: Any, d: Any, v_max: Any) -> tuple[Any, Any]:
    """(v^, d^) as any joint may have them: |v| <= 2 v_max and 30 at least, |d| <= 2 of that within dt.

    A wrong sensor of a failed joint would else lead the observer, and what the others get of
    inertia and gravity, out of all bounds.
    """
    top = smaller(larger(2.0 * v_max, FASTEST), UNLIMITED)
    most = 2.0 * top / state.dt
    return smaller(larger(v, -top), top), smaller(larger(d, -most), most)


@jit
def predicted(
    state: Any, limits: Any, feedback: Any, q: float, v: float, a: Any, i: int, d: float
) -> tuple[float, float]:
    """(q, v) of the samples' time brought to now by what was sent since, column i of the ring a, and d."""
    for ago in range(feedback.latency, 0, -1):
        q, v = advanced(state, q, v, a[slot(feedback, ago), i] + d)
        v, d = plausible(state, v, d, limits.v_max[i])
    return q, v


@jit
def _observe_joint(K: Any, i: int, then: int, before: int, first: bool) -> None:
    """The observer of joint i, whatever becomes of it."""
    feedback, past, faults = K.feedback, K.past, K.faults
    healthy = faults.code[K.chain.lead[i]] == HEALTHY
    if healthy:
        if feedback.known_failed[i]:
            return_to_work(K, i)
        feedback.known_failed[i] = 0
    elif not feedback.known_failed[i]:
        feedback.known_failed[i] = 1
        if feedback.kind == TORQUE_DRIVE:
            redistribute_disturbance(K, i)
        for ago in range(feedback.latency + 2):
            past.a[slot(feedback, ago), i] += feedback.d_hat[i]
        feedback.d_hat[i] = feedback.tau_slow[i] = 0.0
        feedback.still[i] = 0
    z = feedback.pole if healthy else feedback.pole_failed
    if feedback.bad[i]:
        feedback.q_hat[i], feedback.v_hat[i] = feedback.seen[i], past.v[then, i]
    elif not first:
        q, v = advanced(K.state, feedback.q_hat[i], feedback.v_hat[i], past.a[before, i] + feedback.d_hat[i])
        e = feedback.innovation[i] = feedback.seen[i] - q
        feedback.q_hat[i], v, change = corrected(K.state, z, q, v, e)
        v, d = plausible(K.state, v, feedback.d_hat[i] + change, K.limits.v_max[i])
        feedback.v_hat[i], feedback.d_hat[i] = v, d
    q, v = feedback.q_hat[i], feedback.v_hat[i]
    if not healthy or feedback.kind == TORQUE_DRIVE:
        q, v = predicted(K.state, K.limits, feedback, q, v, past.a, i, feedback.d_hat[i])
    feedback.q_now[i], feedback.v_now[i] = q, v


@jit
def _observe_block(
    state: Any, faults: Any, limits: Any, feedback: Any, past: Any, learned: Any, at: int, before: int
) -> bool:
    """The observers of the joints from ``at`` on; False where one of them is in no regular state.

    It is regular where its sample is good and its failure, if it has failed, was known a tick ago.
    """
    failed = is_set(faults.code, at)
    known = is_set(feedback.known_failed, at)
    odd = is_set(feedback.bad, at) | (failed & ~known) | (known & ~failed)
    if any_of(odd):
        return False
    d = load_lanes(feedback.d_hat, at)
    q, v = advanced(
        state,
        load_lanes(feedback.q_hat, at),
        load_lanes(feedback.v_hat, at),
        load_lanes(past.a[before], at) + d,
    )
    e = load_lanes(feedback.seen, at) - q
    q, v, change = corrected(state, select(failed, feedback.pole_failed, feedback.pole), q, v, e)
    v, d = plausible(state, v, d + change, load_lanes(limits.v_max, at))
    store_lanes(feedback.innovation, at, e)
    store_lanes(feedback.q_hat, at, q)
    store_lanes(feedback.v_hat, at, v)
    store_lanes(feedback.d_hat, at, d)
    store_lanes(feedback.q_now, at, q)
    store_lanes(feedback.v_now, at, v)
    return True


@jit
def observe(K: Any, first: bool) -> None:
    """(q^, v^, d^) of the samples' time, and (q^, v^) predicted over the latency to now.

    q- = q^ + dt v^ + dt^2/2 (a + d^),  v- = v^ + dt (a + d^),  e = q_u - q-
    q^ = q- + (1 - z^3) e,  v^ = v- + 3/2 (1 - z)^2 (1 + z)/dt e,  d^ += (1 - z)^3/dt^2 e

    a is the acceleration that was sent then. A joint whose sample was refused is put on the reference, so
    that its feedback is off.
    Source: docs/theory/feedback.md, "The observer".
    """
    feedback = K.feedback
    then, before = slot(feedback, feedback.latency), slot(feedback, feedback.latency + 1)
    together = feedback.latency == 0 and not first and not feedback.softened
    together = together and feedback.thrown == 0.0
    for at in range(0, K.chain.n, WIDTH):
        if not together or not _observe_block(
            K.state, K.faults, K.limits, feedback, K.past, K.learned, at, before
        ):
            for i in range(at, min(at + WIDTH, K.chain.n)):
                _observe_joint(K, i, then, before, first)


@rare_jit
def dynamics_at_estimate(K: Any) -> None:
    """M and h at the observed state, kept aside for the torque law.

    Friction is that of the commanded velocity, and what was learned of dry friction is a part of h: friction
    that is fed forward by what is measured is negative damping where the arm has less of it.
    """
    feedback, supposed, kinematics = K.feedback, K.supposed, K.kinematics
    n = K.chain.n
    for i in range(n):
        supposed.q[i], supposed.v[i] = feedback.q_now[i], feedback.v_now[i]
    forward_kinematics(K, supposed)
    motion(K, supposed)
    dynamics(K, supposed)
    for i in range(n):
        feedback.h[i] = kinematics.h[i]
        if K.faults.code[i] == HEALTHY:
            v = K.state.v_command[i]
            feedback.h[i] += K.chain.viscous[i] * (v - supposed.v[i]) + K.learned.friction[i] * sense(v)
        for j in range(n):
            feedback.M[i, j] = kinematics.M[i, j]
