"""Motions of an arm after one or two of its joints have failed, to the end of its path.

Where the joints that are left are as many as the task's rows: Newton steps from sample to sample; else one
small QP a sample, with the rows that keep the arm off bodies; and motions at a given self-motion speed.
Source: docs/theory/coverage.md.
"""

from math import inf
from typing import Any

from ftqp.kernel.active_set.active_set import active_set
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import (
    ERROR,
    LIMIT,
    LOST_BY_SINGULARITY,
    LOST_BY_VELOCITY,
    NOT_CONVERGED,
    SINGULAR_VELOCITY,
    SOLVED,
    SURVIVED,
    TOO_NEAR,
)
from ftqp.kernel.layout.other_records import FAILED_JOINTS, GOAL_SIZE
from ftqp.kernel.layout.rows import CLEARANCES
from ftqp.kernel.layout.thresholds import LAST
from ftqp.kernel.maths.linear_systems import assign, determinant_sign, lu_factor, lu_solve
from ftqp.kernel.scene.clearance import add_gradient, distance_of_pair, place_capsules
from ftqp.kernel.study.solutions import put_joints, side_of
from ftqp.kernel.study.task_values import any_null_direction, decompose, least_step, task_values


@jit
def begin(S: Any, C: Any, q: Any, failed: Any, speed: Any) -> None:
    """Put the arm at q with these joints failed, and forget the last motion."""
    moving = 0
    put_joints(S, q)
    for i in range(S.chain.n):
        C.step[i] = 0.0
        locked = False
        for f in range(FAILED_JOINTS):
            locked = locked or (failed[f] == i and C.share < 0.0)
        if not locked:
            C.free[moving] = i
            moving += 1
    C.moving, C.fast = moving, -1
    for f in range(FAILED_JOINTS):
        C.failed[f], C.speed[f] = failed[f], speed[f]
        C.begin[f] = q[failed[f]] if failed[f] >= 0 else 0.0
    C.position, C.rotation, C.margin, C.hurry = 0.0, 0.0, 1e300, 0.0
    forget_clearance(S, C)


@jit
def stopped_at(C: Any, f: int, time: float) -> float:
    """q + v s (1 - s/(2T)), s = min(t, T), T = |v|/a_max: the position of a joint that brakes and stands."""
    v = C.speed[f]
    if v == 0.0:
        return C.begin[f]
    T = abs(v) / C.a_max[C.failed[f]]
    s = min(time, T)
    return C.begin[f] + v * s * (1.0 - 0.5 * s / T)


@jit
def put_locked(S: Any, C: Any, time: float) -> None:
    """state.q of the joints that are locked, so long after they failed."""
    if C.share >= 0.0:
        return
    for f in range(FAILED_JOINTS):
        if C.failed[f] >= 0:
            S.state.q[C.failed[f]] = stopped_at(C, f, time)


@jit
def allowed_speed(C: Any, i: int) -> float:
    """The speed limit of a joint that moves, lower where it has lost a share of its speed."""
    if C.share >= 0.0 and (C.failed[0] == i or C.failed[1] == i):
        return C.share * C.v_max[i]
    return C.v_max[i]


@jit
def note_motion(S: Any, C: Any, sample: int) -> bool:
    """Take the last sample's way into margin and hurry; False where a joint is beyond its limits."""
    for c in range(C.moving):
        i = C.free[c]
        q = S.state.q[i]
        C.margin = min(C.margin, C.q_max[i] - q, q - C.q_min[i])
        hurry = abs(q - C.here[i]) / (C.dt * allowed_speed(C, i))
        C.hurry = max(C.hurry, hurry)
        if hurry > 1.0 + 1e-6 and C.fast < 0:
            C.fast = sample
    return C.margin >= -1e-9


@jit
def note_errors(S: Any, C: Any) -> bool:
    """Take the errors at ``state`` into the worst ones; whether they are within their tolerances."""
    study = S.study
    near, turned = 0.0, 0.0
    for row in range(study.m):
        if study.rows[row] < 3:
            near += study.e[row] ** 2
        else:
            turned += (study.e[row] / study.length) ** 2
    near, turned = near**0.5, turned**0.5
    C.position, C.rotation = max(C.position, near), max(C.rotation, turned)
    return near <= C.near and turned <= C.turned


