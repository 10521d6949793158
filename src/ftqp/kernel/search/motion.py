"""From places to a motion: corners rounded where that is free, then as fast as can be, with bounded jerk.

The rounded way is q(s) = c0 + c1 s + c2 s^2 piece by piece, with a continuous tangent. With x = s'^2 and
u = s'' limits are linear, |q' u + q'' x| <= a_max and |q'| sqrt(x) <= v_max; in a piece q'' is constant and
q' linear, so that limits kept at both ends of an interval are kept within it. One pass back finds the largest
x from which the rest can be gone, one pass on takes the largest u; their linear programmes of two unknowns
are solved by elimination. The mean over 2 T then bounds the jerk by a_max/T, keeps v_max and a_max, and
leaves the way by a_max T^2/6 at most: so the result is proven again.
Source: Pham and Pham 2018.
"""

from math import ceil, inf, sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import fold_row, jacobian
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.ways_room import (
    FOLLOWING,
    GROWING,
    INTERVALS,
    NO_WAY,
    PACING,
    PIECES,
    PROOF,
    PROVING,
    READY,
    ROUNDING,
    SAMPLING,
    SHORTENING,
    TABLE,
)
from ftqp.kernel.maths.elementary import matrix_view
from ftqp.kernel.scene.clearance import (
    LEAST_BRAKE,
    add_gradient,
    approach_speed,
    distance_of_capsules,
    refined_distance,
)
from ftqp.kernel.scene.hulls import refines
from ftqp.kernel.search.known_arm import know_surroundings
from ftqp.kernel.search.looks import (
    goes_of_pair,
    know_moved,
    obstruction,
    passes,
    place_bodies,
    pose_arm,
    proven,
)
from ftqp.kernel.search.poses import is_in_tube
from ftqp.kernel.search.trees import add_node, follow_line, gap, grow, shorten

ROUND = 0.35
"""Corners are cut from so far away at most [rad or m]. A guess."""
SHARP = 1e-4
"""Corners that can be cut from no farther away than this [rad] stay as they are: the arm rests there."""
FINE, MANY = 0.04, 16
"""Longest interval of time scaling [rad or m], and the fewest of a way. Guesses."""
CLOSER, SHORTEST = 0.5, 0.004
"""An interval ends where bodies may have used up this share of what they may come nearer, but is no shorter
than the second [rad or m]. Guesses."""
FAR, BY_HULLS = 0.8, 0.1
"""Pairs whose capsules are farther apart than the first [m] do not slow the motion down: a row holds the hand
of a Panda at 2.2 m/s from 0.6 m on. Nearer than the second it is known by hulls how far they are. Guesses."""
STRETCH = 1.5
"""The last interval of a piece may be so many times as long as the others. A convention."""
APPROACH, CREEP = 0.8, 0.01
"""Bodies come near with this share of what a planner's rows allow, or with the second [m/s], if that is
more. Guesses (``python benchmarks/ft_mbm.py``)."""
SPEED, ACCELERATION = 0.999, 0.99
"""Shares of v_max and a_max that the motion uses: what is left corrects errors at full speed."""
CHORD = 1e-4
"""A straight line stands for a piece of the motion that is no farther from it than this [rad or m], ..."""
LONGEST = 32
"""... of so many ticks at most. Conventions."""
NONE = 1e-12
"""Coefficients below this are none. Rounding."""


@jit
def _leg(Q: Any, i: int, n: int, j: int) -> float:
    """Component j of the direction from place i to the next."""
    size = gap(Q[i], Q[i + 1], n)
    return (Q[i + 1, j] - Q[i, j]) / size if size > 0.0 else 0.0


@jit
def _give_up(W: Any) -> None:
    """There is no motion along the way: of a straight one of the tip, look for another."""
    W.stage, W.straight, W.places = GROWING if W.straight else NO_WAY, 0, 0


