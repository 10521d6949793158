"""What a torque arm's joints say of its inertia: filtered samples and torques, and one equation a joint.

    tau - ID(q, v, a) = R a + f sgn(v) + Y(q, v, a) (m, m c)

with R the inertia of each rotor, f the dry friction of each joint, and m and m c mass and first moment of
a load at the tip, all beside the model. Samples and torques go through the same low-pass filter, so that
the equation holds of what comes out.
Source: docs/theory/feedback.md, "What the model lacks".
"""

from math import sqrt
from typing import Any

from ftqp.kernel.arm.dynamics import torques_of
from ftqp.kernel.arm.kinematics import forward_kinematics, motion, moves, point_column
from ftqp.kernel.feedback.doubt import TORQUE_NOISE, bounded_limit
from ftqp.kernel.feedback.learned_delay import hear_delay
from ftqp.kernel.feedback.pairs import gain_reduced
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import FREE, HEALTHY
from ftqp.kernel.layout.feedback_rooms import POLES, UNKNOWNS
from ftqp.kernel.layout.hypotheses import TOUCHED
from ftqp.kernel.maths.vectors import cross, inner, plus, three, times

SENSE = 0.02
"""Slower than this [rad/s or m/s] a joint's dry friction is less than its whole."""
STANDS_STILL = 0.005
"""A joint with friction that is seen, and is to be, slower than this [rad/s or m/s] says nothing of its
rotor: friction holds it, and its accelerations are noise, which the loop passes on to its torques. Twice the
speed that noise of 5e-5 rad makes of one that stands."""
AT_REST = 1e-3
"""Slower than this [rad/s or m/s] an arm is taken to begin at rest."""
EXPERIENCED = 600
"""After so many estimates a push is no load that has not been learned yet: loads of 1 to 3 kg are, in the
campaigns, within some tenths of that."""


NOISY = 2.0
"""... and slower than so many standard deviations of the noise of its speed its sense is not known: torques
answer that noise, and would be taken for friction."""
NOISE_TIME = 0.1
"""The noise of the samples is measured in the mean over this time [s]: a hundred samples at 1 kHz, which know
it to a tenth."""


@jit
def torque_known(K: Any, i: int) -> bool:
    """Whether the torque of joint i is known: it works, or swings freely, away from its stops, without any.

    Not before the filters have forgotten what its motor gave; and after an impact no sample counts.
    """
    code = K.faults.code[i]
    heard: bool = code == HEALTHY or (code == FREE and K.free.contact[i] == 0 and K.learned.until_free == 0)
    return heard and K.feedback.thrown == 0.0


@jit
def sense(v: float) -> float:
    """The sense of a motion, in [-1, 1]: v/0.02, bounded."""
    return min(max(v / SENSE, -1.0), 1.0)


@jit
def _seen_sense(K: Any, i: int) -> float:
    """The sense in which joint i is seen to move, as far as noise lets it be seen, in [-1, 1]."""
    slow = max(SENSE, NOISY * K.held.sigma[i] * K.feedback.failed_noise)
    return min(max(K.feedback.v_hat[i] / slow, -1.0), 1.0)


@jit
def _filtered(learned: Any, filters: Any, i: int, x: float) -> float:
    """The low-pass filter of joint i, four poles in a row."""
    for k in range(POLES):
        x = filters[k, i] + learned.pole * (x - filters[k, i])
        filters[k, i] = x
    return x


@jit
def _measure_noise(learned: Any, i: int, q: float, dt: float) -> None:
    """The variance of a joint's samples; the third difference of white noise has 20 times that."""
    raw = learned.raw
    third = q - 3.0 * raw[0, i] + 3.0 * raw[1, i] - raw[2, i]
    raw[2, i], raw[1, i], raw[0, i] = raw[1, i], raw[0, i], q
    if learned.samples >= 3:
        learned.noise[i] += dt / NOISE_TIME * (third * third / 20.0 - learned.noise[i])


@jit
def add_sample(K: Any) -> None:
    """This tick's sample, and the torque that led to it, go through the filters.

    Of three filtered samples the middle one is looked at, and of two torques the mean, which is that of its
    time. Filters begin at rest and without torque: what they make of an equation that holds from then on is
    the same equation, whose constant parts are ``begun`` of the whole. Only where the arm already moves they
    have to forget that first.
    """
    learned, feedback, past, supposed = K.learned, K.feedback, K.past, K.supposed
    then, before = slot(feedback, feedback.latency), slot(feedback, feedback.latency + 1)
    dt, first = K.state.dt, learned.samples == 0
    if first:
        learned.wait = 0
        for k in range(POLES):
            learned.one[k] = 0.0
    else:
        one = 1.0
        for k in range(POLES):
            one = learned.one[k] + learned.pole * (one - learned.one[k])
            learned.one[k] = one
        learned.begun = one
    for i in range(K.chain.n):
        q, tau, sign = feedback.seen[i], past.tau[before, i], _seen_sense(K, i)
        if first:
            for k in range(POLES):
                learned.q[k, i], learned.tau[k, i], learned.sense[k, i] = q, 0.0, 0.0
            learned.q_was[0, i] = learned.q_was[1, i] = q
            learned.raw[0, i] = learned.raw[1, i] = learned.raw[2, i] = q
            learned.tau_was[i] = 0.0
            if abs(past.v[then, i]) > AT_REST:
                learned.wait = learned.start
        _measure_noise(learned, i, q, dt)
        q = _filtered(learned, learned.q, i, q)
        tau = _filtered(learned, learned.tau, i, tau)
        _filtered(learned, learned.sense, i, sign)
        last, oldest = learned.q_was[0, i], learned.q_was[1, i]
        supposed.q[i], supposed.v[i] = last, (q - oldest) / (2.0 * dt)
        learned.a[i] = (q - 2.0 * last + oldest) / (dt * dt)
        learned.sent[i] = 0.5 * (tau + learned.tau_was[i])
        learned.slope[i] = (tau - learned.tau_was[i]) / dt
        learned.q_was[1, i], learned.q_was[0, i] = last, q
        learned.tau_was[i] = tau
    learned.samples += 1
    learned.until_free = max(learned.until_free - 1, 0)