@jit
def forget_clearance(S: Any, C: Any) -> None:
    """Begin a motion, for which no pair has been measured."""
    scene = S.scene
    C.clearance, scene.way = inf, 0.0
    scene.gap[: scene.pairs] = -inf


@jit
def note_clearance(S: Any, C: Any) -> bool:
    """Take the least distance at ``state.q`` into the worst one; False where a pair is too near.

    It is, where it is nearer than is to be kept by more than the tip may be off. A pair comes nearer by no
    more than everything has moved since it was measured, so most need not be measured anew.
    """
    scene = S.scene
    if scene.pairs == 0:
        return True
    _go_on(S)
    placed = False
    for p in range(scene.pairs):
        if scene.gap[p] - scene.way < C.clearance:
            if not placed:
                place_capsules(S)
                placed = True
            C.clearance = min(C.clearance, _measured(S, p))
    return bool(C.clearance >= scene.keep - C.near)


@jit
def nearest_distance(S: Any) -> float:
    """The least distance of all pairs at ``state.q``, inf without any [m]."""
    scene = S.scene
    _go_on(S)
    place_capsules(S)
    least = inf
    for p in range(scene.pairs):
        least = min(least, _measured(S, p))
    return least


@jit
def _go_on(S: Any) -> None:
    """Make ``state.q`` the posture ``ahead``, and note by how far anything may have moved on the way."""
    scene, ahead = S.scene, S.ahead
    for j in range(S.chain.n):
        scene.way += abs(S.state.q[j] - ahead.q[j]) * scene.joint_way[j]
        ahead.q[j] = S.state.q[j]


@jit
def _measured(S: Any, p: int) -> float:
    """The distance of a pair, capsules being placed."""
    scene = S.scene
    d = distance_of_pair(S, p, scene.normal, scene.near, scene.far)
    scene.gap[p] = d + scene.way
    return d


@jit
def _far_from(S: Any, Q: Any) -> float:
    """How much nearer any pair can come in one sample at most [m]."""
    way = 0.0
    for j in range(S.chain.n):
        way += S.scene.joint_way[j] * max(abs(Q.lb[j]), abs(Q.ub[j]))
    return way  # a joint moves one body of a pair, or both alike


@jit
def pose_clearance(S: Any, C: Any) -> None:
    """G x >= -caution (d - keep) of pairs that may come too near in this sample, the nearest ones first."""
    Q, scene, n = C.qp, S.scene, S.chain.n
    Q.nc, Q.rigid, Q.yields_from, Q.soft_rows, Q.soft_last = 0, 0, 0, 0.0, LAST
    if scene.pairs == 0:
        return
    reach, placed = _far_from(S, Q), False
    for p in range(scene.pairs):
        if C.caution * (scene.gap[p] - scene.way - scene.keep) > reach:
            continue
        if not placed:
            place_capsules(S)
            placed = True
        x = _measured(S, p) - scene.keep
        add_gradient(S, p, scene.normal, scene.near, scene.far, scene.row)
        fastest = 0.0
        for j in range(n):
            fastest += max(-scene.row[j] * Q.lb[j], -scene.row[j] * Q.ub[j])
        if C.caution * x > fastest:
            continue
        k = _row_for(Q, scene.spare, x)
        if k < 0:
            continue
        scene.spare[k] = x
        Q.l[k], Q.u[k] = -C.caution * x, inf
        assign(Q.C[k], scene.row, n)


@jit
def _row_for(Q: Any, spare: Any, x: float) -> int:
    """A row for a pair: a new one, or that of the farthest that has one; -1 where all are nearer."""
    if Q.nc < CLEARANCES:
        Q.nc += 1
        return Q.nc - 1
    farthest = 0
    for k in range(1, CLEARANCES):
        if spare[k] > spare[farthest]:
            farthest = k
    return farthest if spare[farthest] > x else -1


CORRECTIONS = 6
"""Newton steps at a sample at most; one or two are usual."""
CONVERGED = 1e-10
"""Largest entry of an error that counts as none [m]. Newton's error falls to rounding one step later."""
LONGEST = 0.5
"""Largest entry of a Newton step [rad or m]."""
DEPENDENT = 1e-9
"""A pivot below this share of the largest means that the joints that are left cannot move the task."""


@jit
def aim(S: Any, goal: Any) -> None:
    """The goal of the study."""
    assign(S.study.goal, goal, GOAL_SIZE)