@part_jit
def round_corner(K: Any) -> None:
    """The leg to the next place, and its corner cut as far as that is free."""
    W, n, Q, i, k = K.ways, K.chain.n, K.ways.place, K.ways.corner, K.ways.pieces
    if i >= W.places - 1 or k + 2 >= PIECES:
        if i < W.places - 1 or k == 0:
            _give_up(W)
            return
        W.stage, W.paced, W.grid, W.cut, W.held = PACING, 0, 0, 0.0, inf
        W.at_least[: W.pairs] = -inf
        total = 0.0
        for p in range(k):
            total += W.size_of[p]
        W.fine = max(min(FINE, total / MANY), total / (0.5 * INTERVALS))
        return
    leg, last = gap(Q[i], Q[i + 1], n), i + 2 >= W.places
    after = 0.0 if last else gap(Q[i + 1], Q[i + 2], n)
    d = min(0.5 * leg, 0.5 * after, ROUND)
    for j in range(n):
        way = _leg(Q, i, n, j)
        W.c[k, 0, j], W.c[k, 1, j], W.c[k, 2, j] = Q[i, j] + W.before * way, way, 0.0
    while d > SHARP:  # the parabola from d before the corner to d behind it
        for j in range(n):
            a, b = _leg(Q, i, n, j), _leg(Q, i + 1, n, j)
            W.c[k + 1, 0, j], W.c[k + 1, 1, j], W.c[k + 1, 2, j] = Q[i + 1, j] - d * a, a, (b - a) / (4.0 * d)
        stays = W.tube == 0 or is_in_tube(K, W.c[k + 1], 2.0 * d, 2.0 * d)
        if stays and proven(K, W.c[k + 1], 2.0 * d) >= 2.0 * d:
            break
        d *= 0.5
    d = d if d > SHARP else 0.0
    W.size_of[k], W.size_of[k + 1], W.before = max(leg - W.before - d, 0.0), 2.0 * d, d
    W.pieces, W.corner = k + (2 if d > 0.0 else 1), i + 1


@jit
def _limits(K: Any, i: int) -> tuple[int, float]:
    """The limits in interval i as alpha u + beta x <= gamma: how many, and the largest x by v_max alone."""
    W, p, k, top = K.ways, K.ways.piece[i], 0, inf
    for end in range(2):
        s = W.s[i] + (W.ds[i] if end else 0.0)
        for j in range(K.chain.n):
            if not W.free[j]:
                continue
            d1, d2, a = W.c[p, 1, j] + 2.0 * s * W.c[p, 2, j], 2.0 * W.c[p, 2, j], ACCELERATION * W.a_max[j]
            u = d1 + (d2 * 2.0 * W.ds[i] if end else 0.0)
            W.alpha[k], W.beta[k], W.gamma[k] = u, d2, a
            W.alpha[k + 1], W.beta[k + 1], W.gamma[k + 1] = -u, -d2, a
            k += 2
            if end == 0 and abs(d1) > NONE:
                v = W.speed * SPEED * W.v_max[j] / d1
                top = min(top, v * v)
    for part in range(2 if W.straight else 0):
        a, first, last = W.tip_acceleration[part], W.tip_rate[i, part], W.tip_rate[i + 1, part]
        bend = (last - first) / W.ds[i]
        for end in range(2):
            u = last + 2.0 * bend * W.ds[i] if end else first
            W.alpha[k], W.beta[k], W.gamma[k] = u, bend, a
            W.alpha[k + 1], W.beta[k + 1], W.gamma[k + 1] = -u, -bend, a
            k += 2
    return k, min(top, W.top[i])


@jit
def _largest(W: Any, k: int, top: float) -> float:
    """The largest x for which some u keeps k limits."""
    for r in range(k):
        if W.alpha[r] > NONE:
            for w in range(k):
                if W.alpha[w] < -NONE:  # (gamma_w - beta_w x)/alpha_w <= u <= (gamma_r - beta_r x)/alpha_r
                    slope = W.beta[r] / W.alpha[r] - W.beta[w] / W.alpha[w]
                    if slope > 1e-15:
                        top = min(top, (W.gamma[r] / W.alpha[r] - W.gamma[w] / W.alpha[w]) / slope)
        elif W.alpha[r] >= -NONE and W.beta[r] > NONE:
            top = min(top, W.gamma[r] / W.beta[r])
    return max(top, 0.0)


@part_jit
def scale_time(K: Any) -> float:
    """Times of the way from rest to rest: the duration [s]; infinite where there is none."""
    W = K.ways
    x, g = W.x, W.grid
    x[g] = 0.0
    for i in range(g - 1, -1, -1):
        k, top = _limits(K, i)
        W.alpha[k], W.beta[k], W.gamma[k] = 2.0 * W.ds[i], 1.0, x[i + 1]
        W.alpha[k + 1], W.beta[k + 1], W.gamma[k + 1] = -2.0 * W.ds[i], -1.0, 0.0
        x[i] = 0.0 if W.rests[i] > 0 else _largest(W, k + 2, top)
    x[0] = W.time[0] = 0.0
    for i in range(g):
        k, _ = _limits(K, i)
        u = (x[i + 1] - x[i]) / (2.0 * W.ds[i])
        for r in range(k):
            if W.alpha[r] > NONE:
                u = min(u, (W.gamma[r] - W.beta[r] * x[i]) / W.alpha[r])
        x[i + 1] = max(x[i] + 2.0 * W.ds[i] * u, 0.0)
        pace = sqrt(x[i]) + sqrt(x[i + 1])
        if pace <= 0.0:
            return inf
        W.u[i], W.time[i + 1] = (x[i + 1] - x[i]) / (2.0 * W.ds[i]), W.time[i] + 2.0 * W.ds[i] / pace
    return float(W.time[g])