@jit
def _load_row(K: Any, i: int, A: Any, alpha: Any, w: Any) -> None:
    """Y_i: torque of joint i for a unit of mass and of each component of the first moment of a load.

    f = m A + alpha x c + w x (w x c) and n = c x A about the origin of the last frame, c = m c of the load.
    """
    row, chain = K.learned.row, K.chain
    row[2] = row[3] = row[4] = row[5] = 0.0
    _add_load(K, i, 1.0, A, alpha, w)
    if chain.mimics:
        for m in range(chain.n):
            if m != i and chain.lead[m] == i:
                _add_load(K, m, chain.ratio[m], A, alpha, w)


@jit
def _add_load(K: Any, i: int, share: float, A: Any, alpha: Any, w: Any) -> None:
    """The same of what joint i moves, times a share, added to the row."""
    learned, kinematics, chain = K.learned, K.kinematics, K.chain
    body, row = chain.tip_joint, learned.row
    if not moves(chain, i, body):
        return
    R = kinematics.R[body]
    x = point_column(kinematics, chain, i, three(kinematics.o[body]))
    row[2] += share * inner(x, A)
    for k in range(3):
        e = (R[k], R[3 + k], R[6 + k])
        row[3 + k] += share * inner(x, plus(cross(w, cross(w, e)), cross(alpha, e)))
        if not chain.prismatic[i]:
            row[3 + k] += share * inner(three(kinematics.axis_w[i]), cross(e, A))


@jit
def take(K: Any) -> None:
    """The equations of this tick, one a joint, are added to the least squares.

    A joint that is locked, whose number repeats oddly, or that mimics another says nothing, nor does any
    while something pushes the tip of an arm that has moved for a while; one of a soft
    pair says something of its own rotor, which may be why, and nothing of the load.
    """
    learned, feedback, supposed = K.learned, K.feedback, K.supposed
    chain, kinematics, a = K.chain, K.kinematics, learned.a
    pushed = feedback.touched > 0 or feedback.persistence[TOUCHED, 0] > 0
    share = learned.begun
    for i in range(chain.n):
        supposed.v[i] *= sqrt(share)
    forward_kinematics(K, supposed)
    motion(K, supposed)
    for i in range(chain.n):
        for k in range(3):
            kinematics.acc[i, k] += (1.0 - share) * chain.gravity[k]
    torques_of(supposed, kinematics, chain, a)
    body = chain.tip_joint
    A, alpha, w = three(kinematics.acc[body]), three(kinematics.alpha[body]), three(kinematics.w[body])
    for i in range(chain.n):
        if moves(chain, i, body):
            A = plus(A, times(a[i], point_column(kinematics, chain, i, three(kinematics.o[body]))))
            if not chain.prismatic[i]:
                alpha = plus(alpha, times(a[i], three(kinematics.axis_w[i])))
    row = learned.row
    for i in range(chain.n):
        information, moment = learned.information[i], learned.moment[i]
        says = torque_known(K, i) and not feedback.bad[i] and not feedback.asks[i]
        says = says and not (pushed and learned.estimates > EXPERIENCED)
        says = says and chain.lead[i] == i
        _load_row(K, i, A, alpha, w)
        row[0], row[1] = a[i], learned.sense[POLES - 1, i]
        if gain_reduced(feedback, i):
            row[2] = row[3] = row[4] = row[5] = 0.0
        missed = learned.sent[i] - kinematics.tau[i]
        if K.faults.code[i] == FREE:  # what was reported of its friction is no news
            missed -= K.faults.friction[i] * supposed.v[i]
        y = missed + learned.used[i] * a[i]
        noise_of_a = learned.felt * learned.felt * learned.noise[i]
        noise = TORQUE_NOISE * bounded_limit(K.limits, i)
        sticks = learned.friction[i] * (learned.begun - abs(row[1]))
        stands = sticks > noise and max(abs(supposed.v[i]), abs(K.state.v_command[i])) < STANDS_STILL
        if stands or learned.sigma[i] * a[i] * a[i] < feedback.M[i, i] * noise_of_a:
            row[0] = 0.0
            y -= learned.rotor[i] * a[i]
        for k in range(4):
            y += row[2 + k] * learned.load[k]
        weight = 1.0 / (noise * noise + sticks * sticks) if says else 0.0
        off = missed + (learned.used[i] - learned.rotor[i]) * a[i] - learned.friction[i] * row[1]
        hear_delay(K, i, off, weight)
        learned.missed[i] += (1.0 - learned.forget) * (weight * off * off - learned.missed[i])
        for k in range(UNKNOWNS):
            moment[k] = learned.forget * moment[k] + weight * row[k] * y
            for l in range(UNKNOWNS):
                information[k, l] = learned.forget * information[k, l] + weight * row[k] * row[l]
        if row[0] != 0.0:
            information[0, 0] -= weight * noise_of_a
