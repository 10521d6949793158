"""The metric D: how firmly a motion is held back where the error bends more than the rows can hold."""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import TARGET_TWIST
from ftqp.kernel.maths.elementary import mul_add, select
from ftqp.kernel.maths.linear_systems import assign, plus_products
from ftqp.kernel.maths.side_by_side import WIDTH, is_set, lane_mask, load_lanes, store_lanes
from ftqp.kernel.maths.symmetric_eigen import eigensystem
from ftqp.kernel.maths.vectors import add_to, times
from ftqp.kernel.rows.task_rows import tool_axis
from ftqp.kernel.settling.curvature import curvature, spread, weigh_rows
from ftqp.kernel.settling.rest import LEAST
from ftqp.kernel.settling.trigger import NEAR, exceeds, gram_of_rows, unit_of

FLOOR = 0.1
"""Least stiffness of a mode, as a share of what it would be were all signs the same (kappa). Modes between
rows and curvature become slower with it (docs/theory/settling.md, "Constants")."""

SWIVEL = 0.15
"""Least stiffness of a mode that can hardly remove error, as a share of ||S|| (nu), ..."""
LEAST_SWIVEL = 0.1
"""... lowered to this share of that where the mode can remove ..."""
REMOVABLE = 0.1
"""... this share of the error or more. The floor keeps the swivels of a straight arm from spinning at full
speed for tenths of a millimetre (docs/theory/settling.md, "The metric"); all three values are guesses that
the campaigns have not contradicted."""

SADDLE = 0.05
"""A mode of less than -SADDLE ||S|| leads away from a saddle; there the kick is this displacement [rad]."""
LOST = 0.5
"""There is a kick only where at least this share of e'e is lost to the rows. An arm of 30 joints that lagged
behind by 2 mm was thrown about by its self-motions without it (docs/theory/settling.md, "Saddles"); the half
is a guess."""


@jit
def free_joints(K: Any) -> int:
    """Which working joints can follow the gradient A'e, first in ``settling.free``; how many."""
    limits, faults, state, task, settling = K.limits, K.faults, K.state, K.task, K.settling
    count, last = 0, faults.working
    for k in range(faults.working):
        i = faults.order[k]
        s = plus_products(0.0, settling.A[:, i], settling.e, task.m)
        settling.gradient[i] = s
        near = NEAR * unit_of(task, K.chain, i)
        q = state.q[i]
        if (s > 0.0 and limits.q_max[i] - q < near) or (s < 0.0 and q - limits.q_min[i] < near):
            last -= 1
            settling.free[last] = i
        else:
            settling.free[count] = i
            count += 1
    return count


@jit
def _add_modulus(faults: Any, settling: Any) -> None:
    """D <- |S| over the joints that work, the matrix absolute value."""
    w, W, Z, D = faults.working, settling.work, settling.modes, settling.D
    for a in range(w):
        i = faults.order[a]
        for b in range(a + 1):
            W[a, b] = settling.S[i, faults.order[b]]
    eigensystem(W, w, settling.values, settling.beside, Z)
    for a in range(w):
        i = faults.order[a]
        for b in range(a + 1):
            j = faults.order[b]
            s = 0.0
            for k in range(w):
                s += abs(settling.values[k]) * Z[k, a] * Z[k, b]
            D[i, j] = D[j, i] = s


@jit
def _gain_of(task: Any, settling: Any, i: int, j: int) -> float:
    """(A'A)_ij."""
    A = settling.A
    s = plus_products(0.0, A[:, i], A[:, j], task.m)
    return s


@jit
def _see_singular_directions(task: Any, settling: Any) -> None:
    """The squares sigma_k^2 and the left singular vectors, rows of U, of A over the free joints.

    Needs ``gram_of_rows``, and takes what that has found.
    """
    eigensystem(settling.G, task.m, settling.squares, settling.beside, settling.U)


@jit
def _lost(task: Any, settling: Any, s: float) -> float:
    """sum_k phi_k (u_k'e)^2: what of e'e lies where the curvature outweighs the rows, see ``_fade``."""
    m = task.m
    lost = 0.0
    for k in range(m):
        phi = 1.0 - max(settling.squares[k], 0.0) / s
        if phi > 0.0:
            x = plus_products(0.0, settling.U[k], settling.e, m)
            lost += phi * x * x
    return lost


@jit
def _find_modes(task: Any, settling: Any, count: int) -> None:
    """The modes mu_k, z_k of (A'A + S)_FF, and (A'A)_FF as ``settling.gains``."""
    W, G = settling.work, settling.gains
    for a in range(count):
        i = settling.free[a]
        for b in range(a + 1):
            j = settling.free[b]
            gain = _gain_of(task, settling, i, j)
            G[a, b] = G[b, a] = gain
            W[a, b] = gain + settling.S[i, j]
    eigensystem(W, count, settling.values, settling.beside, settling.modes)