@jit
def _begin_sampling(K: Any) -> None:
    """How many ticks the motion takes; none where it cannot be timed."""
    W, T = K.ways, scale_time(K)
    if inf == T:
        _give_up(W)
        return
    W.period = W.dt
    while True:
        W.window = max(1, int(2.0 * W.rise / W.period + 0.5))
        W.ticks = ceil(T / W.period) + W.window + 1
        if W.ticks * K.chain.n <= TABLE:
            break
        W.period *= 2.0


@jit
def _proof(K: Any) -> float:
    """The share of what is kept with which the motion is proven: no nearer than where the arm is stopped."""
    scene = K.scene
    return max(PROOF, scene.halt / scene.keep) if K.ways.pairs > 0 else PROOF


@jit
def _does_not_matter(K: Any, i: int, x: float, r: float) -> bool:
    """Whether bodies with x left at least neither slow interval i down nor end it.

    For the row G of a pair sum |G_j q'_j| <= r. Then sum |G_j| a_j is at least r times the least a_j/|q'_j|
    where the sum is r, and where it is less, a larger pace is allowed.
    """
    W = K.ways
    if r <= NONE:
        return True
    if x <= 0.0 or max(CLOSER * x / r, SHORTEST) < W.ds[i]:
        return False
    by = max(K.scene.share * W.firm * r, LEAST_BRAKE)
    v = max(APPROACH * approach_speed(K.scene, x, by, W.dt), CREEP) / r
    return bool(v * v > min(W.top[i], W.held))


@jit
def _slow_down(K: Any, k: int, i: int, ahead: float) -> None:
    """Let pair k of bodies come near no faster in interval i than the rows of a planner let them.

    Nor as fast as they would if any one of the joints stopped dead there. The interval ends before they have
    come much nearer. How far apart they are is looked at where it matters.
    """
    W, scene, chain = K.ways, K.scene, K.chain
    p, n, near, far, least = W.pair[k], W.normal, W.one, W.other, _proof(K) * scene.keep
    most = goes_of_pair(K, k) / ahead
    if _does_not_matter(K, i, W.at_least[k] - least, most):
        return
    d = W.at_least[k] = distance_of_capsules(K, p, n, near, far)
    if d > FAR or _does_not_matter(K, i, d - least, most):
        return
    if d < BY_HULLS and refines(scene, scene.first[p], scene.second[p]):
        W.looks += 1
        d = refined_distance(K, p, d, n, near, far)
        W.at_least[k] = max(W.at_least[k], min(d, BY_HULLS))
    add_gradient(K, p, n, near, far, W.row)
    if chain.mimics:
        fold_row(chain, W.row)
    c, rate, most, brake, x = W.c[W.piece[i]], 0.0, 0.0, 0.0, d - least
    for j in range(chain.n):
        W.drawn[j] = W.row[j] * (c[1, j] + 2.0 * W.s[i] * c[2, j]) if W.free[j] else 0.0
        rate += W.drawn[j]
        most += abs(W.drawn[j])
        brake += abs(W.row[j]) * W.a_max[j] if W.free[j] else 0.0
    if _does_not_matter(K, i, x, most):
        return
    W.ds[i] = min(W.ds[i], max(CLOSER * x / most, SHORTEST))
    for j in range(-1, chain.n):  # with all joints, and without each
        is_left = j < 0 or not W.free[j]
        left = rate - (0.0 if is_left else W.drawn[j])
        if left < 0.0:
            by = max(scene.share * (brake - (0.0 if is_left else abs(W.row[j]) * W.a_max[j])), LEAST_BRAKE)
            v = max(APPROACH * approach_speed(scene, x, by, W.dt), CREEP) / -left
            if v * v < W.top[i]:
                W.top[i], W.met = v * v, k + 1


