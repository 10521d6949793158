"""The metric D: how firmly a motion is held back where the error bends more than the rows can hold."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.calm.curvature import curvature, spread, weigh_rows
from ftqp.kernel.calm.rest import LEAST
from ftqp.kernel.calm.trigger import NEAR, exceeds, gram_of_rows, unit_of
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import TARGET_TWIST
from ftqp.kernel.maths.symmetric_eigen import eigensystem
from ftqp.kernel.maths.vectors import add_to, times
from ftqp.kernel.rows.task_rows import tool_axis

FLOOR = 0.1
"""Least stiffness of a mode, as a share of what it would be were all signs the same (kappa). Modes between
rows and curvature become slower with it (docs/theory/calm.md, "Constants")."""

SWIVEL = 0.15
"""Least stiffness of a mode that can hardly remove error, as a share of ||S|| (nu), ..."""
LEAST_SWIVEL = 0.1
"""... lowered to this share of that where the mode can remove ..."""
REMOVABLE = 0.1
"""... this share of the error or more. The floor keeps the swivels of a straight arm from spinning at full
speed for tenths of a millimetre (docs/theory/calm.md, "The metric"); all three values are guesses that the
campaigns have not contradicted."""

SADDLE = 0.05
"""A mode of less than -SADDLE ||S|| leads away from a saddle; there the kick is this displacement [rad]."""
LOST = 0.5
"""There is a kick only where at least this share of e'e is lost to the rows. An arm of 30 joints that lagged
behind by 2 mm was thrown about by its self-motions without it (docs/theory/calm.md, "Saddles"); the half is a
guess."""


@jit
def free_joints(K: Any) -> int:
    """Which working joints can follow the gradient A'e, first in ``calm.free``; how many."""
    limits, faults, state, task, calm = K.limits, K.faults, K.state, K.task, K.calm
    count, last = 0, faults.working
    for k in range(faults.working):
        i = faults.order[k]
        s = 0.0
        for r in range(task.m):
            s += calm.A[r, i] * calm.e[r]
        calm.gradient[i] = s
        near = NEAR * unit_of(task, K.chain, i)
        q = state.q[i]
        if (s > 0.0 and limits.q_max[i] - q < near) or (s < 0.0 and q - limits.q_min[i] < near):
            last -= 1
            calm.free[last] = i
        else:
            calm.free[count] = i
            count += 1
    return count


@jit
def _add_modulus(faults: Any, calm: Any) -> None:
    """D <- |S| over the joints that work, the matrix absolute value."""
    w, W, Z, D = faults.working, calm.work, calm.modes, calm.D
    for a in range(w):
        i = faults.order[a]
        for b in range(a + 1):
            W[a, b] = calm.S[i, faults.order[b]]
    eigensystem(W, w, calm.values, calm.beside, Z)
    for a in range(w):
        i = faults.order[a]
        for b in range(a + 1):
            j = faults.order[b]
            s = 0.0
            for k in range(w):
                s += abs(calm.values[k]) * Z[k, a] * Z[k, b]
            D[i, j] = D[j, i] = s


@jit
def _gain_of(task: Any, calm: Any, i: int, j: int) -> float:
    """(A'A)_ij."""
    A = calm.A
    s = 0.0
    for k in range(task.m):
        s += A[k, i] * A[k, j]
    return s


@jit
def _see_singular_directions(task: Any, calm: Any, count: int) -> None:
    """The squares sigma_k^2 and the left singular vectors, rows of U, of A over the free joints."""
    gram_of_rows(task, calm, count)
    eigensystem(calm.G, task.m, calm.squares, calm.beside, calm.U)


@jit
def _lost(task: Any, calm: Any, s: float) -> float:
    """sum_k phi_k (u_k'e)^2: what of e'e lies where the curvature outweighs the rows, see ``_fade``."""
    m = task.m
    lost = 0.0
    for k in range(m):
        phi = 1.0 - max(calm.squares[k], 0.0) / s
        if phi > 0.0:
            x = 0.0
            for r in range(m):
                x += calm.U[k, r] * calm.e[r]
            lost += phi * x * x
    return lost


@jit
def _find_modes(task: Any, calm: Any, count: int) -> None:
    """The modes mu_k, z_k of (A'A + S)_FF, and (A'A)_FF as ``calm.gains``."""
    W, G = calm.work, calm.gains
    for a in range(count):
        i = calm.free[a]
        for b in range(a + 1):
            j = calm.free[b]
            gain = _gain_of(task, calm, i, j)
            G[a, b] = G[b, a] = gain
            W[a, b] = gain + calm.S[i, j]
    eigensystem(W, count, calm.values, calm.beside, calm.modes)