@jit
def _least_stiffness(settling: Any, count: int, k: int, s: float, square: float) -> float:
    """max(|mu_k|, nu_k s)."""
    size, along = abs(settling.values[k]), _slope(settling, count, k)
    removable = along * along / (size * square + 1e-300)
    nu = SWIVEL * min(1.0, max(LEAST_SWIVEL, 1.0 - removable / REMOVABLE))
    return max(size, nu * s)


@jit
def _slope(settling: Any, count: int, k: int) -> float:
    """z_k'A'e."""
    along = 0.0
    for a in range(count):
        along += settling.modes[k, a] * settling.gradient[settling.free[a]]
    return along


@jit
def _is_stiff(settling: Any, count: int, s: float, square: float) -> bool:
    """Whether |S| certainly raises no mode and all joints are free; ``settling.beside`` has each stiffness.

    z'|S|z <= ||S z|| for a unit vector, and z_k'A'A z_k = mu_k - z_k'S z_k.
    """
    for k in range(count):
        z = settling.modes[k]
        bend = own = 0.0
        for a in range(count):
            i = settling.free[a]
            t = 0.0
            for b in range(count):
                t += settling.S[i, settling.free[b]] * z[b]
            bend += t * t
            own += z[a] * t
        least = _least_stiffness(settling, count, k, s, square)
        if FLOOR * (settling.values[k] - own + sqrt(bend)) > least:
            return False
        settling.beside[k] = least
    return True


@jit
def _stiffen(settling: Any, count: int, s: float, square: float) -> None:
    """The same of any arm, from D = |S|."""
    for k in range(count):
        z = settling.modes[k]
        stiff = 0.0
        for a in range(count):
            t = 0.0
            for b in range(count):
                t += (settling.gains[a, b] + settling.D[settling.free[a], settling.free[b]]) * z[b]
            stiff += z[a] * t
        settling.beside[k] = max(_least_stiffness(settling, count, k, s, square), FLOOR * stiff)


@jit
def _newton_metric(faults: Any, task: Any, settling: Any, count: int, s: float, square: float) -> None:
    """D <- P - A'A, and the kick.

        P_FF = Z diag(max(|mu_k|, FLOOR z_k'(A'A + |S|)z_k, nu_k s)) Z',  P_BB = (A'A + |S|)_BB,  P_FB = 0
        nu_k = SWIVEL min(1, max(LEAST_SWIVEL, 1 - r_k/REMOVABLE)),  r_k = (z_k'A'e)^2/(|mu_k| e'e)

    mu_k, z_k are the modes of (A'A + S)_FF. Where mu_k < -SADDLE s and |z_k'A'e| is below
    SADDLE |mu_k|, the gradient along z_k becomes that, in its own direction; not for a last millimetre, nor
    while the rows can remove most of the error themselves. It needs ``_see_singular_directions``.
    """
    D, Z = settling.D, settling.modes
    whole = count == faults.working
    if whole:
        _find_modes(task, settling, count)
    if not whole or not _is_stiff(settling, count, s, square):
        _add_modulus(faults, settling)
        _find_modes(task, settling, count)
        _stiffen(settling, count, s, square)
    stuck = square > LEAST and _lost(task, settling, s) >= LOST * square
    if stuck:
        for k in range(count):
            mu, along = settling.values[k], _slope(settling, count, k)
            size = abs(mu)
            if mu < -SADDLE * s and abs(along) < SADDLE * size:
                _kick(settling, count, k, along, SADDLE * size)
    for a in range(count):
        i = settling.free[a]
        for b in range(a + 1):
            j = settling.free[b]
            t = -settling.gains[a, b]
            for k in range(count):
                t += settling.beside[k] * Z[k, a] * Z[k, b]
            D[i, j] = D[j, i] = t
    for a in range(count):
        i = settling.free[a]
        for b in range(count, faults.working):
            j = settling.free[b]
            D[i, j] = D[j, i] = -_gain_of(task, settling, i, j)


@jit
def _kick(settling: Any, count: int, mode: int, along: float, size: float) -> None:
    """Add to the kick what makes the gradient along a mode as large as ``size``."""
    z = settling.modes[mode]
    sign = 1.0 if along > 0.0 else -1.0
    if along == 0.0:
        largest = 0.0
        for a in range(count):
            if abs(z[a]) > abs(largest) + 1e-9:
                largest = z[a]
        sign = 1.0 if largest > 0.0 else -1.0
    for a in range(count):
        settling.kick[settling.free[a]] += (sign * size - along) * z[a]


