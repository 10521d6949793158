"""The tick of an arm that follows exactly, where nothing is at a limit: what most ticks of a batch are.

``L`` is a lane record: the fields of ``ftqp.kernel.layout.lane_rooms`` hold an arm a lane, all others are
those of one planner's record, which the arms share. The formulas are those of a planner's tick, the very
functions where they have no branch that differs from arm to arm. What a lane cannot do here, a limit, a
singularity, an error that is large, makes it leave: that arm's tick is then the planner's own.
"""

from typing import Any

from ftqp.kernel.active_set.active_set import REFINEMENTS
from ftqp.kernel.active_set.working_set import DEPENDENT, REFINE_FROM
from ftqp.kernel.arm.kinematics import frames, motion
from ftqp.kernel.arm.newton_euler import torques_of
from ftqp.kernel.arm.pose_error import NEAR, near_pose_error
from ftqp.kernel.arm.torque_bound import torque_bound
from ftqp.kernel.feedback.gap import norms
from ftqp.kernel.jit import jit
from ftqp.kernel.judge.fallback_cascade import RELAXED_FROM, TASK_FLOOR
from ftqp.kernel.lanes.membership import may_have_acceleration, may_have_velocity
from ftqp.kernel.lanes.regular import needs_no_calm
from ftqp.kernel.layout.enums import ACCELERATION, HARD
from ftqp.kernel.layout.thresholds import OUTSIDE_FROM
from ftqp.kernel.maths.elementary import any_of, larger, select, sqrt
from ftqp.kernel.maths.trigonometry import REDUCED, sin_cos
from ftqp.kernel.rows.failed_joints import braked_velocity, lock_rate
from ftqp.kernel.rows.objective import uncoupled_objective
from ftqp.kernel.rows.task_rows import compliance, task_rows


@jit
def _see(L: Any) -> Any:
    """Kinematics and the task's error; where they hold."""
    chain, state, kinematics, task = L.chain, L.state, L.kinematics, L.task
    good = abs(state.q[0]) <= REDUCED
    for i in range(chain.n):
        good = good & (abs(state.q[i]) <= REDUCED)
        if chain.prismatic[i]:
            kinematics.sine[i], kinematics.cosine[i] = 0.0, 1.0
        else:
            kinematics.sine[i], kinematics.cosine[i] = sin_cos(state.q[i])
    frames(L)
    if state.level == ACCELERATION:
        motion(L)
    good = good & (near_pose_error(L) <= NEAR)
    task.position_error, task.rotation_error = norms(L, task.error)
    return good


@jit
def _brake(L: Any) -> None:
    """x and the velocity after the tick of the joints that are being locked, 0 for those that are."""
    state, faults, limits, lane, dt = L.state, L.faults, L.limits, L.lane, L.state.dt
    if not any_of(lane.braking[0] > 0.0):
        return
    for i in range(L.chain.n):
        v, q = faults.lock_velocity[i], state.q[i]
        room = select(v > 0.0, limits.q_max[i] - q, q - limits.q_min[i])
        rate = lock_rate(v, room, faults.lock_rate[i], limits.a_max[i], dt)
        after = braked_velocity(v, rate, dt)
        lane.after[i] = after
        lane.fixed[i] = (after - v) / dt if state.level == ACCELERATION else after


@jit
def _factor(L: Any) -> Any:
    """W = A H^-1 of the joints that are not fixed, x_free, b - A x_free, and the Cholesky factor of S."""
    qp, lane, works = L.qp, L.lane, L.faults.works
    n, m = L.chain.n, L.task.m
    for i in range(n):
        lane.inverse[i] = works[i] / qp.H_diagonal[i]
        qp.x[i] = lane.fixed[i] - qp.g[i] * lane.inverse[i]
    for k in range(m):
        t = qp.b[k]
        for i in range(n):
            lane.W[k, i] = qp.A[k, i] * lane.inverse[i]
            t = t - qp.A[k, i] * qp.x[i]
        lane.lam[k] = t
        for j in range(k + 1):
            s = lane.W[k, 0] * qp.A[j, 0]
            for i in range(1, n):
                s = s + lane.W[k, i] * qp.A[j, i]
            lane.L[k, j] = s
        lane.L[k, k] = lane.L[k, k] + qp.soft[k]
    good = lane.L[0, 0] > 0.0
    for k in range(m):
        whole = pivot = lane.L[k, k]
        for j in range(k):
            s = lane.L[k, j]
            for i in range(j):
                s = s - lane.L[k, i] * lane.L[j, i]
            s = s * lane.L[j, j]
            lane.L[k, j] = s
            pivot = pivot - s * s
        fits = pivot > DEPENDENT * whole
        good = good & fits
        lane.L[k, k] = 1.0 / sqrt(select(fits, pivot, 1.0))
    return good