@jit
def _least_stiffness(calm: Any, count: int, k: int, s: float, square: float) -> float:
    """max(|mu_k|, nu_k s)."""
    size, along = abs(calm.values[k]), _slope(calm, count, k)
    removable = along * along / (size * square + 1e-300)
    nu = SWIVEL * min(1.0, max(LEAST_SWIVEL, 1.0 - removable / REMOVABLE))
    return max(size, nu * s)


@jit
def _slope(calm: Any, count: int, k: int) -> float:
    """z_k'A'e."""
    along = 0.0
    for a in range(count):
        along += calm.modes[k, a] * calm.gradient[calm.free[a]]
    return along


@jit
def _is_stiff(calm: Any, count: int, s: float, square: float) -> bool:
    """The stiffness of each mode in ``calm.beside``, where |S| certainly raises none and all joints are free.

    z'|S|z <= ||S z|| for a unit vector, and z_k'A'A z_k = mu_k - z_k'S z_k.
    """
    for k in range(count):
        z = calm.modes[k]
        bend = own = 0.0
        for a in range(count):
            i = calm.free[a]
            t = 0.0
            for b in range(count):
                t += calm.S[i, calm.free[b]] * z[b]
            bend += t * t
            own += z[a] * t
        least = _least_stiffness(calm, count, k, s, square)
        if FLOOR * (calm.values[k] - own + sqrt(bend)) > least:
            return False
        calm.beside[k] = least
    return True


@jit
def _stiffen(calm: Any, count: int, s: float, square: float) -> None:
    """The same of any arm, from D = |S|."""
    for k in range(count):
        z = calm.modes[k]
        stiff = 0.0
        for a in range(count):
            t = 0.0
            for b in range(count):
                t += (calm.gains[a, b] + calm.D[calm.free[a], calm.free[b]]) * z[b]
            stiff += z[a] * t
        calm.beside[k] = max(_least_stiffness(calm, count, k, s, square), FLOOR * stiff)


@jit
def _newton_metric(faults: Any, task: Any, calm: Any, count: int, s: float, square: float) -> None:
    """D <- P - A'A, and the kick.

        P_FF = Z diag(max(|mu_k|, FLOOR z_k'(A'A + |S|)z_k, nu_k s)) Z',  P_BB = (A'A + |S|)_BB,  P_FB = 0
        nu_k = SWIVEL min(1, max(LEAST_SWIVEL, 1 - r_k/REMOVABLE)),  r_k = (z_k'A'e)^2/(|mu_k| e'e)

    mu_k, z_k are the modes of (A'A + S)_FF. Where mu_k < -SADDLE s and |z_k'A'e| is below
    SADDLE |mu_k|, the gradient along z_k becomes that, in its own direction; not for a last millimetre, nor
    while the rows can remove most of the error themselves. It needs ``_see_singular_directions``.
    """
    D, Z = calm.D, calm.modes
    whole = count == faults.working
    if whole:
        _find_modes(task, calm, count)
    if not whole or not _is_stiff(calm, count, s, square):
        _add_modulus(faults, calm)
        _find_modes(task, calm, count)
        _stiffen(calm, count, s, square)
    stuck = square > LEAST and _lost(task, calm, s) >= LOST * square
    if stuck:
        for k in range(count):
            mu, along = calm.values[k], _slope(calm, count, k)
            size = abs(mu)
            if mu < -SADDLE * s and abs(along) < SADDLE * size:
                _kick(calm, count, k, along, SADDLE * size)
    for a in range(count):
        i = calm.free[a]
        for b in range(a + 1):
            j = calm.free[b]
            t = -calm.gains[a, b]
            for k in range(count):
                t += calm.beside[k] * Z[k, a] * Z[k, b]
            D[i, j] = D[j, i] = t
    for a in range(count):
        i = calm.free[a]
        for b in range(count, faults.working):
            j = calm.free[b]
            D[i, j] = D[j, i] = -_gain_of(task, calm, i, j)


@jit
def _kick(calm: Any, count: int, mode: int, along: float, size: float) -> None:
    """Add to the kick what makes the gradient along a mode as large as ``size``."""
    z = calm.modes[mode]
    sign = 1.0 if along > 0.0 else -1.0
    if along == 0.0:
        largest = 0.0
        for a in range(count):
            if abs(z[a]) > abs(largest) + 1e-9:
                largest = z[a]
        sign = 1.0 if largest > 0.0 else -1.0
    for a in range(count):
        calm.kick[calm.free[a]] += (sign * size - along) * z[a]