@jit
def factor_left(S: Any, C: Any) -> float:
    """LU of the columns of A of the joints that move into ``B``; the sign of their determinant."""
    m = S.study.m
    for row in range(m):
        for c in range(m):
            C.B[row, c] = S.study.A[row, C.free[c]]
    lu_factor(C.B, m, C.pivots)
    return determinant_sign(C.B, m, C.pivots)


@jit
def _is_dependent(S: Any, C: Any) -> bool:
    """Whether a pivot of ``B`` counts as zero; inverse pivots are on its diagonal."""
    low, high = 1e300, 0.0
    for k in range(S.study.m):
        inverse = abs(C.B[k, k])
        pivot = 1.0 / inverse if inverse > 0.0 else 0.0
        low, high = min(low, pivot), max(high, pivot)
    return not low > DEPENDENT * high


@jit
def _largest_error(S: Any) -> float:
    """The largest entry of the error at ``state.q``."""
    task_values(S)
    largest = 0.0
    for row in range(S.study.m):
        largest = max(largest, abs(S.study.e[row]))
    return largest


@jit
def _newton(S: Any, C: Any, side: float) -> int:
    """Bring ``state.q`` to the goal with the joints that move, on its side of the singularity."""
    study, m = S.study, S.study.m
    for _ in range(CORRECTIONS):
        if _largest_error(S) < CONVERGED:
            return SURVIVED
        if factor_left(S, C) != side:
            return LOST_BY_SINGULARITY
        assign(C.rhs, study.e, m)
        lu_solve(C.B, m, C.pivots, C.rhs)
        for c in range(m):
            S.state.q[C.free[c]] += min(max(C.rhs[c], -LONGEST), LONGEST)
    task_values(S)
    return SURVIVED


@jit
def _steps(S: Any, C: Any, goals: Any, first: int, path: Any, keep: int) -> int:
    """The samples behind the failure, one after the other; whether limits of speed are kept is noted only."""
    n, q = S.chain.n, S.state.q
    C.sample = first
    aim(S, goals[first])
    task_values(S)
    side = factor_left(S, C)
    if _is_dependent(S, C):
        return LOST_BY_SINGULARITY
    if not note_clearance(S, C):
        return TOO_NEAR
    for k in range(first, len(goals) - 1):
        C.sample = k + 1
        for i in range(n):
            C.here[i] = q[i]
            q[i] += C.step[i]
        put_locked(S, C, (k + 1 - first) * C.dt)
        aim(S, goals[k + 1])
        if _newton(S, C, side) == LOST_BY_SINGULARITY:
            return LOST_BY_SINGULARITY
        if not note_errors(S, C):
            return NOT_CONVERGED
        for i in range(n):
            C.step[i] = q[i] - C.here[i]
            if keep:
                path[k + 1 - first, i] = q[i]
        if not note_motion(S, C, k + 1):
            return LIMIT
        if not note_clearance(S, C):
            return TOO_NEAR
    if factor_left(S, C) != side:
        return LOST_BY_SINGULARITY
    return SURVIVED


@jit
def exact_run(S: Any, C: Any, goals: Any, first: int, path: Any, keep: int) -> int:
    """How the motion from ``state.q`` ends whose joints have failed at a sample; see ``Survival``.

    Each sample starts from the last increments and is reached by Newton steps of the joints
    that move. Where the determinant of their columns has changed its sign a coarse step has jumped over a
    singularity, to another branch. A speed limit that is broken on the way to a singularity is the
    singularity's first sign.
    """
    ending = _steps(S, C, goals, first, path, keep)
    if C.fast >= 0:
        C.sample = min(C.sample, C.fast)
        if ending == SURVIVED:
            return LOST_BY_VELOCITY
        if ending == LOST_BY_SINGULARITY or ending == NOT_CONVERGED:
            return SINGULAR_VELOCITY
    return ending


ITERATIONS = 100
"""Changes of the working set of one QP at most."""