@jit
def _slow_bodies_down(K: Any, i: int) -> float:
    """Let no pair come near too fast in interval i; how far ahead ``know_moved`` has looked [rad or m]."""
    W, c, ahead, first = K.ways, K.ways.c[K.ways.piece[i]], STRETCH * K.ways.ds[i], K.ways.met - 1
    W.firm = inf
    for j in range(K.chain.n):
        v, w = abs(c[1, j] + 2.0 * W.s[i] * c[2, j]), abs(c[1, j] + 2.0 * (W.s[i] + ahead) * c[2, j])
        W.way[j] = ahead * max(v, w) if W.free[j] else 0.0
        W.firm = min(W.firm, W.a_max[j] / v) if W.free[j] and v > 0.0 else W.firm
    place_bodies(K)
    know_moved(K)
    if first >= 0:  # the one that slowed the last interval down leaves least to the others
        _slow_down(K, first, i, ahead)
    for k in range(W.pairs):
        if k != first:
            _slow_down(K, k, i, ahead)
    _stay_slow(W, i)
    return ahead


@jit
def _stay_slow(W: Any, i: int) -> None:
    """Let the motion stay as slow as in interval i for half of what its mean is over.

    The mean begins what comes next so much sooner, and bodies would come near as fast as they part then.
    """
    if W.top[i] <= W.held:
        W.held, W.holds = W.top[i], W.rise
    W.top[i] = W.held
    W.holds -= W.ds[i] / sqrt(W.held)
    if W.holds <= 0.0:
        W.held = inf


@jit
def _slow_tip(K: Any, i: int) -> None:
    """How fast the tip goes on its straight way in interval i, and its limit of speed there."""
    W, J, c = K.ways, K.ahead.J, K.ways.c[K.ways.piece[i]]
    jacobian(K.ahead, K.chain)
    for part in range(2):
        size = 0.0
        for r in range(3 * part, 3 * part + 3):
            w = 0.0
            for j in range(K.chain.n):
                w += J[r, j] * (c[1, j] + 2.0 * W.s[i] * c[2, j]) if W.free[j] else 0.0
            size += w * w
        W.tip_rate[i, part] = W.tip_rate[i + 1, part] = sqrt(size)
        v = W.speed * W.tip_speed[part] / max(sqrt(size), NONE)
        W.top[i] = min(W.top[i], v * v)


@jit
def _next_interval(K: Any) -> bool:
    """Begin the next interval where the last one ends; the arm rests at a corner between two pieces."""
    W, i = K.ways, K.ways.grid
    while W.paced < W.pieces and W.size_of[W.paced] - W.cut <= NONE:
        W.paced, W.cut = W.paced + 1, 0.0
    p = W.paced
    if p >= W.pieces or i >= INTERVALS:
        return False
    size = W.size_of[p]
    W.piece[i], W.s[i], W.rests[i], W.top[i], W.ds[i] = p, W.cut, 0, inf, W.fine
    is_straight = True
    for j in range(K.chain.n):
        is_straight = is_straight and W.c[p, 2, j] == 0.0
    if is_straight:
        W.ds[i] = min(W.fine, 0.25 * size)
    if W.cut == 0.0 and i > 0:
        b = W.piece[i - 1]
        for j in range(K.chain.n):
            turn = W.c[p, 1, j] - W.c[b, 1, j] - 2.0 * W.size_of[b] * W.c[b, 2, j]
            W.rests[i] += 1 if abs(turn) > 1e-6 else 0
    return True


@part_jit
def pace_next(K: Any) -> None:
    """The next interval, and how fast bodies, and the tip on a straight way, may be in it."""
    W, i, n = K.ways, K.ways.grid, K.chain.n
    if not _next_interval(K):
        if W.paced < W.pieces or i == 0:
            _give_up(W)
            return
        W.stage = SAMPLING
        _begin_sampling(K)
        return
    c, s, ahead = W.c[W.piece[i]], W.s[i], 1.0
    for j in range(n):
        W.q[j] = c[0, j] + s * (c[1, j] + s * c[2, j])
    if W.pairs > 0 or W.straight:
        W.looks += 1
        pose_arm(K, W.q)
    if W.straight:
        _slow_tip(K, i)
    if W.pairs > 0:
        ahead = _slow_bodies_down(K, i)
    left = W.size_of[W.paced] - W.cut
    W.ds[i] = left if left < STRETCH * W.ds[i] else W.ds[i]
    for k in range(W.pairs):
        W.at_least[k] -= W.ds[i] / ahead * goes_of_pair(K, k)
    W.cut, W.grid = W.cut + W.ds[i], i + 1