@jit
def _fade(chain: Any, faults: Any, task: Any, settling: Any, count: int, s: float) -> None:
    """D <- psi T D T and kick <- psi T kick: the metric is there only where it is needed.

        T = 1 - sum_k (1 - sqrt(phi_k)) v_k v_k',  phi_k = max(0, 1 - sigma_k^2/s),
        psi = max(0, 1 - sigma_min^2/s)

    sigma_k and v_k are those of A over the free joints.
    """
    m, w, D, U = task.m, faults.working, settling.D, settling.U
    least = settling.squares[0]
    for k in range(m):
        square = max(settling.squares[k], 0.0)
        least = min(least, square)
        phi = max(0.0, 1.0 - square / s)
        t = 1.0 - sqrt(phi)
        if t <= 0.0 or square <= 0.0:
            continue
        v, inverse = settling.direction, 1.0 / sqrt(square)
        for a in range(w):
            v[faults.order[a]] = 0.0
        for a in range(count):
            i = settling.free[a]
            x = plus_products(0.0, U[k], settling.A[:, i], m)
            v[i] = x * inverse
        _project(chain, faults, settling, t)
    psi = max(0.0, 1.0 - max(least, 0.0) / s)
    settling.psi = psi
    for a in range(w):
        i = faults.order[a]
        settling.kick[i] *= psi
        for b in range(w):
            D[i, faults.order[b]] *= psi


@jit
def _project(chain: Any, faults: Any, settling: Any, t: float) -> None:
    """D <- (1 - t v v') D (1 - t v v') and kick <- (1 - t v v') kick with the unit vector ``direction``."""
    w, D, v, y = faults.working, settling.D, settling.direction, settling.beside
    twice = kicked = 0.0
    for a in range(w):
        i = faults.order[a]
        x = 0.0
        for b in range(w):
            j = faults.order[b]
            x += D[i, j] * v[j]
        y[i] = x
        twice += v[i] * x
        kicked += v[i] * settling.kick[i]
    for a in range(w):
        i = faults.order[a]
        settling.kick[i] -= t * kicked * v[i]
        x = mul_add(-t * twice, v[i], y[i])
        for at in range(0, chain.n, WIDTH):
            works, before = lane_mask(chain.n, at) & ~is_set(faults.code, at), load_lanes(D[i], at)
            change = mul_add(x, load_lanes(v, at), v[i] * load_lanes(y, at))
            store_lanes(D[i], at, select(works, mul_add(-t, change, before), before))


@jit
def _is_as_before(K: Any, s: float, count: int) -> bool:
    """Whether all that the metric follows from is what it was when it was found, which is kept."""
    settling, n, m = K.settling, K.chain.n, K.task.m
    same = (
        settling.kept == 1 and settling.kept_s == s and settling.kept_m == m and settling.kept_count == count
    )
    for i in range(n):
        same = same and settling.kept_q[i] == K.state.q[i] and settling.kept_free[i] == settling.free[i]
        settling.kept_q[i], settling.kept_free[i] = K.state.q[i], settling.free[i]
    for k in range(m):
        same = same and settling.kept_e[k] == settling.e[k]
        settling.kept_e[k] = settling.e[k]
        for i in range(n):
            same = same and settling.kept_A[k, i] == settling.A[k, i]
            settling.kept_A[k, i] = settling.A[k, i]
    settling.kept, settling.kept_s, settling.kept_m, settling.kept_count = 1, s, m, count
    return same


@jit
def find_metric(K: Any, s: float, square: float) -> int:
    """D and the kick for a curvature of norm s and an error of ``square`` e'e: how many joints are free.

    -1 when D = 0, because no eigenvalue of S is larger than sigma_min^2 over the free joints: first by s. An
    arm at rest has that of the tick before. Source: docs/theory/settling.md, "The metric".
    """
    count = free_joints(K)
    if not _is_as_before(K, s, count):
        K.settling.found = _find_metric(K, s, square, count)
    return int(K.settling.found)


@jit
def _find_metric(K: Any, s: float, square: float, count: int) -> int:
    """The same of an arm that was elsewhere, with so many free joints."""
    gram_of_rows(K.task, K.settling, count)
    if count >= K.task.m:
        if exceeds(K.task, K.settling, s):
            return -1
        if exceeds(K.task, K.settling, spread(K.chain, K.settling)):
            return -1
    for i in range(K.chain.n):
        K.settling.kick[i] = 0.0
        K.settling.D[i, : K.chain.n] = 0.0
    K.settling.psi = 1.0
    if count == 0:
        _add_modulus(K.faults, K.settling)
    else:
        _see_singular_directions(K.task, K.settling)
        _newton_metric(K.faults, K.task, K.settling, count, s, square)
        _fade(K.chain, K.faults, K.task, K.settling, count, s)
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
def _seek_null_space(task: Any, settling: Any, count: int) -> int:
    """Rows 0..k-1 of ``settling.modes``: the self-motions of the free joints; k."""
    A, W, Z = settling.A, settling.work, settling.modes
    edge = (SINGULAR * task.length) ** 2
    for a in range(count):
        for b in range(a + 1):
            W[a, b] = W[b, a] = _gain_of(task, settling, settling.free[a], settling.free[b])
    eigensystem(W, count, settling.values, settling.beside, Z)
    null = 0
    for j in range(count):
        if settling.values[j] > edge:
            along = 0.0
            for k in range(task.m):
                settling.b[k] = 0.0
                for a in range(count):
                    settling.b[k] += A[k, settling.free[a]] * Z[j, a]
                along += settling.b[k] * settling.e[k]
            for k in range(task.m):
                settling.e[k] -= along * settling.b[k] / settling.values[j]
        else:
            for a in range(count):
                z = Z[j, a]
                Z[j, a] = Z[null, a]
                Z[null, a] = z
            null += 1
    return null


