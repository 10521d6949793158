"""What a failed joint does: its motion while it is braked, and the velocity jump of an instant lock.

What the tip loses where a joint stops otherwise than was foreseen, and how soon the others give it back.

A brake closes within milliseconds, and an unreported failure counts when the joint has long
stood. The reference then loses the velocity J_F dv_F at once. The task's feedback alone would take it back
with its own time constant, 1/kv, though the joints that work could do it sooner.
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import mimic
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.layout.enums import (
    ACCELERATION,
    BRAKING,
    FREE,
    HEALTHY,
    INSTANT,
    LOCKED,
    MEASURED,
    RESET_MOMENTUM,
    RESET_TASK,
    TARGET_TWIST,
    VELOCITY,
)
from ftqp.kernel.maths.elementary import any_of, larger, select, smaller
from ftqp.kernel.maths.linear_systems import factor, minus_products, plus_products, solve_factored
from ftqp.kernel.maths.side_by_side import WIDTH, is_set
from ftqp.kernel.rows.joint_intervals import fix

STANDS = 1e-15
"""Speed up to which a joint stands that is to be locked [rad/s or m/s]: in a tick it moves by less than the
last place of a position. Rounding leaves 1e-21 of an arm that was stopped, on another processor nothing: for
that the lock must not begin a tick later."""


@jit
def sort_joints(faults: Any, chain: Any) -> None:
    """The one list of joints of a tick: those that work, those that swing free, those that are held.

    ``order[:working]`` have a motor that obeys, ``order[:movable]`` can move at all; each part rises.
    """
    n = chain.n
    if faults.working == n:
        failed = is_set(faults.code, 0)
        for at in range(WIDTH, n, WIDTH):
            failed = failed | is_set(faults.code, at)
        if not any_of(failed):
            faults.movable = n  # all work, as a tick ago
            return
    count = 0
    for i in range(n):
        if faults.code[i] == HEALTHY:
            faults.order[count] = i
            count += 1
    faults.working = count
    if count < n:
        for i in range(n):
            if faults.code[i] == FREE:
                faults.order[count] = i
                count += 1
        faults.movable = count
        for i in range(n):
            if faults.code[i] != HEALTHY and faults.code[i] != FREE:
                faults.order[count] = i
                count += 1
    else:
        faults.movable = count


@jit
def lock_rate(v: Any, room: Any, asked: Any, a_max: Any, dt: float) -> Any:
    """Deceleration of a joint that is being locked: max(asked, min(v^2/(2 room - |v| dt), a_max)).

    ``room`` is the distance to the limit that it moves towards. |v| dt is what whole ticks cost beyond
    v^2/2a: with it the joint never comes to rest behind its limit by the length of the last tick.
    Source: docs/theory/joint-failures.md, "Locked".
    """
    way = 2.0 * room - abs(v) * dt
    is_left = way > 0.0
    needed = select(is_left, v * v / select(is_left, way, 1.0), inf)
    return larger(asked, smaller(needed, a_max))


@jit
def braked_velocity(v: Any, rate: Any, dt: float) -> Any:
    """v after dt at that deceleration, the last step partial."""
    step = rate * dt
    return select(abs(v) <= step, 0.0, select(v > 0.0, v - step, v + step))


@jit
def prescribed_motion(state: Any, faults: Any, limits: Any, chain: Any, qp: Any) -> None:
    """x_F of every locked or braking joint, as the degenerate interval lb = ub.

    While it brakes, x_F = -sign(v_F) min(rate, |v_F|/dt) until v_F is exactly zero, the last step partial;
    then it is locked for ever. A joint that is only measured goes on as fast as it is seen. The rate is that
    of ``lock_rate``. v_F begins at what was commanded last and follows that model, or the measured velocity
    where the joint stops sooner, so that noise neither sets a joint that stands in motion nor keeps one
    braking.
    Source: docs/theory/joint-failures.md, "Locked".
    """
    dt = state.dt
    for k in range(faults.movable, chain.n):
        i = faults.order[k]
        if faults.code[i] == BRAKING:
            model = state.v_command[i]
            vf = min(max(state.v[i], min(model, 0.0)), max(model, 0.0))
            if abs(vf) <= STANDS:
                faults.code[i] = LOCKED
            else:
                room = limits.q_max[i] - state.q[i] if vf > 0.0 else state.q[i] - limits.q_min[i]
                rate = lock_rate(vf, room, faults.lock_rate[i], limits.a_max[i], dt)
                after = braked_velocity(vf, rate, dt)
                x = after if state.level == VELOCITY else (after - vf) / dt
                state.v[i] = vf
                faults.lock_velocity[i] = after
                fix(qp, i, x)
        if faults.code[i] == MEASURED:
            fix(qp, i, state.v[i] if state.level == VELOCITY else 0.0)
        if faults.code[i] == LOCKED:
            state.v[i] = 0.0
            faults.lock_velocity[i] = 0.0
            fix(qp, i, 0.0)
    if chain.mimics:
        mimic(chain, state.v)


@jit
def any_instant_lock(faults: Any, chain: Any) -> bool:
    """Whether a joint is to be locked at this very tick."""
    for k in range(faults.movable, chain.n):
        if faults.code[faults.order[k]] == INSTANT:
            return True
    return False


@jit
def _momentum_jump(faults: Any, kinematics: Any, chain: Any, scratch: Any) -> None:
    """Delta_H = -M_HH^-1 M_HF Delta_F, the free impulse, over the joints that can move."""
    M = kinematics.M
    n, movable = chain.n, faults.movable
    S, jump, delta = scratch.square, scratch.impulse, scratch.joints
    for a in range(movable):
        i = faults.order[a]
        jump[a] = minus_products(0.0, M[i], delta, n)
        for b in range(movable):
            S[a, b] = M[i, faults.order[b]]
    if factor(S, movable):
        solve_factored(S, movable, jump)
        for a in range(movable):
            delta[faults.order[a]] = jump[a]


@jit
def _task_jump(faults: Any, task: Any, kinematics: Any, chain: Any, scratch: Any) -> None:
    """Delta_H = -J_H^+ J_F Delta_F over the joints that work: the tip goes on as it was."""
    for a in range(task.m):
        scratch.rows[a] = minus_products(0.0, kinematics.J[task.rows[a]], scratch.joints, chain.n)
    least_jump(faults, task, kinematics, chain, scratch)


@jit
def least_jump(faults: Any, task: Any, kinematics: Any, chain: Any, scratch: Any) -> None:
    """J_H^+ r of the joints that work, in ``scratch.joints``; r is in ``scratch.rows``, by task rows.

    J_H^+ r is J_H' (J_H J_H')^-1 r or (J_H' J_H)^-1 J_H' r, whichever matrix is the smaller one: the other
    has not full rank, and rounding would grow by the 1e12 of what makes it invertible.
    """
    J, rows, order = kinematics.J, task.rows, faults.order
    m, working = task.m, faults.working
    S, jump, twist, delta = scratch.square, scratch.impulse, scratch.rows, scratch.joints
    tall = working < m
    size = working if tall else m
    trace = 0.0
    for a in range(size):
        for b in range(size):
            s = 0.0
            if tall:
                for c in range(m):
                    s += J[rows[c], order[a]] * J[rows[c], order[b]]
            else:
                for c in range(working):
                    s += J[rows[a], order[c]] * J[rows[b], order[c]]
            S[a, b] = s
        trace += S[a, a]
        s = twist[a]
        if tall:
            s = 0.0
            for c in range(m):
                s += J[rows[c], order[a]] * twist[c]
        jump[a] = s
    for a in range(size):
        S[a, a] += 1e-12 * trace
    if factor(S, size):
        solve_factored(S, size, jump)
        for c in range(working):
            j = order[c]
            s = jump[c]
            if not tall:
                s = 0.0
                for a in range(m):
                    s += J[rows[a], j] * jump[a]
            delta[j] = s


@jit
def _share_of_jump(state: Any, faults: Any, limits: Any, scratch: Any) -> float:
    """The largest share of the jump that leaves every working joint its speed limit and room to stop."""
    delta = scratch.joints
    share = 1.0
    for k in range(faults.working):
        i = faults.order[k]
        if delta[i] > 0.0:
            v, room = state.v[i], limits.q_max[i] - state.q[i]
        else:
            v, room = -state.v[i], state.q[i] - limits.q_min[i]
        most = min(limits.v_max[i], sqrt(2.0 * limits.a_brake[i] * max(room, 0.0)))
        free = max(most - v, 0.0)
        if abs(delta[i]) > free:
            share = min(share, free / abs(delta[i]))
    return share


@rare_jit
def lock_instantly(K: Any) -> None:
    """v_F := 0 and the velocities of the others by the reset rule; Delta is the change of v.

    kinematic:  Delta_H = 0
    momentum:   Delta_H = -M_HH^-1 M_HF Delta_F, a free impulse, which moves free-swinging joints, too
    task:       Delta_H = -J_H^+ J_F Delta_F, so that the task's velocity goes on

    Where a working joint would break its speed limit, or could no longer stop in its range, all make the same
    share of Delta_H, ``K.cascade.jump``; the rest is left to the task's feedback, and so is what is no
    number, for the gate judges by the velocities that are changed here. It needs J, and M for ``momentum``.
    Source: docs/theory/joint-failures.md, "Instant locks".
    """
    faults, state = K.faults, K.state
    n, delta = K.chain.n, K.scratch.joints
    for i in range(n):
        delta[i] = -state.v[i] if faults.code[i] == INSTANT else 0.0
    if faults.reset_mode == RESET_MOMENTUM:
        _momentum_jump(faults, K.kinematics, K.chain, K.scratch)
    if faults.reset_mode == RESET_TASK:
        _task_jump(faults, K.task, K.kinematics, K.chain, K.scratch)
    share = K.cascade.jump = _share_of_jump(state, faults, K.limits, K.scratch)
    for k in range(faults.movable):
        i = faults.order[k]
        if abs(delta[i]) < inf:
            state.v[i] += share * delta[i]
            K.gate.v[i] += share * delta[i]
    for i in range(n):
        if faults.code[i] == INSTANT:
            state.v[i] = K.gate.v[i] = K.gate.speed[i] = 0.0
            faults.code[i] = LOCKED
    if K.chain.mimics:
        mimic(K.chain, state.v)
        mimic(K.chain, K.gate.v)


UNFORESEEN = 1e-6
"""A velocity that differs from what was foreseen by less is left to the feedback [rad/s or m/s]: such a
difference moves no tip by more than a micrometre a second. A convention."""
SHARE = 0.8
"""Share of the acceleration limits with which it is given back; the rest is left for the task itself. A
guess, between the quarter that a ramp takes and all of it."""


@jit
def loses(K: Any) -> bool:
    """Whether velocity is being given back, or may be lost in this tick."""
    return bool(K.task.velocity_debt or K.faults.movable < K.chain.n)


@rare_jit
def give_back(K: Any) -> None:
    """Add what the joints that work can give back in this tick to the acceleration that the task asks for.

    With delta = J_H^+ lost that is lost s / dt, s = min(1, dt SHARE min_i a_max,i / |delta_i|). What is lost
    is no more than what the reference's velocity lacks now, so that it ends when that is there again.
    Source: docs/theory/joint-failures.md, "Locked".
    """
    state, faults, task, feedback, chain = K.state, K.faults, K.task, K.feedback, K.chain
    J, lost = K.kinematics.J, task.lost_velocity
    if not feedback.displaced:
        feedback.push[:6] = 0.0
    if not feedback.active or state.level != ACCELERATION or K.watch.latched != 0:
        task.velocity_debt = 0
        return
    for k in range(faults.movable, chain.n):
        i = faults.order[k]
        jump = state.v[i] - K.gate.v[i]
        if abs(jump) > UNFORESEEN:
            if not task.velocity_debt:
                lost[:6] = 0.0
            task.velocity_debt = 1
            for c in range(6):
                lost[c] += J[c, i] * jump
    if not task.velocity_debt:
        return
    left = 0.0
    for c in range(6):
        lacks = plus_products(-task.target[TARGET_TWIST + c], J[c], state.v, chain.n)
        lost[c] = min(max(lost[c], min(lacks, 0.0)), max(lacks, 0.0))
        left = max(left, abs(lost[c]))
    if left <= UNFORESEEN:
        task.velocity_debt = 0
        return
    share = _share(K)
    for c in range(6):
        feedback.push[c] -= lost[c] * share / state.dt


@jit
def _share(K: Any) -> float:
    """The share of what is lost that the joints that work give back in a tick."""
    task, faults, scratch = K.task, K.faults, K.scratch
    for a in range(task.m):
        scratch.rows[a] = -task.lost_velocity[task.rows[a]]
    least_jump(faults, task, K.kinematics, K.chain, scratch)
    share = 1.0
    for k in range(faults.working):
        i = faults.order[k]
        most = SHARE * K.limits.a_max[i] * K.state.dt
        if most < inf and abs(scratch.joints[i]) > most:
            share = min(share, most / abs(scratch.joints[i]))
    return share
