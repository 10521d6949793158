"""Unresponsive joints of a torque arm: their motors do not give what is sent, although nobody has said so."""

from math import sqrt
from typing import Any

from ftqp.kernel.feedback.doubt import CLEAR, EXPLAINS, UNUSUAL, doubt
from ftqp.kernel.feedback.error_band import redistribute_disturbance
from ftqp.kernel.feedback.observer import advanced, corrected, plausible, predicted
from ftqp.kernel.feedback.pairs import gain_reduced, partner, tracks_command
from ftqp.kernel.feedback.persistence import has_persisted, persisted
from ftqp.kernel.feedback.reference import rest_speed
from ftqp.kernel.feedback.samples import slot
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import HEALTHY
from ftqp.kernel.layout.hypotheses import CLEARED, OBEYS, SILENT, TOUCHED
from ftqp.kernel.layout.thresholds import LATELY, STILL_SAMPLES
from ftqp.kernel.maths.linear_systems import factor, solve_factored

USUAL_TIME = 0.1
"""What has disturbed a joint for so long [s] is a load, not a fault. With 0.2 a soft joint that was braked
got no name."""


@jit
def stands(feedback: Any, j: int) -> bool:
    """Whether an unresponsive joint is at rest."""
    still: bool = feedback.still[j] >= STILL_SAMPLES
    return still


@jit
def answer(feedback: Any, chain: Any, j: int, a: Any) -> float:
    """-M_jh a_h/M_jj: what the accelerations of the others do to joint j."""
    M = feedback.M
    total = 0.0
    for i in range(chain.n):
        if i != j:
            total -= M[j, i] * a[i]
    return total / M[j, j]


@jit
def _retell(feedback: Any, chain: Any, past: Any, j: int) -> None:
    """What joint j was to do lately: nothing where it stands, else -M_jh a_h/M_jj; d_j is all the rest."""
    before = slot(feedback, feedback.latency + 1)
    feedback.d_hat[j] += past.a[before, j]
    for ago in range(feedback.latency + 2):
        then = slot(feedback, ago)
        past.a[then, j] = 0.0 if stands(feedback, j) else answer(feedback, chain, j, past.a[then])
    feedback.d_hat[j] -= past.a[before, j]


@jit
def leave_out(K: Any, j: int) -> None:
    """From now on joint j is taken to do what acts on it, a_j = d_j - M_jh a_h/M_jj; d_j is observed.

    What is believed of it if it obeys goes on beside that.
    """
    feedback, past = K.feedback, K.past
    feedback.unresponsive[j] = 1
    feedback.persistence[SILENT, j] = feedback.persistence[OBEYS, j] = feedback.persistence[CLEARED, j] = 0
    feedback.still[j] = 0
    feedback.own_q[j], feedback.own_v[j] = feedback.q_hat[j], feedback.v_hat[j]
    feedback.own_d[j], feedback.own_slow[j] = feedback.d_hat[j], feedback.d_slow[j]
    redistribute_disturbance(K, j)
    if not feedback.asks[j]:  # a suspect; the one before it may be taken back in this very tick
        feedback.place_taken = 1 - feedback.place_taken
        feedback.place[j] = feedback.place_taken
        for ago in range(feedback.latency + 2):
            then = slot(feedback, ago)
            past.own[then, feedback.place[j]] = past.a[then, j]
    _retell(feedback, K.chain, past, j)


@jit
def _take_back(K: Any, j: int) -> None:
    """Joint j obeys again: what was believed of it in that case counts, and the others' share of it."""
    feedback, past = K.feedback, K.past
    feedback.unresponsive[j] = feedback.persistence[SILENT, j] = 0
    feedback.d_hat[j], feedback.d_slow[j] = -feedback.own_d[j], -feedback.own_slow[j]
    redistribute_disturbance(K, j)
    feedback.q_hat[j], feedback.v_hat[j] = feedback.own_q[j], feedback.own_v[j]
    feedback.d_hat[j], feedback.d_slow[j] = feedback.own_d[j], feedback.own_slow[j]
    for ago in range(feedback.latency + 2):
        then = slot(feedback, ago)
        past.a[then, j] = past.own[then, feedback.place[j]]
    feedback.baseline[j] = 0.0
    for i in range(K.chain.n):
        feedback.baseline[j] += feedback.M[j, i] * feedback.d_hat[i]


@jit
def _observe_own(state: Any, limits: Any, feedback: Any, past: Any, learned: Any, j: int) -> None:
    """The observer of joint j as if it obeyed, see ``ftqp.kernel.feedback.observer``."""
    then, before = slot(feedback, feedback.latency), slot(feedback, feedback.latency + 1)
    place = feedback.place[j]
    if feedback.bad[j]:
        feedback.own_q[j], feedback.own_v[j] = feedback.seen[j], past.v[then, j]
    else:
        q, v = advanced(
            state, feedback.own_q[j], feedback.own_v[j], past.own[before, place] + feedback.own_d[j]
        )
        e = feedback.seen[j] - q
        feedback.own_q[j], v, change = corrected(state, feedback.pole, q, v, e)
        v, d = plausible(state, v, feedback.own_d[j] + change, limits.v_max[j])
        feedback.own_v[j], feedback.own_d[j] = v, d
    feedback.own_slow[j] += learned.slowness[j] * (feedback.own_d[j] - feedback.own_slow[j])
    q, v = predicted(
        state, limits, feedback, feedback.own_q[j], feedback.own_v[j], past.own, place, feedback.own_d[j]
    )
    feedback.q_now[j], feedback.v_now[j] = q, v


