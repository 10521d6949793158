"""What is sent to the arm, by what it takes: positions, velocities or torques."""

from typing import Any

from ftqp.kernel.arm.kinematics import mimic
from ftqp.kernel.feedback.disturbance import follow_disturbance
from ftqp.kernel.feedback.held import CREEPS
from ftqp.kernel.feedback.pairs import gain_reduced
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit, part_jit, rare_jit
from ftqp.kernel.layout.enums import HEALTHY, LOCKED, STOPPED, TORQUE_DRIVE, VELOCITY_DRIVE
from ftqp.kernel.maths.elementary import sqrt
from ftqp.kernel.maths.linear_systems import factor, solve_factored
from ftqp.kernel.maths.side_by_side import WIDTH, load_lanes, store_lanes
from ftqp.kernel.monitor.leading import ahead, blend, held_by, keep_found, lead_joint

FEED_FORWARD_SHARE = 0.3
"""The disturbance is fed forward up to this share of a joint's torque limit."""
FEEDBACK_SHARE = 0.6
"""The feedback of a joint asks its own inertia for up to this share of its torque limit. With 0.3 arms did
not withstand a push, and 0.6 is a guess."""

SLIPS, SLIP_SIGMAS = 0.1, 10.0
"""A locked joint observed to be faster than this [rad/s or m/s], beside so many standard deviations of noise,
has a brake that slips: a Panda shook itself at twice its speed limits beside one (docs/theory/feedback.md,
"The torque drive")."""


@jit
def _swing(state: Any, faults: Any, feedback: Any, chain: Any, free: Any, i: int, wanted: Any) -> None:
    """What a free-swinging joint does when the others do what is wanted, feedback included.

    (M_ii + dt d) a_i = -h_i - M_ih a_h - d v_i, 0 on its stop. With the acceleration that it had without the
    feedback, the others' loop would be as much too stiff as their inertia beside a free joint is smaller, and
    so would what is fed forward: no disturbance of the others acts on it, so that M_i: d = 0.
    """
    M = feedback.M
    if free.contact[i]:
        wanted[i] = 0.0
        return
    total = -feedback.h[i] - faults.friction[i] * feedback.v_now[i]
    for j in range(chain.n):
        if j != i:
            total -= M[i, j] * wanted[j]
    wanted[i] = total / (M[i, i] + state.dt * (faults.friction[i] + chain.viscous[i]))


@jit
def _slip(state: Any, faults: Any, feedback: Any, i: int, wanted: Any) -> None:
    """What the others' feedback does to a joint whose brake slips: a_i = -M_ih (a_h - a_r,h)/M_ii.

    As beside a free joint, their loop would be too stiff if they took it to stand.
    """
    M = feedback.M
    total = 0.0
    for k in range(faults.working):
        j = faults.order[k]
        total -= M[i, j] * (wanted[j] - state.a_command[j])
    wanted[i] = total / M[i, i]


@jit
def _model_torque(feedback: Any, chain: Any, i: int, wanted: Any) -> float:
    """(M a + h)_i of the accelerations that are wanted."""
    tau: float = feedback.h[i]
    for j in range(chain.n):
        tau += feedback.M[i, j] * wanted[j]
    return tau


@jit
def _forward(limits: Any, feedback: Any, chain: Any, i: int) -> float:
    """clip(-(M d)_i, +-0.3 tau_max) of the observed disturbance."""
    most = FEED_FORWARD_SHARE * limits.tau_max[i]
    return min(max(-feedback.tau_slow[i], -most), most)


@jit
def _farthest_beyond(faults: Any, limits: Any, feedback: Any, chain: Any, count: int, wanted: Any) -> int:
    """The joint farthest beyond its torque limit, the first ``others`` aside, or -1; ``bent``: its sign."""
    tau_max = limits.tau_max
    worst, most = -1, 1.0
    for k in range(faults.working):
        i = faults.order[k]
        known = chain.lead[i] != i
        for a in range(count):
            known = known or feedback.others[a] == i
        if known:
            continue
        tau = _model_torque(feedback, chain, i, wanted) + _forward(limits, feedback, chain, i)
        if abs(tau) > most * tau_max[i]:
            worst, most = i, abs(tau) / tau_max[i]
            feedback.bent[i] = 1.0 if tau > 0.0 else -1.0
    return worst


