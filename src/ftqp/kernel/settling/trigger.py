"""Whether the error left can matter beside the singular values: what a regular tick pays for settling."""

from math import inf
from typing import Any

from ftqp.kernel.arm.kinematics import columns, spread_by
from ftqp.kernel.jit import jit, rare_jit
from ftqp.kernel.maths.elementary import select, smaller, sqrt
from ftqp.kernel.maths.linear_systems import assign, factor
from ftqp.kernel.maths.side_by_side import WIDTH, all_of, is_set, lane_mask, load_lanes, numbers, sum_of
from ftqp.kernel.maths.symmetric_eigen import extreme_eigenvalues
from ftqp.kernel.maths.vectors import column, cross, length, three, three_from
from ftqp.kernel.settling.curvature import weigh_rows, weighted_error

NEAR = 0.01
"""A joint so near to its position limit [rad; times the characteristic length m] may be pressed on it."""
STEP = 0.05
"""How far each joint may go [rad; times the characteristic length m] before the smallest singular value is
looked at anew, ..."""
WORN = 0.9
"""... only where the bound has fallen below this share of what was seen. Both cost time only, because the
bound holds whatever they are (docs/theory/settling.md, "What a regular tick pays")."""


@jit
def unit_of(task: Any, chain: Any, i: int) -> float:
    """What counts as one radian: the characteristic length of a joint that slides."""
    length: float = task.length
    return length if chain.prismatic[i] else 1.0


@jit
def room_to_limit(state: Any, limits: Any, task: Any, chain: Any, i: int) -> Any:
    """Distance to the nearer position limit [rad; sliding joints in characteristic lengths]."""
    q = state.q[i]
    return smaller(limits.q_max[i] - q, q - limits.q_min[i]) / unit_of(task, chain, i)


@jit
def gram_of_rows(task: Any, settling: Any, count: int) -> None:
    """G <- A A' of the weighted rows over the columns ``settling.free[:count]``, its lower part."""
    A, G = settling.A, settling.G
    for a in range(task.m):
        for b in range(a + 1):
            s = 0.0
            for c in range(count):
                i = settling.free[c]
                s += A[a, i] * A[b, i]
            G[a, b] = s


@jit
def exceeds(task: Any, settling: Any, s: float) -> bool:
    """Whether sigma_min^2 >= s, exactly when G - s 1 has a Cholesky factor, with G of ``gram_of_rows``."""
    G, left = settling.G, settling.gains
    for a in range(task.m):
        assign(left[a], G[a], a)
        left[a, a] = G[a, a] - s
    return factor(left, task.m)


@jit
def largest_curvature(task: Any, kinematics: Any, chain: Any) -> Any:
    """No less than ||S||_F, at no cross product of two joints; it needs the Jacobian.

    |S_ij| <= |p_j| |e_p| + L^2/2 |e_r| for i <= j, p_j the linear column of joint j, so that
    ||S|| <= sqrt 2 (|e_p| sqrt(sum_j j |p_j|^2) + L^2/2 |e_r| sqrt(n (n + 1)/2)), and how the rotation's own
    measure bends: n L^2 |e_r|^2/8 at most, of the tool axis n L^2 |e_r| (1 + |e_r|).
    """
    J, n = columns(kinematics, chain), chain.n
    ways = 0.0
    for at in range(0, n, WIDTH):
        x, y, z = load_lanes(J[0], at), load_lanes(J[1], at), load_lanes(J[2], at)
        ways = ways + (1.0 + numbers(at)) * (x * x + y * y + z * z)
    linear = task.position_error / task.yielding[0] * sqrt(2.0 * sum_of(ways))
    weight, angle = task.length * task.length / task.yielding[3], task.rotation_error
    own = angle * (1.0 + angle) if task.tool_rows else 0.125 * angle * angle
    bend: float = linear + weight * (0.5 * angle * sqrt(1.0 * n * (n + 1)) + n * own)
    return bend * spread_by(chain) if chain.mimics else bend