@jit
def _fade(faults: Any, task: Any, calm: Any, count: int, s: float) -> None:
    """D <- psi T D T and kick <- psi T kick: the metric is there only where it is needed.

        T = 1 - sum_k (1 - sqrt(phi_k)) v_k v_k',  phi_k = max(0, 1 - sigma_k^2/s),
        psi = max(0, 1 - sigma_min^2/s)

    sigma_k and v_k are those of A over the free joints.
    """
    m, w, D, U = task.m, faults.working, calm.D, calm.U
    least = calm.squares[0]
    for k in range(m):
        square = max(calm.squares[k], 0.0)
        least = min(least, square)
        phi = max(0.0, 1.0 - square / s)
        t = 1.0 - sqrt(phi)
        if t <= 0.0 or square <= 0.0:
            continue
        v, inverse = calm.direction, 1.0 / sqrt(square)
        for a in range(w):
            v[faults.order[a]] = 0.0
        for a in range(count):
            i = calm.free[a]
            x = 0.0
            for r in range(m):
                x += U[k, r] * calm.A[r, i]
            v[i] = x * inverse
        _project(faults, calm, t)
    psi = max(0.0, 1.0 - max(least, 0.0) / s)
    calm.psi = psi
    for a in range(w):
        i = faults.order[a]
        calm.kick[i] *= psi
        for b in range(w):
            D[i, faults.order[b]] *= psi


@jit
def _project(faults: Any, calm: Any, t: float) -> None:
    """D <- (1 - t v v') D (1 - t v v') and kick <- (1 - t v v') kick with the unit vector ``direction``."""
    w, D, v, y = faults.working, calm.D, calm.direction, calm.beside
    twice = kicked = 0.0
    for a in range(w):
        i = faults.order[a]
        x = 0.0
        for b in range(w):
            j = faults.order[b]
            x += D[i, j] * v[j]
        y[i] = x
        twice += v[i] * x
        kicked += v[i] * calm.kick[i]
    for a in range(w):
        i = faults.order[a]
        calm.kick[i] -= t * kicked * v[i]
        for b in range(w):
            j = faults.order[b]
            D[i, j] += t * (t * twice * v[i] * v[j] - y[i] * v[j] - v[i] * y[j])


@jit
def find_metric(K: Any, s: float, square: float) -> int:
    """D and the kick for a curvature of norm s and an error of ``square`` e'e: how many joints are free.

    -1 when D = 0, because no eigenvalue of S is larger than sigma_min^2 over the free joints: first by s.
    Source: docs/theory/calm.md, "The metric".
    """
    count = free_joints(K)
    if count >= K.task.m:
        gram_of_rows(K.task, K.calm, count)
        if exceeds(K.task, K.calm, s):
            return -1
        gram_of_rows(K.task, K.calm, count)
        if exceeds(K.task, K.calm, spread(K.chain, K.calm)):
            return -1
    for i in range(K.chain.n):
        K.calm.kick[i] = 0.0
        for j in range(K.chain.n):
            K.calm.D[i, j] = 0.0
    K.calm.psi = 1.0
    if count == 0:
        _add_modulus(K.faults, K.calm)
    else:
        _see_singular_directions(K.task, K.calm, count)
        _newton_metric(K.faults, K.task, K.calm, count, s, square)
        _fade(K.faults, K.task, K.calm, count, s)
    return count


SINGULAR = 0.1
"""Singular value [characteristic lengths] below which the tip counts as not moved by a direction."""
NOTICEABLE = 0.02
"""A share of the path's tangent below this, along directions that are lost, is not what holds the path."""
AHEAD = 1e-4
"""How far along that share it is looked at [characteristic lengths]: so near that rotations do not bend. A
rotation by so much bends by its square only, so that 1e-8 of it is left out."""
WAY_ON = 3e-3
"""A curvature below -WAY_ON ||S|| along a self-motion is a way on. `python studies/lock_sets.py` judges it:
arms that stand stretched out, where no way leads on, have curvatures down to this
(docs/theory/path-progress.md, "Stalls")."""


@jit
def _seek_null_space(task: Any, calm: Any, count: int) -> int:
    """Rows 0..k-1 of ``calm.modes``: the self-motions of the free joints; k."""
    A, W, Z = calm.A, calm.work, calm.modes
    edge = (SINGULAR * task.length) ** 2
    for a in range(count):
        for b in range(a + 1):
            W[a, b] = W[b, a] = _gain_of(task, calm, calm.free[a], calm.free[b])
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
    for c in range(6):
        task.error[c] = 0.0
    for k in range(task.m):
        c = task.rows[k]
        x = scale * calm.e[k] * sqrt(task.yielding[c]) / task.row_scale[c]
        if c < 3 or not task.tool_rows:
            task.error[c] = x
            continue
        add_to(task.error, 3, times(x, tool_axis(task, kinematics, c - 3)))


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
    return _lowest(K.faults, task, K.kinematics, K.chain, calm, path, count, null) < -WAY_ON


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