@jit
def _share_limits(faults: Any, limits: Any, feedback: Any, chain: Any, scratch: Any, wanted: Any) -> None:
    """Joints S whose torques are at their limits get less of what is wanted, and the others know of it.

    M_SS Delta_S = +-tau_max_S - tau_S is added to their accelerations: else the others would answer ones that
    they do not have. S grows by the joint that is farthest beyond its limit, until there is none.
    """
    tau_max = limits.tau_max
    M, S, missing, full = feedback.M, scratch.square, scratch.impulse, feedback.others
    for count in range(1, faults.working + 1):
        worst = _farthest_beyond(faults, limits, feedback, chain, count - 1, wanted)
        if worst < 0:
            return
        full[count - 1] = worst
        for a in range(count):
            i = full[a]
            missing[a] = (
                feedback.bent[i] * tau_max[i]
                - _model_torque(feedback, chain, i, wanted)
                - _forward(limits, feedback, chain, i)
            )
            for b in range(a + 1):
                S[a, b] = M[i, full[b]]
        if not factor(S, count):
            return
        solve_factored(S, count, missing)
        for a in range(count):
            wanted[full[a]] += missing[a]


@jit
def _feedback(top: float, w: float, off: float, v: float, seen: float) -> float:
    """w^2 e + 2 w (v_r - v^) = 2 w (v_r + w/2 e - v^); it seeks no speed that the reference may not have."""
    top, sought = max(top, abs(v)), v + 0.5 * w * off
    if abs(sought) > top:
        return 2.0 * w * ((top if sought > 0.0 else -top) - seen)
    return w * w * off + 2.0 * w * (v - seen)


@jit
def _is_driven_on(K: Any, i: int) -> bool:
    """Whether joint i, which left its command in a stop and waits for its brake, would be sped up."""
    feedback = K.feedback
    waits = K.monitor.names and K.watch.latched != 0 and feedback.asks[i] != 0
    return bool(waits and feedback.tau_sent[i] * K.held.speed[i] > 0.0)


@jit
def _correct_beyond(K: Any, wanted: Any, beyond: Any) -> None:
    """What of corrections is ``beyond`` a_max: others go along only as far as healthy joints may be asked to.

    M_hj b_j is what joint h needs to stay where joint j corrects. It gets at most what a_max,h takes, and the
    motor of joint j what moves j by b_j all the same: else a joint that does not obey, and whose error grows,
    would throw the others about. The joints of a soft pair do not go along at all.
    Source: docs/theory/feedback.md, "The torque drive".
    """
    feedback, faults, M, S = K.feedback, K.faults, K.feedback.M, K.scratch.square
    moving, along, column, count, factored = feedback.others, K.scratch.wide[0], K.scratch.wide[1], 0, False
    for k in range(faults.working):
        if K.chain.lead[faults.order[k]] == faults.order[k]:
            moving[count] = faults.order[k]
            count += 1
    for k in range(count):
        j = moving[k]
        b = beyond[j]
        if b == 0.0:
            continue
        soft, whole = gain_reduced(feedback, j), True
        for a in range(count):
            h = moving[a]
            most = 0.0 if soft else K.limits.a_max[h] * M[h, h]
            along[a] = min(max(M[h, j] * b, -most), most)
            whole = whole and (h == j or along[a] == M[h, j] * b)
        if not whole and not factored:
            for a in range(count):
                for c in range(a + 1):
                    S[a, c] = M[moving[a], moving[c]]
            factored = factor(S, count)
        if whole or not factored:
            wanted[j] += b
            continue
        for a in range(count):
            column[a] = 1.0 if a == k else 0.0
        solve_factored(S, count, column)
        own = b
        for a in range(count):
            if a != k:
                own -= column[a] * along[a]
                feedback.reduced_torque[moving[a]] += along[a]
        feedback.reduced_torque[j] += own / column[k]