@jit
def places_of(K: Any) -> Any:
    """The places of the motion, (ticks, n)."""
    return matrix_view(K.ways.table, 0, K.ways.ticks, K.chain.n)


@part_jit
def sample(K: Any) -> None:
    """Places after every period, the mean over ``window`` of them of what the times say."""
    W, n, i, table = K.ways, K.chain.n, 0, places_of(K)
    T, w = W.time[W.grid], W.window
    count = W.ticks - w + 1
    for k in range(count):
        t = min(k * W.period, T)
        while i + 1 < W.grid and W.time[i + 1] < t:
            i += 1
        h, p = t - W.time[i], W.piece[i]
        s = W.s[i] + min(sqrt(W.x[i]) * h + 0.5 * W.u[i] * h * h, W.ds[i])
        for j in range(n):
            table[k, j] = W.c[p, 0, j] + s * (W.c[p, 1, j] + s * W.c[p, 2, j])
    for j in range(n):
        first, last = table[0, j], table[count - 1, j]
        total = w * last
        for k in range(W.ticks - 1, 0, -1):
            here = table[k, j] if k < count else last
            table[k, j] = total / w
            total += (table[k - w, j] if k > w else first) - here
        table[W.ticks - 1, j] = last


@jit
def _is_straight(K: Any, table: Any, i: int, j: int) -> bool:
    """Whether the motion between two ticks is as good as straight."""
    for k in range(i + 1, j):
        for c in range(K.chain.n):
            if abs(table[k, c] - table[i, c] - (table[j, c] - table[i, c]) * (k - i) / (j - i)) > CHORD:
                return False
    return True


@jit
def _prove_next(K: Any) -> None:
    """Prove the next piece of the motion; the mean is halved where it is not free."""
    W, table = K.ways, places_of(K)
    i, more = W.checked, W.chunk
    if i >= W.ticks - 1:
        W.stage, W.is_free, W.share = READY, 1, 1.0
        return
    while more > 1 and (i + more >= W.ticks or not _is_straight(K, table, i, i + more)):
        more //= 2
    W.share = W.again_with if W.again else _proof(K)
    if gap(table[i], table[i + more], K.chain.n) == 0.0 or passes(K, table[i], table[i + more]) >= 1.0:
        W.checked, W.chunk = i + more, min(2 * more, LONGEST)
    elif W.capped and more > 1:
        W.chunk = more // 2
    elif W.window == 1 and W.straight and not W.again:
        _give_up(W)
    elif W.window == 1 or W.again:
        W.stage, W.is_free, W.share = READY, 0, 1.0
    else:
        W.window //= 2
        W.ticks = ceil(W.time[W.grid] / W.period) + W.window + 1
        W.stage = SAMPLING
    W.share = 1.0


@jit
def search_step(K: Any, looks: int) -> int:
    """Search for about so many looks; the stage."""
    W = K.ways
    stop = W.looks + looks
    while W.looks < stop:
        if W.stage == FOLLOWING:
            follow_line(K)
        elif W.stage == GROWING:
            grow(K)
        elif W.stage == SHORTENING:
            shorten(K)
        elif W.stage == ROUNDING:
            round_corner(K)
        elif W.stage == PACING:
            pace_next(K)
        elif W.stage == SAMPLING:
            sample(K)
            W.stage, W.checked, W.chunk = PROVING, 0, LONGEST
        elif W.stage == PROVING:
            _prove_next(K)
        else:
            break
    return int(W.stage)


@jit
def prove_again(K: Any, first: int, share: float) -> None:
    """Let a motion that was found be proven anew from one of its places on, with a share of what is kept."""
    W = K.ways
    W.stage, W.again, W.is_free, W.checked, W.chunk = PROVING, 1, 0, first, 1
    W.again_with = max(share, _proof(K))


@part_jit
def begin_search(K: Any, q: Any) -> int:
    """Begin at a posture: what stands in its way, see ``obstruction``."""
    W = K.ways
    W.stage, W.looks, W.starts, W.posed, W.clear, W.met = FOLLOWING if W.straight else GROWING, 0, 0, 0, 0, 0
    W.hindered[:], W.least = 0, inf
    W.tree, W.joining, W.grown, W.places, W.share = 0, 0, 0, 0, 1.0
    W.followed = W.again = W.is_free = 0
    W.count[0] = W.count[1] = 0
    for j in range(K.chain.n):
        W.start[j] = q[j]
    know_surroundings(K, q)
    add_node(K, 0, q, -1)
    met = obstruction(K, q)
    if met != 0:
        W.stage = NO_WAY
    return met
