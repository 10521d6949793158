"""Where the error of an arm is too small for its curvature to matter, so that its tick is none of calm."""

from typing import Any

from ftqp.kernel.calm.curvature import weighted_error
from ftqp.kernel.calm.trigger import NEAR, STEP, largest_curvature, room_to_limit, unit_of
from ftqp.kernel.jit import jit
from ftqp.kernel.layout.enums import SLACK
from ftqp.kernel.maths.elementary import any_of, larger, select, sqrt
from ftqp.kernel.maths.vectors import cross

MORE, LESS = 1.1, 0.8
"""A new bound on the smallest singular value is looked for at these shares of the last one."""
BEND = 1.0 / 11.0
"""1 - x cot x <= 4 BEND x^2 up to the half angles that the common tick takes."""


@jit
def needs_no_calm(L: Any, kp: float, inside: Any) -> Any:
    """Where ``ftqp.kernel.calm.calm_qp.calms`` says no: D = 0.

    First by what is known of sigma_min from some ticks before; where that does not do, by a new bound near
    it; and where that does not do, by the norm of the curvature itself.
    """
    state, calm = L.state, L.calm
    moved = most = abs(state.q[0] - calm.q_seen[0]) * 0.0
    if not calm.on or kp == 0.0:
        return most >= 0.0
    for i in range(L.chain.n):
        step = abs(state.q[i] - calm.q_seen[i]) / unit_of(L, i)
        moved, most = moved + step, larger(most, step)
    least = calm.sigma_seen[0] - calm.lipschitz * moved
    bend = largest_curvature(L)
    regular = (most < STEP) & (least > 0.0) & (bend < least * least)
    if any_of(inside & ~regular):
        _gram(L)
        found = _look_again(L, inside & ~regular)
        regular = regular | (found & (bend < calm.sigma_seen[0] * calm.sigma_seen[0]))
        if any_of(inside & ~regular):
            s = _curvature(L)
            regular = regular | _exceeds(L, s) | (s <= _softness(L))
    return regular


@jit
def _softness(L: Any) -> Any:
    """The compliance of the task as a whole; 0 where its rows are hard."""
    task = L.task
    soft = L.qp.soft[0] / task.yielding[task.rows[0]]
    return soft if task.mode == SLACK else 0.0 * soft


@jit
def _gram(L: Any) -> None:
    """G <- A A' of the weighted rows over the joints that work, away from their limits."""
    task, lane, works, A = L.task, L.lane, L.faults.works, L.qp.A
    for i in range(L.chain.n):
        stays = (room_to_limit(L, i) > NEAR + STEP) & (works[i] > 0.0)
        lane.inverse[i] = select(stays, works[i], 0.0)
    for a in range(task.m):
        for b in range(a + 1):
            s = lane.inverse[0] * A[a, 0] * A[b, 0]
            for i in range(1, L.chain.n):
                s = s + lane.inverse[i] * A[a, i] * A[b, i]
            lane.G[a, b] = s / (sqrt(task.yielding[task.rows[a]]) * sqrt(task.yielding[task.rows[b]]))


@jit
def _look_again(L: Any, wanted: Any) -> Any:
    """A new lower bound on sigma_min of the lanes that want one, near the last one; where it was found."""
    calm, state = L.calm, L.state
    seen = calm.sigma_seen[0]
    more, less = MORE * seen, LESS * seen
    known = wanted & (seen > 0.0)
    has_more = known & _exceeds(L, more * more)
    found = has_more
    if any_of(known & ~has_more):
        found = found | (known & _exceeds(L, less * less))
    calm.sigma_seen[0] = select(found, select(has_more, more, less), seen)
    for i in range(L.chain.n):
        calm.q_seen[i] = select(found, state.q[i], calm.q_seen[i])
    return found


@jit
def _exceeds(L: Any, square: Any) -> Any:
    """Where sigma_min^2 >= square: where G - square 1 has a Cholesky factor."""
    F, G, m = L.lane.L, L.lane.G, L.task.m
    good = square >= 0.0
    for k in range(m):
        pivot = G[k, k] - square
        for j in range(k):
            s = G[k, j]
            for i in range(j):
                s = s - F[k, i] * F[j, i]
            s = s * F[j, j]
            F[k, j] = s
            pivot = pivot - s * s
        fits = pivot > 0.0
        good = good & fits
        F[k, k] = 1.0 / sqrt(select(fits, pivot, 1.0))
    return good


@jit
def _curvature(L: Any) -> Any:
    """No less than the norm of ``ftqp.kernel.calm.curvature.curvature``, and hardly more.

    How the rotation vector itself bends is bounded by its angle, that of the tool axis by its own.
    """
    task, J, v, works = L.task, L.kinematics.J, L.calm.weighted, L.faults.works
    weighted_error(L)
    square = 0.0 * v[0]
    joints = square
    for j in range(L.chain.n):
        c0, c1, c2 = cross(J[0, j], J[1, j], J[2, j], v[0], v[1], v[2])
        r0, r1, r2 = cross(J[3, j], J[4, j], J[5, j], v[3], v[4], v[5])
        joints = joints + works[j]
        for i in range(j + 1):
            s = J[3, i] * c0 + J[4, i] * c1 + J[5, i] * c2
            if i != j:
                s = s + 0.5 * (J[3, i] * r0 + J[4, i] * r1 + J[5, i] * r2)
            share = 1.0 if i == j else 2.0
            square = square + share * works[i] * works[j] * s * s
    e = task.rotation_error
    weight = task.length * task.length / task.yielding[3]
    bend = e * (1.0 + e) if task.tool_rows else BEND * e * e
    return sqrt(square) + joints * weight * bend