@rare_jit
def _torques(K: Any) -> None:
    """tau = M (a_r + b') + c + h + tau_ff, clipped; 0 where there is no motor.

    b = clip(w^2 (q_r - q^) + 2 w (v_r - v^), +-0.6 tau_max_i/M_ii) corrects a joint, b' = clip(b, +-a_max),
    and c makes the rest of b, see ``_correct_beyond``. tau_ff = clip(-M d, +-0.3 tau_max) of the observed
    disturbance. What was sent goes to the observer as the acceleration that the model makes of it, so that
    it knows saturation and its own feed-forward.
    Source: docs/theory/feedback.md, "The torque drive".
    """
    feedback, past, state, faults, limits = K.feedback, K.past, K.state, K.faults, K.limits
    M, wanted, extra = feedback.M, K.scratch.joints, K.scratch.impulse
    n, w, now = K.chain.n, feedback.stiffness, feedback.now
    follow_disturbance(K)
    for i in range(n):
        wanted[i] = state.a_command[i]
        feedback.reduced_torque[i] = extra[i] = 0.0
        if faults.code[i] == HEALTHY and not feedback.bad[i]:
            top = (1.0 - feedback.speed_margin) * limits.v_max[i]
            back = _feedback(top, w, state.q[i] - feedback.q_now[i], state.v[i], feedback.v_now[i])
            most = FEEDBACK_SHARE * limits.tau_max[i] / M[i, i]
            back = min(max(back, -most), most)
            near = 0.0 if gain_reduced(feedback, i) else min(max(back, -limits.a_max[i]), limits.a_max[i])
            wanted[i] += near
            extra[i] = back - near
    _correct_beyond(K, wanted, extra)
    for k in range(faults.working, faults.movable):
        _swing(state, faults, feedback, K.chain, K.free, faults.order[k], wanted)
    slips = SLIPS + SLIP_SIGMAS * feedback.sigma * feedback.failed_noise
    for k in range(faults.movable, n):
        i = faults.order[k]
        if faults.code[i] == LOCKED and abs(feedback.v_hat[i]) > slips:
            _slip(state, faults, feedback, i, wanted)
    _share_limits(faults, limits, feedback, K.chain, K.scratch, wanted)
    changed = False
    count = 0
    for k in range(faults.working):
        i = faults.order[k]
        if K.chain.lead[i] != i:
            feedback.tau_sent[i] = 0.0
            continue
        tau = _model_torque(feedback, K.chain, i, wanted)
        most = limits.tau_max[i]
        sent = tau + _forward(limits, feedback, K.chain, i) + feedback.reduced_torque[i]
        sent = min(max(sent, -most), most)
        extra[count] = sent - tau
        changed = changed or extra[count] != 0.0
        feedback.tau_sent[i] = sent
        feedback.others[count] = i
        count += 1
    for k in range(faults.working, n):
        feedback.tau_sent[faults.order[k]] = 0.0
    for i in range(n):
        if _is_driven_on(K, i):
            feedback.tau_sent[i] = 0.0
        past.a[now, i], past.tau[now, i] = wanted[i], feedback.tau_sent[i]
    if changed:
        S, moving = K.scratch.square, feedback.others
        for a in range(count):
            for b in range(count):
                S[a, b] = M[moving[a], moving[b]]
        if factor(S, count):
            solve_factored(S, count, extra)
            for k in range(count):
                past.a[now, moving[k]] += extra[k]
    if K.chain.mimics:
        mimic(K.chain, past.a[now])


@jit
def _stops_inside(K: Any, i: int, side: float) -> float:
    """How fast joint i may be sent to a side, so that it still comes to rest in its range.

    A servo that lags by T, the longest that is likely, moves it on by T v^ once it is sent nothing more, and
    that place goes at the speed that is sent: v^2 <= 2 a (q_max - q^ - T v^), within the speed limit.
    """
    limits, feedback = K.limits, K.feedback
    rests = feedback.q_hat[i] + K.monitor.response[i] * feedback.v_hat[i]
    left = limits.q_max[i] - rests if side > 0.0 else rests - limits.q_min[i]
    return float(min(limits.v_max[i], sqrt(2.0 * limits.a_brake[i] * max(left, 0.0))))


