"""Motions of arms with joints to spare after a failure, or with too few: one small QP a sample.

Source: docs/theory/coverage.md, "The bounded continuation".
"""

from math import inf
from typing import Any

from ftqp.kernel.active_set.active_set import active_set
from ftqp.kernel.continuation.exact_runs import aim
from ftqp.kernel.continuation.failing import allowed_speed, note_errors, note_motion, stopped_at
from ftqp.kernel.continuation.passing_bodies import note_clearance, pose_clearance
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import ERROR, NOT_CONVERGED, SOLVED, SURVIVED, TOO_NEAR
from ftqp.kernel.layout.other_records import FAILED_JOINTS
from ftqp.kernel.study.task_values import task_values

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
        for i in range(n):
            Q.A[row, i] = study.A[row, i]
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

    Args:
        S: The record of the study.
        C: Memory of the continuation, as ``begin`` leaves it.
        goals: Of all samples, (N + 1, 12).
        first: The sample at which the joints fail.
        path: Where ``keep`` is 1, filled with the samples from there on, (N + 1 - first, n).
        keep: As above.
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