@jit
def unusual(K: Any) -> int:
    """The joint whose motor alone explains what is unusual, (M d)_i less what is usual there, or -1.

    rho_j^2/M_jj >= 0.8 sum_i rho_i^2/M_ii and |rho_j| >= 0.02 tau_max and 4 standard deviations of what a
    healthy joint may seem to lack. While the tip is touched what is usual stays. A joint that mimics another
    has no motor.
    """
    state, faults, limits, feedback, chain = K.state, K.faults, K.limits, K.feedback, K.chain
    n = chain.n
    M, d, usual, unresponsive = feedback.M, feedback.d_hat, feedback.baseline, feedback.unresponsive
    worst, most, total, found = -1, 0.0, 0.0, 0.0
    feedback.samples += 1
    share = min(1.0, max(state.dt / USUAL_TIME, 1.0 / feedback.samples))
    if feedback.touched or feedback.persistence[TOUCHED, 0] > 0:
        share = 0.0
    missing, lately = feedback.missing, min(1.0, state.dt / LATELY)
    for i in range(n):
        if faults.code[i] != HEALTHY or unresponsive[i] or chain.lead[i] != i:
            missing[i] = feedback.odd[i] = 0.0
            continue
        rho = -usual[i]
        for j in range(n):
            rho += M[i, j] * d[j]
        if feedback.unresponsive_count:
            for j in range(n):
                if unresponsive[j]:
                    rho -= M[i, j] * d[j]
        usual[i] += share * rho
        missing[i] += lately * (rho - missing[i])
        feedback.odd[i] = rho
        energy = rho * rho / M[i, i]
        total += energy
        if energy > most:
            worst, most, found = i, energy, rho
    if worst < 0 or feedback.touched or gain_reduced(feedback, worst) or partner(feedback, chain, worst) >= 0:
        return -1
    if most < EXPLAINS * total or abs(found) < UNUSUAL * limits.tau_max[worst]:
        return -1
    return worst if abs(found) > CLEAR * sqrt(doubt(K, worst, feedback.felt_noise)) else -1


@jit
def may_suspect(faults: Any, feedback: Any, chain: Any, state: Any) -> bool:
    """Only one joint is suspected at a time: the earlier one is taken back if it obeys, else it remains.

    While a joint is known to have failed none is suspected.
    """
    if faults.working < chain.n:
        return False
    for j in range(chain.n):
        if feedback.unresponsive[j] and not (feedback.asks[j] or has_persisted(state, feedback, CLEARED, j)):
            return False
    return True


@jit
def watch(K: Any, j: int, replaced: bool) -> None:
    """A joint that was left out: whether it stands, and whether it obeys again."""
    feedback = K.feedback
    if not feedback.asks[j]:
        _observe_own(K.state, K.limits, feedback, K.past, K.learned, j)
    stood = stands(feedback, j)
    feedback.still[j] = feedback.still[j] + 1 if abs(feedback.v_hat[j]) < rest_speed(feedback) else 0
    if stands(feedback, j) != stood:
        _retell(feedback, K.chain, K.past, j)
    if not feedback.asks[j]:
        there = tracks_command(K.state, K.limits, feedback, K.past, j)
        obeys = persisted(K.state, feedback, OBEYS, j, there)
        persisted(K.state, feedback, CLEARED, j, there)
        if partner(feedback, K.chain, j) >= 0 or replaced or obeys:
            _take_back(K, j)


@jit
def _inertia_alone(faults: Any, feedback: Any, scratch: Any, j: int) -> float:
    """M_jj - M_jh M_hh^-1 M_hj: the inertia of joint j while the others do not answer what it does."""
    M = feedback.M
    S, column, others = scratch.square, scratch.impulse, feedback.others
    count = 0
    for k in range(faults.working):
        i = faults.order[k]
        if not feedback.unresponsive[i]:
            others[count] = i
            count += 1
    for a in range(count):
        column[a] = M[others[a], j]
        for b in range(a + 1):
            S[a, b] = M[others[a], others[b]]
    inertia: float = M[j, j]
    if factor(S, count):
        solve_factored(S, count, column)
        for a in range(count):
            inertia -= M[j, others[a]] * column[a]
    return inertia


@jit
def predict_unresponsive(
    faults: Any, limits: Any, feedback: Any, chain: Any, scratch: Any, wanted: Any, most: float
) -> None:
    """What unresponsive joints do when the others do what is wanted; ``asked``: what they should do.

    a_j = 0 at rest, else d_j - M_jh a_h/M_jj, bounded as the feedback is: what acts on the joint besides the
    others, whether its own weight, its friction or a brake that slips, goes on as it was observed.
    Source: docs/theory/feedback.md, "The torque drive".
    """
    for k in range(faults.working):
        j = faults.order[k]
        feedback.asked[j] = wanted[j]
        if feedback.unresponsive[j]:
            feedback.alone[j] = _inertia_alone(faults, feedback, scratch, j)
            wanted[j] = feedback.d_slow[j] = 0.0
    for k in range(faults.working):
        j = faults.order[k]
        if feedback.unresponsive[j] and not stands(feedback, j):
            feedback.d_slow[j] = answer(feedback, chain, j, feedback.d_slow)
            bound = most * limits.tau_max[j] / feedback.M[j, j]
            wanted[j] = min(max(feedback.d_hat[j] + answer(feedback, chain, j, wanted), -bound), bound)


@jit
def inform_unresponsive(feedback: Any, chain: Any, past: Any) -> None:
    """The observer of an unresponsive joint gets what the others do to it."""
    a = past.a[feedback.now]
    for j in range(chain.n):
        if feedback.unresponsive[j]:
            a[j] = 0.0 if stands(feedback, j) else answer(feedback, chain, j, a)
