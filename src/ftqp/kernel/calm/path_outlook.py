"""Whether a stalled path can go on past a singularity: the self-motion along which the arm bends that way."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.calm.curvature import curvature, weigh_rows
from ftqp.kernel.calm.metric import free_joints
from ftqp.kernel.calm.trigger import unit_of
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import TARGET_TWIST
from ftqp.kernel.maths.symmetric_eigen import eigensystem

SINGULAR = 0.1
"""Singular value [characteristic lengths] below which the tip counts as not moved by a direction."""
NOTICEABLE = 0.02
"""A share of the path's tangent below this, along directions that are lost, is not what holds the path."""
AHEAD = 1e-4
"""How far along that share it is looked at [characteristic lengths]: so near that rotations do not bend. A
rotation by so much bends by its square only, so that 1e-8 of it is left out."""
SADDLE = 3e-3
"""A curvature below -SADDLE ||S|| along a self-motion is a way on. `python studies/lock_sets.py` judges it:
arms that stand stretched out, where no way leads on, have curvatures down to this
(docs/theory/path-progress.md, "Stalls")."""


@jit
def _seek_null_space(task: Any, calm: Any, count: int) -> int:
    """Rows 0..k-1 of ``calm.modes``: the self-motions of the free joints; k.

    What of ``calm.e`` the other modes can make is taken out of it.
    """
    A, W, Z = calm.A, calm.work, calm.modes
    edge = (SINGULAR * task.length) ** 2
    for a in range(count):
        for b in range(a + 1):
            s = 0.0
            for k in range(task.m):
                s += A[k, calm.free[a]] * A[k, calm.free[b]]
            W[a, b] = W[b, a] = s
    eigensystem(W, count, calm.values, calm.beside, Z)
    null = 0
    for j in range(count):
        if calm.values[j] > edge:
            along = 0.0
            for k in range(task.m):
                calm.b[k] = 0.0
                for a in range(count):
                    calm.b[k] += A[k, calm.free[a]] * Z[j, a]
                along += calm.b[k] * calm.e[k]
            for k in range(task.m):
                calm.e[k] -= along * calm.b[k] / calm.values[j]
        else:
            for a in range(count):
                z = Z[j, a]
                Z[j, a] = Z[null, a]
                Z[null, a] = z
            null += 1
    return null


@jit
def _take_for_error(task: Any, kinematics: Any, calm: Any, scale: float) -> None:
    """The error along W whose weighted rows are ``scale`` times ``calm.e``."""
    R, axis = kinematics.R_tip, task.axis
    for c in range(6):
        task.error[c] = 0.0
    for k in range(task.m):
        c = task.rows[k]
        x = scale * calm.e[k] * sqrt(task.yielding[c]) / task.row_scale[c]
        if c < 3 or not task.tool_rows:
            task.error[c] = x
            continue
        for r in range(3):  # the tool's own axis c - 3 along W
            at = 3 * r
            task.error[3 + r] += x * (R[at] * axis[c - 3] + R[at + 1] * axis[c] + R[at + 2] * axis[c + 3])


@jit
def _lowest(
    faults: Any, task: Any, kinematics: Any, chain: Any, calm: Any, path: Any, count: int, null: int
) -> float:
    """The least curvature along a self-motion over ||S||, and that motion as ``path.way``."""
    S, N, W, Z = calm.S, calm.modes, calm.gains, calm.work
    s = curvature(faults, task, kinematics, chain, calm)
    if not s > 0.0:
        return 0.0
    for k in range(null):
        for a in range(count):
            x = 0.0
            for b in range(count):
                x += S[calm.free[a], calm.free[b]] * N[k, b]
            calm.beside[a] = x
        for j in range(k + 1):
            x = 0.0
            for a in range(count):
                x += N[j, a] * calm.beside[a]
            W[k, j] = W[j, k] = x
    eigensystem(W, null, calm.values, calm.beside, Z)
    at, least = 0, inf
    for k in range(null):
        if calm.values[k] < least:
            at, least = k, calm.values[k]
    for i in range(chain.n):
        calm.direction[i] = 0.0
    for a in range(count):
        x = 0.0
        for k in range(null):
            x += Z[at, k] * N[k, a]
        calm.direction[calm.free[a]] = x
    return least / s


@jit
def _draw(state: Any, task: Any, chain: Any, calm: Any, path: Any) -> None:
    """Draw the joints along the way that was found, to the side to which they are drawn or move already."""
    kept = moving = largest = 0.0
    for i in range(chain.n):
        x = calm.direction[i]
        kept += x * path.drive[i]
        moving += x * state.v[i]
        largest = max(largest, abs(x))
    side = kept if path.found else moving
    size = (path.speed if side >= 0.0 else -path.speed) / max(largest, 1e-300)
    for i in range(chain.n):
        path.drive[i] = size * unit_of(task, chain, i) * calm.direction[i]
    path.found = path.driven = 1


@jit
def _see_saddle(K: Any, path: Any) -> bool:
    """Whether the tangent of the path, which stands in ``task.error``, is lost but for a self-motion."""
    task, calm = K.task, K.calm
    size = sqrt(weigh_rows(task, K.kinematics, K.chain, K.qp, calm))
    if not size > 0.0:
        return False
    count = free_joints(K)
    null = _seek_null_space(task, calm, count)
    lost = 0.0
    for k in range(task.m):
        lost += calm.e[k] * calm.e[k]
    lost = sqrt(lost)
    if null == 0 or not lost > NOTICEABLE * size:
        return False
    _take_for_error(task, K.kinematics, calm, AHEAD * task.length / lost)
    return _lowest(K.faults, task, K.kinematics, K.chain, calm, path, count, null) < -SADDLE


@part_jit
def outlook(K: Any, path: Any) -> None:
    """Where it is asked for and there is one, draw the joints along the way on: ``path.found``.

    p is the part of the path's tangent along singular directions of the free joints, N their self-motions,
    singular ones included. A self-motion z moves the tip by -z'S(p)z/2 along p, to second order: where the
    least eigenvalue of N'S(p)N is clearly below zero, that is a way on, else there is none so near. It needs
    ``task_rows``.
    Source: docs/theory/path-progress.md, "Stalls".
    """
    if path.speed == 0.0 or not K.calm.on:
        path.found = 0
        return
    task = K.task
    for c in range(6):
        path.kept[c] = task.error[c]
        task.error[c] = task.target[TARGET_TWIST + c]
    if _see_saddle(K, path):
        _draw(K.state, task, K.chain, K.calm, path)
    else:
        path.found = 0
    for c in range(6):
        task.error[c] = path.kept[c]
