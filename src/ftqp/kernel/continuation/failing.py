"""Joints that fail: which ones are left to move, and where a joint is that brakes and then stands."""

from typing import Any

from ftqp.kernel.continuation.passing_bodies import forget_clearance
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.other_records import FAILED_JOINTS


@jit
def begin(S: Any, C: Any, q: Any, failed: Any, speed: Any) -> None:
    """Put the arm at q with these joints failed, and forget the last motion."""
    moving = 0
    for i in range(S.chain.n):
        S.state.q[i] = q[i]
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