@jit
def _solve(L: Any, x: Any) -> None:
    """x <- S^-1 x."""
    m, F = L.task.m, L.lane.L
    for i in range(m):
        s = x[i]
        for j in range(i):
            s = s - F[i, j] * x[j]
        x[i] = s * F[i, i]
    for i in range(m - 1, -1, -1):
        s = x[i]
        for j in range(i + 1, m):
            s = s - F[j, i] * x[j]
        x[i] = s * F[i, i]


@jit
def _add(L: Any, lam: Any) -> None:
    """x <- x + H^-1 A' lam."""
    qp, W = L.qp, L.lane.W
    for i in range(L.chain.n):
        x = qp.x[i]
        for k in range(L.task.m):
            x = x + W[k, i] * lam[k]
        qp.x[i] = x


@jit
def _left(L: Any) -> tuple[Any, Any, Any]:
    """What is left of A x + soft lam = b: the most of it, of A x = b, and the largest |b|."""
    qp, lane = L.qp, L.lane
    worst = missed = size = abs(qp.b[0]) * 0.0
    for k in range(L.task.m):
        s = qp.b[k]
        for i in range(L.chain.n):
            s = s - qp.A[k, i] * qp.x[i]
        missed, size = larger(missed, abs(s)), larger(size, abs(qp.b[k]))
        s = s - qp.soft[k] * lane.lam[k]
        lane.left[k] = s
        worst = larger(worst, abs(s))
    return worst, missed, size


@jit
def _resolve(L: Any) -> Any:
    """x of the QP without bounds, by the active set of the task's rows alone; where it is the answer."""
    lane, task = L.lane, L.task
    good = _factor(L)
    _solve(L, lane.lam)
    _add(L, lane.lam)
    worst, missed, size = _left(L)
    for _ in range(REFINEMENTS):
        needed = worst > REFINE_FROM
        if not any_of(needed):
            break
        for k in range(task.m):  # an arm's answer does not depend on those beside it
            lane.left[k] = select(needed, lane.left[k], 0.0)
        _solve(L, lane.left)
        for k in range(task.m):
            lane.lam[k] = lane.lam[k] + lane.left[k]
        _add(L, lane.left)
        worst, missed, size = _left(L)
    lane.missed[0] = select(missed <= RELAXED_FROM * size + TASK_FLOOR, 0.0, 1.0)
    return good & (worst <= L.cascade.accept * (1.0 + size))


@jit
def _is_inside(L: Any) -> Any:
    """Where no bound stops x, and every joint is within its limits."""
    state, limits, works, dt = L.state, L.limits, L.faults.works, L.state.dt
    good = works[0] >= 0.0
    for i in range(L.chain.n):
        x, q, v = L.qp.x[i], state.q[i], state.v[i]
        v_max, a_max, a_brake = limits.v_max[i], limits.a_max[i], limits.a_brake[i]
        above, below = limits.q_max[i] - q, q - limits.q_min[i]
        if state.level == ACCELERATION:
            fits = may_have_acceleration(x, v, above, v_max, a_max, a_brake, dt) & may_have_acceleration(
                -x, -v, below, v_max, a_max, a_brake, dt
            )
        else:
            fits = may_have_velocity(x, v, above, v_max, a_max, a_brake, dt) & may_have_velocity(
                -x, -v, below, v_max, a_max, a_brake, dt
            )
        fits = fits & (abs(v) <= v_max * (1.0 + OUTSIDE_FROM))
        in_range = (above >= -OUTSIDE_FROM) & (below >= -OUTSIDE_FROM)
        good = good & in_range & (fits | (works[i] <= 0.0))
    return good


@jit
def _accelerations(L: Any) -> Any:
    """Those of the command; where no torque limit needs to be looked at."""
    state, lane = L.state, L.lane
    good = L.faults.works[0] >= 0.0
    for i in range(L.chain.n):
        x = L.qp.x[i]
        a = x if state.level == ACCELERATION else (x - state.v[i]) / state.dt
        lane.a[i] = a
        good = good & (abs(a) <= L.limits.guard[0] * L.limits.a_max[i])
    return good