@jit
def pose_problem(S: Any, C: Any, time: float) -> None:
    """min |x|^2 + w |A x - e|^2, l <= x <= u: the increments of one sample, at ``state.q``, into ``qp``.

    l = max(-v_max dt, (q_min - q) caution), u alike; of a joint that is locked both are its way while it
    brakes. Bodies that are to be kept apart have the rows of ``pose_clearance``.
    """
    Q, study, n = C.qp, S.study, S.chain.n
    Q.nx, Q.meq, Q.nc, Q.dense, Q.warm = n, study.m, 0, 0, 0
    Q.tolerance, Q.max_iterations = 1e-12, ITERATIONS
    for row in range(study.m):
        assign(Q.A[row], study.A[row], n)
        Q.b[row], Q.soft[row] = study.e[row], 1.0 / C.weight
    for i in range(n):
        q, way = S.state.q[i], C.dt * allowed_speed(C, i)
        low = max(-way, C.caution * (C.q_min[i] - q))
        high = min(way, C.caution * (C.q_max[i] - q))
        Q.lb[i], Q.ub[i] = min(low, way), max(high, -way)
        Q.g[i], Q.H_diagonal[i] = 0.0, 1.0
    if C.share < 0.0:
        for f in range(FAILED_JOINTS):
            j = C.failed[f]
            if j >= 0:
                way = stopped_at(C, f, time) - S.state.q[j]
                Q.lb[j], Q.ub[j] = way, way
    pose_clearance(S, C)


@jit
def bounded_run(S: Any, C: Any, goals: Any, first: int, path: Any, keep: int) -> int:
    """How the motion from ``state.q`` ends whose joints have failed at a sample; see ``Survival``.

    Every sample takes the increments of ``pose_problem``, so that limits are kept always, and the motion is
    lost where an error leaves its tolerance or a body comes too near to another one. Where ``whole``, it is
    followed to the end all the same, as the best that is left; ``sample`` is the first that was lost.
    """
    ending = SURVIVED
    C.sample = first
    if not note_clearance(S, C):
        ending = TOO_NEAR
        if not C.whole:
            return ending
    for k in range(first, len(goals) - 1):
        aim(S, goals[k + 1])
        task_values(S)
        pose_problem(S, C, (k + 1 - first) * C.dt)
        if active_set(C.qp) != SOLVED:
            C.sample, C.position, C.rotation = k + 1, inf, inf
            return NOT_CONVERGED
        for i in range(S.chain.n):
            C.here[i] = S.state.q[i]
            S.state.q[i] += C.qp.x[i]
            if keep:
                path[k + 1 - first, i] = S.state.q[i]
        task_values(S)
        kept, clear = note_errors(S, C), note_clearance(S, C)
        note_motion(S, C, k + 1)
        if ending == SURVIVED:
            C.sample = k + 1
            ending = SURVIVED if kept and clear else TOO_NEAR if kept else ERROR
        if ending != SURVIVED and not C.whole:
            return ending
    return ending


SELF_CORRECTIONS = 8
"""The same of a motion at a given self-motion speed."""
SELF_CONVERGED = 1e-11
"""The same."""
FOLLOWED = 1e-8
"""An error from which on the path is lost [m]. A thousand times the above, so that rounding of a long arm
loses no path."""


@jit
def self_speed_run(S: Any, goals: Any, dt: float, speeds: Any, path: Any) -> tuple[int, float]:
    """q += dt speed n, then q += A^+ e until e counts as none; the last sample that was reached, and |e|.

    n is the unit null vector with det [n; A] > 0. The path begins at its row 0, and rows behind the last
    sample are left as they are. Where all speeds are 0 the arm may have any number of joints.
    """
    n, worst = S.chain.n, 0.0
    put_joints(S, path[0])
    for k in range(len(goals) - 1):
        if speeds[k] != 0.0:
            task_values(S)
            decompose(S)
            any_null_direction(S, S.study.tangent)
            way = dt * speeds[k] * side_of(S, S.study.tangent) * (1.0 - 2.0 * (S.study.m & 1))
            for i in range(n):
                S.state.q[i] += way * S.study.tangent[i]
        aim(S, goals[k + 1])
        largest = inf
        for _ in range(SELF_CORRECTIONS):
            largest = _largest_error(S)
            if not largest >= SELF_CONVERGED:
                break
            decompose(S)
            least_step(S, 0.0)
            for i in range(n):
                S.state.q[i] += S.study.dq[i]
        if not largest < FOLLOWED:
            return k, worst
        worst = max(worst, largest)
        assign(path[k + 1], S.state.q, n)
    return len(goals) - 1, worst