@jit
def _take_for_error(task: Any, kinematics: Any, settling: Any, scale: float) -> None:
    """The error along W whose weighted rows are ``scale`` times ``settling.e``."""
    task.error[:6] = 0.0
    for k in range(task.m):
        c = task.rows[k]
        x = scale * settling.e[k] * sqrt(task.yielding[c]) / task.row_scale[c]
        if c < 3 or not task.tool_rows:
            task.error[c] = x
            continue
        add_to(task.error, 3, times(x, tool_axis(task, kinematics, c - 3)))


@jit
def _lowest(
    faults: Any, task: Any, kinematics: Any, chain: Any, settling: Any, path: Any, count: int, null: int
) -> float:
    """The least curvature along a self-motion over ||S||, and that motion as ``path.way``."""
    S, N, W, Z = settling.S, settling.modes, settling.gains, settling.work
    s = curvature(faults, task, kinematics, chain, settling)
    if not s > 0.0:
        return 0.0
    for k in range(null):
        for a in range(count):
            x = 0.0
            for b in range(count):
                x += S[settling.free[a], settling.free[b]] * N[k, b]
            settling.beside[a] = x
        for j in range(k + 1):
            W[k, j] = W[j, k] = plus_products(0.0, N[j], settling.beside, count)
    eigensystem(W, null, settling.values, settling.beside, Z)
    at, least = 0, inf
    for k in range(null):
        if settling.values[k] < least:
            at, least = k, settling.values[k]
    settling.direction[: chain.n] = 0.0
    for a in range(count):
        settling.direction[settling.free[a]] = plus_products(0.0, Z[at], N[:, a], null)
    return least / s


@jit
def _draw(state: Any, task: Any, chain: Any, settling: Any, path: Any) -> None:
    """Draw the joints along the way that was found, to the side to which they are drawn or move already."""
    kept = moving = largest = 0.0
    for i in range(chain.n):
        x = settling.direction[i]
        kept += x * path.drive[i]
        moving += x * state.v[i]
        largest = max(largest, abs(x))
    side = kept if path.found else moving
    size = (path.speed if side >= 0.0 else -path.speed) / max(largest, 1e-300)
    for i in range(chain.n):
        path.drive[i] = size * unit_of(task, chain, i) * settling.direction[i]
    path.found = path.driven = 1


@jit
def _see_saddle(K: Any, path: Any) -> bool:
    """Whether the tangent of the path, which stands in ``task.error``, is lost but for a self-motion."""
    task, settling = K.task, K.settling
    size = sqrt(weigh_rows(task, K.kinematics, K.chain, K.qp, settling))
    if not size > 0.0:
        return False
    count = free_joints(K)
    null = _seek_null_space(task, settling, count)
    lost = plus_products(0.0, settling.e, settling.e, task.m)
    lost = sqrt(lost)
    if null == 0 or not lost > NOTICEABLE * size:
        return False
    _take_for_error(task, K.kinematics, settling, AHEAD * task.length / lost)
    return _lowest(K.faults, task, K.kinematics, K.chain, settling, path, count, null) < -WAY_ON


@part_jit
def outlook(K: Any, path: Any) -> None:
    """Where it is asked for and there is one, draw the joints along the way on: ``path.found``.

    p is the part of the path's tangent along singular directions of the free joints, N their self-motions,
    singular ones included. A self-motion z moves the tip by -z'S(p)z/2 along p, to second order: where the
    least eigenvalue of N'S(p)N is clearly below zero, that is a way on, else there is none so near. It needs
    ``task_rows``.
    Source: docs/theory/path-progress.md, "Stalls".
    """
    if path.speed == 0.0 or not K.settling.on:
        path.found = 0
        return
    task = K.task
    for c in range(6):
        path.kept[c] = task.error[c]
        task.error[c] = task.target[TARGET_TWIST + c]
    if _see_saddle(K, path):
        _draw(K.state, task, K.chain, K.settling, path)
    else:
        path.found = 0
    assign(task.error, path.kept, 6)