@jit
def _is_within_torque(L: Any) -> Any:
    """Where ``kinematics.tau`` is within the torque limits of the joints that work."""
    tau, works = L.kinematics.tau, L.faults.works
    good = works[0] >= 0.0
    for i in range(L.chain.n):
        good = good & ((abs(tau[i]) <= L.limits.tau_max[i]) | (works[i] <= 0.0))
    return good


@jit
def _keeps_torque(L: Any, wanted: Any) -> Any:
    """Where M a + h is within the torque limits, as far as that is wanted: by a bound, then by itself."""
    torque_bound(L, L.lane.a)
    good = _is_within_torque(L)
    if any_of(wanted & ~good):
        if L.state.level != ACCELERATION:
            motion(L)
        torques_of(L, L.lane.a)
        good = good | _is_within_torque(L)
    return good


@jit
def _nothing_to_say(L: Any) -> Any:
    """Where the error is neither beyond the task's tolerances nor near an emergency stop."""
    task, watch, feedback = L.task, L.watch, L.feedback
    e, r = task.position_error, task.rotation_error
    good = (e <= feedback.tolerance) & (r <= feedback.rotation_tolerance)
    if watch.stop_samples > 0:
        good = good & (e <= watch.stop_position) & (r <= watch.stop_rotation)
    return good


@jit
def common_tick(L: Any, inside: Any) -> Any:
    """The command of the next ``dt``, up to its torques; where it is that of the planner's tick.

    Args:
        L: the lanes; the shared target is that of the tick.
        inside: where there is an arm.
    """
    kp = L.task.kp
    good = _see(L) & _nothing_to_say(L) & inside
    uncoupled_objective(L)
    task_rows(L, kp)
    if L.task.mode == HARD:
        for k in range(L.task.m):
            L.qp.soft[k] = 0.0
    else:
        compliance(L, L.task.slack_ratio)
    good = good & needs_no_calm(L, kp, good)
    _brake(L)
    good = good & _resolve(L) & _is_inside(L)
    unguarded = good & ~_accelerations(L)
    if L.limits.dynamic and any_of(unguarded):
        good = good & (_keeps_torque(L, unguarded) | ~unguarded)
    return good


@jit
def settle(L: Any, good: Any, stands: Any, tick: int) -> None:
    """Write the command of those lanes as their next state, and what is remembered of the tick.

    Args:
        L: the lanes.
        good: where ``common_tick`` holds.
        stands: 1 where the target is where it was, else 0.
        tick: its number.
    """
    state, task, watch, calm, lane = L.state, L.task, L.watch, L.calm, L.lane
    dt, works = state.dt, L.faults.works
    moving = lane.braking[0] * 0.0
    for i in range(L.chain.n):
        x, q, v = L.qp.x[i], state.q[i], state.v[i]
        lane.a_last[i] = select(good, lane.a[i], lane.a_last[i])
        way = v + 0.5 * dt * x if state.level == ACCELERATION else x
        after = v + dt * x if state.level == ACCELERATION else x
        fixed = lane.after[i] * (1.0 - works[i])
        after = select(works[i] > 0.0, after, fixed)
        state.q[i] = select(good, q + dt * way, q)
        state.v[i] = select(good, after, v)
        L.faults.lock_velocity[i] = select(good, fixed, L.faults.lock_velocity[i])
        moving = larger(moving, abs(fixed))
        lane.after[i] = lane.fixed[i] = 0.0
    lane.braking[0] = select(good, select(moving > 0.0, 1.0, 0.0), lane.braking[0])
    e, r = task.position_error, task.rotation_error
    watch.last_position_error[0] = select(good, e, watch.last_position_error[0])
    watch.last_rotation_error[0] = select(good, r, watch.last_rotation_error[0])
    lane.worst[0] = select(good, larger(lane.worst[0], e), lane.worst[0])
    lane.worst[1] = select(good, larger(lane.worst[1], r), lane.worst[1])
    lane.done[0] = lane.done[0] + select(good, 1.0, 0.0)
    missed = select(good, lane.missed[0], 0.0)
    lane.relaxed[0] = lane.relaxed[0] + missed
    begins = (missed > 0.0) & (lane.first_bad[0] < 0.0)
    lane.first_bad[0] = select(begins, 1.0 * tick, lane.first_bad[0])
    stood = calm.stood[0]
    calm.stood[0] = select(good, stands * (stood + dt), stood)