@jit
def curvature_bound(task: Any, kinematics: Any, chain: Any, settling: Any) -> float:
    """No less than ||S||_F and hardly more, in a number of operations that grows with n; needs the Jacobian.

    With c_j = p_j x v_p and g_j = c_j + z_j x v_r/2, v the error weighted twice, S_jj = -z_j . c_j, and
    S_ij = -z_i . g_j for i < j, so that the squares of column j sum up to g_j'(sum_(i<j) z_i z_i')g_j. How
    the rotation's own measure bends is bounded as in ``largest_curvature``.
    """
    J, v, n = columns(kinematics, chain), settling.weighted, chain.n
    weighted_error(task, settling)
    Z0 = Z1 = Z2 = Z3 = Z4 = Z5 = 0.0  # xx xy xz yy yz zz
    beside = diagonal = 0.0
    for j in range(n):
        x, y, z = column(J, 3, j)
        c0, c1, c2 = cross(column(J, 0, j), three(v))
        r0, r1, r2 = cross((x, y, z), three_from(v, 3))
        along = x * c0 + y * c1 + z * c2
        diagonal += along * along
        c0, c1, c2 = c0 + 0.5 * r0, c1 + 0.5 * r1, c2 + 0.5 * r2
        beside += c0 * (Z0 * c0 + 2.0 * (Z1 * c1 + Z2 * c2)) + c1 * (Z3 * c1 + 2.0 * Z4 * c2) + Z5 * c2 * c2
        Z0, Z1, Z2 = Z0 + x * x, Z1 + x * y, Z2 + x * z
        Z3, Z4, Z5 = Z3 + y * y, Z4 + y * z, Z5 + z * z
    angle = length(three_from(task.error, 3))
    own = angle * (1.0 + angle) if task.tool_rows else 0.125 * angle * angle
    weight: float = task.length * task.length / task.yielding[3]
    bend: float = sqrt(diagonal + 2.0 * max(beside, 0.0)) + weight * n * own
    return bend * spread_by(chain) if chain.mimics else bend


@jit
def _moved(state: Any, faults: Any, task: Any, chain: Any, settling: Any) -> float:
    """How far the joints have moved in sum since sigma_min was looked at; inf when that is too long ago."""
    if settling.seen_working != faults.working:
        return inf
    moved = 0.0
    for at in range(0, chain.n, WIDTH):
        unit = select(is_set(chain.prismatic, at), task.length, 1.0)
        step = abs(load_lanes(state.q, at) - load_lanes(settling.q_seen, at)) / unit
        step = select(lane_mask(chain.n, at) & ~is_set(faults.code, at), step, 0.0)
        if not all_of(step < STEP):
            return inf
        moved += sum_of(step)
    return moved


@rare_jit
def measure_arm(K: Any) -> None:
    """The largest distance from a joint to the tip, and how fast the rows change with the joints."""
    chain, limits, task, settling = K.chain, K.limits, K.task, K.settling
    reach = length(three(chain.tip_translation))
    least = 0.0
    for i in range(chain.n):
        reach += length(three(chain.translation[i]))
        if chain.prismatic[i]:
            reach += max(abs(limits.q_min[i]), abs(limits.q_max[i]))
            least = 1.0  # the column of a joint that slides
    settling.reach = max(reach, least)
    weight = min(task.yielding[0], task.yielding[3])
    settling.lipschitz = sqrt(
        chain.n * (settling.reach * settling.reach + task.length * task.length) / weight
    )


@rare_jit
def _look(K: Any) -> float:
    """sigma_min over the joints that stay away from their limits while none moves by more than STEP."""
    faults, state, settling = K.faults, K.state, K.settling
    measure_arm(K)
    count = 0
    for k in range(faults.working):
        i = faults.order[k]
        settling.q_seen[i] = state.q[i]
        if room_to_limit(state, K.limits, K.task, K.chain, i) > NEAR + STEP:
            settling.free[count] = i
            count += 1
    settling.seen_working = faults.working
    settling.sigma_seen = 0.0
    if count >= K.task.m:
        weigh_rows(K.task, K.kinematics, K.chain, K.qp, settling)
        gram_of_rows(K.task, settling, count)
        least, _ = extreme_eigenvalues(settling.G, K.task.m, settling.values, settling.beside)
        settling.sigma_seen = sqrt(max(least, 0.0))
    return settling.sigma_seen


@jit
def is_regular(K: Any) -> bool:
    """Whether the error is surely too small for its curvature to matter: then D = 0.

    It is where ``largest_curvature`` or ``curvature_bound`` < sigma_min^2. sigma_min is computed only now and
    then; between, it is known to have changed by no more than sqrt(reach^2 + L^2) times what the joints have
    moved.
    """
    moved, seen = _moved(K.state, K.faults, K.task, K.chain, K.settling), K.settling.sigma_seen
    least = most = inf
    if moved < inf:
        change = K.settling.lipschitz * moved
        least, most = seen - change, seen + change
        if least > 0.0 and largest_curvature(K.task, K.kinematics, K.chain) < least * least:
            return True
    bend = curvature_bound(K.task, K.kinematics, K.chain, K.settling)
    if moved < inf:
        if least > 0.0 and bend < least * least:
            return True
        if least > WORN * seen or most * most <= bend:
            return False
    least = _look(K)
    return bend < least * least