@jit
def _held(K: Any, i: int, off: float) -> float:
    """v_r + c a_r + k_q e + k_q^2/8 int e, within its bounds: a load unknown to a servo makes it slip.

    The integral part is never more than brings v to a bound, so that it does not wind up.
    """
    feedback, hold = K.feedback, held_by(K, i)
    asked = K.state.v_command[i] + ahead(K, i) + hold * off
    low, high = -_stops_inside(K, i, -1.0), _stops_inside(K, i, 1.0)
    wound = feedback.wound[i] + 0.125 * hold * hold * K.state.dt * off
    feedback.wound[i] = min(max(wound, min(low - asked, 0.0)), max(high - asked, 0.0))
    return float(min(max(asked + feedback.wound[i], low), high))


@jit
def _faded(state: Any, limits: Any, i: int, extra: float) -> float:
    """v_r and what is left of the last tick's feedback, which a_max takes away, within the velocity limit."""
    top, step = limits.v_max[i], limits.a_max[i] * state.dt
    left = max(abs(extra) - step, 0.0)
    v = state.v_command[i] + (left if extra > 0.0 else -left)
    return min(max(v, -top), top)


@jit
def _creep(limits: Any, feedback: Any, held: Any, i: int) -> float:
    """What a held arm is sent: what it needed lately to stand, and a little the way that was asked for."""
    return min(max(feedback.wound[i] + held.way[i] * CREEPS, -limits.v_max[i]), limits.v_max[i])


@jit
def _speed(K: Any, i: int) -> float:
    """What is sent to joint i of an arm that takes velocities."""
    state, limits, feedback, past = K.state, K.limits, K.feedback, K.past
    if K.held.on:
        return _creep(limits, feedback, K.held, i)
    if feedback.bad[i]:
        return _faded(state, limits, i, feedback.bent[i])
    off = past.q[slot(feedback, feedback.latency), i] - feedback.q_hat[i]
    return _held(K, i, off)


@part_jit
def send(K: Any) -> None:
    """q, v and tau for the arm's interface, from the reference that the planner has just commanded.

    position:  see ``ftqp.kernel.monitor.leading``
    velocity:  v_r + c a_r + k_q e + k_q^2/8 int e, e = q_r - q^ at the samples' time, within the limit
    torque:    see ``_torques``

    A joint that has failed gets no feedback, nor does one whose sample was refused: what a velocity arm had
    of it fades by a_max.
    """
    feedback, past, state, faults = K.feedback, K.past, K.state, K.faults
    if (feedback.refused or feedback.holding) and feedback.kind == VELOCITY_DRIVE:
        for i in range(K.chain.n):
            feedback.bent[i] = feedback.v_sent[i] - past.v[feedback.now, i]
    for at in range(0, K.chain.n, WIDTH):
        store_lanes(feedback.q_sent, at, load_lanes(state.q_command, at))
        store_lanes(feedback.v_sent, at, load_lanes(state.v_command, at))
    if not feedback.active:
        return
    now = feedback.now
    if feedback.kind == TORQUE_DRIVE:
        _torques(K)
        return
    for at in range(0, K.chain.n, WIDTH):
        store_lanes(past.a[now], at, load_lanes(state.a_command, at))
    most = second = 0.0
    bounded = K.monitor.sees != 0 and not K.held.on
    for k in range(faults.working):
        i = faults.order[k]
        if K.monitor.names and keep_found(K, i):
            continue
        if feedback.kind == VELOCITY_DRIVE:
            feedback.v_sent[i] = _speed(K, i)
        else:
            held_back = lead_joint(K, i, bounded)
            most, second = max(most, held_back), max(second, min(most, held_back))
    K.monitor.full = second if K.monitor.names and faults.working > 1 else most
    if K.monitor.sees and not K.watch.latched and K.cascade.outcome != STOPPED:  # there it stays
        blend(K)
