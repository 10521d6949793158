"""A tick of the monitor, and what it leaves of the arm's following error."""

from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import TORQUE_DRIVE
from ftqp.kernel.layout.thresholds import BESIDE, LEAST_SHIFT, MONITOR_POLES, STILL
from ftqp.kernel.maths.elementary import any_of
from ftqp.kernel.maths.side_by_side import WIDTH, is_set, load_lanes
from ftqp.kernel.monitor.evidence import forget_evidence, weigh
from ftqp.kernel.monitor.leading import aim
from ftqp.kernel.monitor.servos import (
    BEGINS,
    SLOW,
    begin_filters,
    is_strained,
    learn_servo,
    motion_terms,
    observe_joint,
    residual,
    take_samples,
    ticks_to_settle,
)
from ftqp.kernel.monitor.verdicts import arm_is_held, hold_arm, judge_joint, works


@jit
def _look(K: Any, i: int, known: bool) -> None:
    """One look at joint i; ``known``: what a torque arm has beside its model has been learned."""
    M = K.monitor
    observe_joint(K, i)
    residual(K, i)
    if is_strained(K, i):
        M.blind[i] = ticks_to_settle(K, i)
    if M.settles > 0 and M.found[i] == 0 and M.v[i] * (M.u_f[1, i] - M.u_f[2, i]) <= 0.0:
        M.place[i] = M.y_f[2, i]  # its load draws it, which does not show that it goes where it is sent
    counts = works(K, i) and K.held.on == 0 and M.blind[i] == 0 and K.feedback.thrown == 0.0
    by_torque = K.feedback.kind == TORQUE_DRIVE
    if by_torque and not known:  # an unreported load is estimated first
        M.settles = max(M.settles, 1)
    if counts and not (by_torque and M.rests[i] and M.peak_v[i] > SLOW):  # a brake may hold one that stands
        learn_servo(K, i)
    weigh(K, i, counts)
    if not by_torque:
        aim(K, i)
    if K.held.on == 0:
        judge_joint(K, i)


@jit
def _worst(K: Any) -> None:
    """How near the evidence against any joint is to what decides, and whose it is."""
    M = K.monitor
    M.worst = 0.0
    for i in range(K.chain.n):
        if works(K, i) and M.G[i] > M.worst * M.level:
            M.worst = M.G[i] / M.level
            M.suspect = i


@jit
def _is_seen(K: Any, then: int) -> bool:
    """Whether there is anything to learn: not of an ideal arm, which was never seen beside its commands."""
    M = K.monitor
    if M.sees:
        return True
    if K.feedback.kind == TORQUE_DRIVE:  # what it takes is known before it moves
        return True
    if K.feedback.wide > 0.0:  # of a loop that came late
        return False
    for at in range(0, K.chain.n, WIDTH):
        if any_of(abs(load_lanes(K.feedback.seen, at) - load_lanes(K.past.q[then], at)) > BESIDE):
            return bool(K.feedback.speed_margin > 0.0)
    if not M.ideal:
        for at in range(0, K.chain.n, WIDTH):
            if any_of(abs(load_lanes(K.state.v_command, at)) > STILL):
                M.ideal = 1
    return False


@part_jit
def watch_servos(K: Any, first: bool, then: int, known: bool) -> None:
    """Learns from the sample, and judges the joints whose turn it is."""
    M, n = K.monitor, K.chain.n
    if first:
        M.sees = 0
        M.worst = 0.0
        for i in range(n):
            M.place[i] = K.feedback.good[i]
        return
    if not _is_seen(K, then):
        for i in range(n):  # an arm that follows exactly has no servos to learn, but sensors
            if K.feedback.lost[i]:
                judge_joint(K, i)
        return
    if not M.sees:
        begin_filters(K)
        return
    take_samples(K, then)
    if M.settles > 0:
        M.settles -= 1
        if M.settles == 0:
            forget_evidence(K, False)
    unseen, waits, constant = False, K.held.on != 0, 1.0 / (M.w * K.state.dt)
    for at in range(0, n, WIDTH):
        unseen = unseen or any_of(is_set(K.feedback.age, at))
        waits = waits or unseen or any_of(is_set(M.blind, at))
    # filters forget what did not come, later if it came later; what moves one torque joint is moved by all
    for i in range(n if waits else 0):
        if K.feedback.age[i] > 0 or (unseen and K.feedback.kind == TORQUE_DRIVE):
            M.blind[i] = (
                int(min(max(MONITOR_POLES * constant, float(K.feedback.age[i])), BEGINS * constant)) + 1
            )
        elif K.held.on:  # once it is let go its servo has to come to rest
            M.blind[i] = ticks_to_settle(K, i)
        elif M.blind[i] > 0 and (M.settles == 0 or abs(M.z[i]) < LEAST_SHIFT):  # else it is pushed still
            M.blind[i] -= 1
    M.count = M.count + 1 if M.count + 1 < M.every else 0
    if M.count == 0 and K.chain.has_inertia:
        motion_terms(K)
    for i in range(M.count, n, M.every):
        _look(K, i, known)
    if K.held.on:
        forget_evidence(K)
    elif arm_is_held(K):
        hold_arm(K)
    _worst(K)
