"""Two trees that grow towards each other, postures of a goal that are found meanwhile, and shortening.

The second tree has a root for each goal posture. Newton steps look for more of them, one start for every
eight growths once there is one. In a tube each step is led back into it. What is spent is counted in looks at
postures, and a slice ends between two pieces of work: slices of any size give the same way, bit for bit.
Source: Kuffner and LaValle 2000; Berenson et al. 2009 for the tube.
"""

from math import inf, sqrt
from typing import Any

from ftqp.kernel.arm.kinematics import mimic_places
from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.ways_room import (
    GROWING,
    NO_WAY,
    NODE_NUMBERS,
    NODES,
    PLACES,
    POSES,
    ROUNDING,
    SHORTENING,
)
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.search.looks import obstruction, passes, pose_arm
from ftqp.kernel.search.poses import (
    LONGEST,
    comes_to,
    is_in_tube,
    led_back,
    newton_step,
    squared,
    tip_error,
    tip_rows,
)

REACH = 1.0
"""Longest edge of a tree [rad or m]. A guess."""
STRIDE = 0.1
"""In a tube an edge is no longer than this [rad or m]."""
BALANCE = 1.0
"""A tree that is so many times as large as the other waits. The longest of 70 searches took 115 ms without,
and 37 with it."""
PER_START = 8
"""So many growths for one Newton start. A guess."""
NEAREST, WIDER, EVERYWHERE = 0.02, 8.0, 4
"""Starts are drawn so far about the arm, farther by the root of two each time, up to so many doublings; one
in so many anywhere. Guesses."""
CAPPED = 0.05
"""An edge that was given up may stand for so much of itself or more. A guess."""
VAIN, LESS = 60, 0.99
"""Shortening ends after so many draws that have not brought the length below this share. Guesses."""
NEARER, LITTLE = 300, 1e-3
"""The arm goes on towards a goal without a posture until so many tries in turn have not taken such a share of
the squared error. Guesses."""
AS_NEAR = 100_000
"""So many looks are spent on a way there at most, 2 s. With 20,000 the arm ended at least seven
times as far from 8 of 18 postures (``python benchmarks/ft_mbm.py --keep 0.02 --locks none``)."""
SAME = 1e-9
"""Places that are nearer than this are one [rad or m]. Rounding."""


@jit
def chance(W: Any) -> float:
    """The next of a sequence of numbers between 0 and 1 (two multiplicative generators, combined)."""
    W.first = (40014 * W.first) % 2147483563
    W.second = (40692 * W.second) % 2147483399
    return ((W.first + 2147483562 - W.second) % 2147483562) / 2147483562.0


@jit
def gap(a: Any, b: Any, n: int) -> float:
    """How far two places are apart [rad or m]."""
    s = 0.0
    for j in range(n):
        s += (a[j] - b[j]) * (a[j] - b[j])
    return sqrt(s)


@jit
def node_of(K: Any, tree: int, k: int) -> Any:
    """A node of a tree, (n,)."""
    n = K.chain.n
    return K.ways.node[tree, k * n : (k + 1) * n]


@jit
def nearest_node(K: Any, tree: int, q: Any) -> int:
    """The node that is nearest to a place."""
    W, n = K.ways, K.chain.n
    best, least, numbers = 0, inf, W.node[tree]
    for k in range(W.count[tree]):
        d, at = 0.0, k * n
        for j in range(n):
            d += (numbers[at + j] - q[j]) * (numbers[at + j] - q[j])
        if d < least:
            best, least = k, d
    return best


@jit
def is_full(K: Any) -> bool:
    """Whether a tree has no more room."""
    most = min(NODES, NODE_NUMBERS // K.chain.n)
    return bool(max(K.ways.count[0], K.ways.count[1]) >= most)


@jit
def add_node(K: Any, tree: int, q: Any, parent: int) -> int:
    """Add a node; its number."""
    W, k = K.ways, K.ways.count[tree]
    assign(node_of(K, tree, k), q, K.chain.n)
    W.parent[tree, k], W.count[tree] = parent, k + 1
    return k


@part_jit
def free_share(K: Any, a: Any, b: Any) -> float:
    """The share of the straight way of the joints from a to b up to which it is free, and in the tube."""
    W, n = K.ways, K.chain.n
    if W.tube:
        for j in range(n):
            W.line[0, j], W.line[1, j], W.line[2, j] = a[j], b[j] - a[j], 0.0
        if not is_in_tube(K, W.line, 1.0, gap(a, b, n)):
            return 0.0
    return passes(K, a, b)


@part_jit
def _draw(K: Any, centre: Any, spread: float) -> None:
    """Draw a place about another one; anywhere where the spread is infinite."""
    W, q = K.ways, K.ways.drawn
    for j in range(K.chain.n):
        x = chance(W)
        place = (
            W.low[j] + x * (W.high[j] - W.low[j]) if spread == inf else centre[j] + spread * (2.0 * x - 1.0)
        )
        q[j] = min(max(place, W.low[j]), W.high[j]) if W.free[j] else W.start[j]
    if K.chain.mimics:
        mimic_places(K.chain, q)


@jit
def step_towards(K: Any, a: Any, place: Any, b: Any) -> int:
    """b becomes a place on the way from a to another: 0 where that is not free, 2 the other one, else 1."""
    W, n = K.ways, K.chain.n
    far, reach = gap(a, place, n), STRIDE if W.tube else REACH
    share = 1.0 if far <= reach else reach / far
    for j in range(n):
        b[j] = a[j] + share * (place[j] - a[j])
    if far <= SAME:
        return 0
    if (
        W.tube
        and share < 1.0
        and (not led_back(K, b) or gap(b, place, n) > far - 0.05 * reach or gap(a, b, n) > 2.0 * reach)
    ):
        return 0
    known = free_share(K, a, b)
    if known < CAPPED or (known < 1.0 and W.tube):
        return 0
    if known < 1.0:
        for j in range(n):
            b[j] = a[j] + known * (b[j] - a[j])
        return 1
    return 2 if share == 1.0 else 1


@jit
def round_off(W: Any) -> None:
    """The way stands: its corners come next."""
    W.stage, W.corner, W.pieces, W.before = ROUNDING, 0, 0, 0.0


@part_jit
def explore(K: Any, looks: int) -> int:
    """Grow the first tree alone for about so many looks: the number of its next node; -1: none yet.

    It goes on towards a place drawn anywhere as far as it gets, then towards another one.
    """
    W, stop = K.ways, K.ways.looks + looks
    while W.looks < stop and not is_full(K):
        if not W.joining:
            _draw(K, W.start, inf)
            W.last = nearest_node(K, 0, W.drawn)
        W.looks += 1
        there = step_towards(K, node_of(K, 0, W.last), W.drawn, W.end)
        W.joining = 1 if there == 1 else 0
        if there:
            W.last = add_node(K, 0, W.end, W.last)
            return int(W.last)
    return -1


@jit
def lead_to(K: Any, node: int) -> int:
    """Let the way be that to a node of the first tree; the stage."""
    W, n, k, i = K.ways, K.chain.n, 0, node
    while i >= 0:
        k, i = k + 1, W.parent[0, i]
    W.places, W.stage = k, SHORTENING if k < PLACES else NO_WAY
    i = node if k < PLACES else -1
    while i >= 0:
        k -= 1
        assign(W.place[k], node_of(K, 0, i), n)
        i = W.parent[0, i]
    W.found, W.until, W.vain = W.looks, W.looks + W.shortening, 0
    return int(W.stage)


@jit
def _join(K: Any, a: int, b: int) -> None:
    """The way from the start over node a of the first tree and b of the second to its goal."""
    W, n = K.ways, K.chain.n
    if lead_to(K, a) == NO_WAY:
        return
    i = b if gap(node_of(K, 0, a), node_of(K, 1, b), n) > SAME else W.parent[1, b]
    while i >= 0:
        if W.places >= PLACES:
            W.stage = NO_WAY
            return
        assign(W.place[W.places], node_of(K, 1, i), n)
        W.places, i = W.places + 1, W.parent[1, i]


@jit
def _add_root(K: Any, q: Any) -> None:
    """Add a clear posture to go to; a straight way to it that is free is the way."""
    k = add_node(K, 1, q, -1)
    if not K.ways.tube and free_share(K, node_of(K, 0, 0), node_of(K, 1, k)) >= 1.0:
        _join(K, 0, k)


@jit
def add_goal(K: Any, q: Any) -> int:
    """Add a goal posture, or say what stands there."""
    W = K.ways
    met = W.goal_met = obstruction(K, q)
    assign(W.wanted, q, K.chain.n)
    if met == 0 and W.stage <= GROWING and not is_full(K):
        _add_root(K, q)
    return met


@jit
def _start_comes_to_goal(K: Any) -> bool:
    """One Newton start for a posture of the goal: at the arm, then farther from it; some anywhere."""
    W, n, q = K.ways, K.chain.n, K.ways.drawn
    k = W.starts
    W.starts = k + 1
    spread = 0.0 if k == 0 else NEAREST * 2.0 ** min(0.5 * k, WIDER)
    _draw(K, W.start, inf if k % EVERYWHERE == EVERYWHERE - 1 or spread > 4.0 else spread)
    if comes_to(K, q, W.goal):
        W.posed += 1
        return True
    if W.nears and W.left < W.least and obstruction(K, q) == 0:
        W.least = W.left
        assign(W.best, q, n)
    return False


@jit
def _draw_near(K: Any) -> None:
    """Draw one place nearer to a posture that is not clear: about it, or about the nearest clear one."""
    W, n, q = K.ways, K.chain.n, K.ways.drawn
    far, is_known = gap(W.start, W.wanted, n), W.least < inf
    size = chance(W) * (sqrt(W.least) if is_known else far)
    _draw(K, W.best if is_known and W.starts % 2 else W.wanted, size)
    W.starts += 1
    s = _distance_squared(K, q)
    if s < min(W.least, far * far) and obstruction(K, q) == 0:
        W.least = s
        assign(W.best, q, n)


@jit
def _distance_squared(K: Any, q: Any) -> float:
    """How far the goal is from a place [m2], or [rad2] of a posture."""
    W = K.ways
    if not W.has_goal:
        far = gap(q, W.wanted, K.chain.n)
        return far * far
    pose_arm(K, q)
    W.looks += 1
    tip_error(K, W.goal)
    return squared(W, W.goal_rows, 0) + squared(W, W.goal_rows, 3)


@jit
def _come_nearer(K: Any, q: Any, longest: float) -> float:
    """A step of q nearer to the goal, so long at most: the squared error then, see ``_distance_squared``."""
    W, s = K.ways, _distance_squared(K, q)
    if W.has_goal:
        tip_rows(K, W.goal)
        newton_step(K, q, W.goal_rows, 0.05 * s, longest)
        return _distance_squared(K, q)
    share = min(1.0, longest / sqrt(s)) if s > 0.0 else 0.0
    for j in range(K.chain.n):
        q[j] += share * (W.wanted[j] - q[j])
    return _distance_squared(K, q)


@part_jit
def _aim_near(K: Any) -> None:
    """Let the nearest posture be the goal, led on while it comes nearer: the goal has no clear one."""
    W = K.ways
    for _ in range(NEARER):
        assign(W.drawn, W.best, K.chain.n)
        s = _come_nearer(K, W.drawn, LONGEST)
        if s > (1.0 - LITTLE) * W.least or obstruction(K, W.drawn) != 0:
            break
        W.least = s
        assign(W.best, W.drawn, K.chain.n)
    W.nears, W.most, W.joining = 3, min(W.most, W.looks + AS_NEAR), 0
    _add_root(K, W.best)


@part_jit
def _begin_near(K: Any) -> None:
    """Let the last node be that of the first tree which is nearest to the goal, and go on from there."""
    W = K.ways
    W.left, W.nears, W.vain = inf, W.nears + 1, 0
    for k in range(W.count[0]):
        s = _distance_squared(K, node_of(K, 0, k))
        if s < W.left:
            W.left, W.last = s, k


@part_jit
def _lead_near(K: Any) -> None:
    """One try to go on from the last node to a nearer place, by a Newton step, a draw, or both.

    Each one in vain makes the next one smaller, and the way ends where many were, unless a posture that was
    found is nearer still.
    """
    W, q = K.ways, K.ways.drawn
    if W.vain >= NEARER or is_full(K):
        if W.nears == 2 and W.least < (1.0 - LITTLE) * W.left:
            _aim_near(K)
        else:
            lead_to(K, W.last)
        return
    a, longest = node_of(K, 0, W.last), LONGEST * 2.0 ** (-(W.vain % VAIN) / WIDER)
    kind = W.vain % 3
    _draw(K, a, 0.5 * longest if kind > 0 else 0.0)
    W.vain += 1
    if kind < 2:
        _come_nearer(K, q, longest)
    if step_towards(K, a, q, W.end):
        s = _distance_squared(K, W.end)
        if s < (1.0 - LITTLE) * W.left:
            W.left, W.vain, W.last = s, 0, add_node(K, 0, W.end, W.last)


@part_jit
def find_posture(K: Any, looks: int) -> int:
    """Look for a clear posture of the goal for about so many looks: whether ``drawn`` is one."""
    W = K.ways
    stop = W.looks + looks
    while W.looks < stop and W.starts < W.most_starts:
        if _start_comes_to_goal(K) and obstruction(K, W.drawn) == 0:
            W.clear += 1
            return 1
    return 0


@jit
def _follows(K: Any) -> bool:
    """Follow the path from ``follows`` to its next pose; whether the joints come there."""
    W, n = K.ways, K.chain.n
    if W.followed + 1 >= W.path:
        return False
    assign(W.followed_to, W.follows, n)
    if not comes_to(K, W.followed_to, W.path_pose[W.followed + 1]):
        return False
    for j in range(n):
        if W.free[j] and abs(W.followed_to[j] - W.follows[j]) > W.leap[j]:
            return False
    if W.straight:
        if passes(K, W.follows, W.followed_to) < 1.0:
            return False
    elif obstruction(K, W.followed_to) != 0:
        return False
    assign(W.follows, W.followed_to, n)
    W.followed += 1
    return True


@jit
def follow_path(K: Any, looks: int) -> int:
    """Follow the path from ``follows`` for about so many looks: whether it ends there."""
    stop = K.ways.looks + looks
    while K.ways.looks < stop:
        if not _follows(K):
            return 1
    return 0


@part_jit
def follow_line(K: Any) -> None:
    """Follow the straight way of the tip to its next pose: it is the way, or another one is looked for."""
    W, n = K.ways, K.chain.n
    if W.followed == 0:
        assign(W.follows, W.start, n)
        assign(W.place[0], W.start, n)
    if _follows(K):
        assign(W.place[W.followed], W.follows, n)
    elif W.followed + 1 >= W.path:
        W.places, W.found = W.path, W.looks
        round_off(W)
    else:
        W.stage, W.straight = GROWING, 0


@part_jit
def grow(K: Any) -> None:
    """One piece of a search: a start, an edge of one tree, or of the other one towards it."""
    W = K.ways
    if W.nears == 2 or W.nears == 4:
        _lead_near(K)
        return
    is_due = W.count[1] == 0 or W.grown >= PER_START * (W.starts - PER_START)
    if W.starts < W.most_starts and is_due and (W.has_goal or (W.nears and W.count[1] == 0)):
        if not W.has_goal:
            _draw_near(K)
        elif _start_comes_to_goal(K):
            met = add_goal(K, W.drawn)
            W.hindered[met] += 1
            W.clear += 1 if met == 0 else 0
        return
    if W.count[1] == 0 or W.looks >= W.most or is_full(K):
        if W.nears > 0:
            _begin_near(K)
        else:
            W.stage = NO_WAY
        return
    if W.joining == 0 and W.count[W.tree] > BALANCE * W.count[1 - W.tree] + 10:
        W.tree = 1 - W.tree  # the one that finds it harder to grow
    tree, other = W.tree, 1 - W.tree
    if W.joining:  # the other tree goes on towards what this one has added
        there = step_towards(K, node_of(K, other, W.last), node_of(K, tree, W.new), W.end)
        if there:
            W.last = add_node(K, other, W.end, W.last)
        if there == 2:
            if tree == 0:
                _join(K, W.new, W.last)
            else:
                _join(K, W.last, W.new)
        elif there == 0:
            W.joining, W.tree = 0, other
        return
    W.grown += 1
    _draw(K, W.start, inf)
    node = nearest_node(K, tree, W.drawn)
    W.looks += 1
    if step_towards(K, node_of(K, tree, node), W.drawn, W.end):
        W.new = add_node(K, tree, W.end, node)
        W.joining, W.last = 1, nearest_node(K, other, W.end)
    else:
        W.tree = other


@jit
def _walk(K: Any, a: Any, b: Any) -> int:
    """Steps from a to b into ``walk``: how many, the last one is b, or 0 where it ends before."""
    W, n = K.ways, K.chain.n
    if not W.tube:
        assign(W.walk[0], b, n)
        return 1 if free_share(K, a, b) >= 1.0 else 0
    assign(W.followed_to, a, n)
    for m in range(POSES):
        there = step_towards(K, W.followed_to, b, W.walk[m])
        assign(W.followed_to, W.walk[m], n)
        if there != 1:
            return m + 1 if there == 2 else 0
    return 0


@jit
def _length_of(Q: Any, first: int, last: int, n: int) -> float:
    s = 0.0
    for i in range(first, last):
        s += gap(Q[i], Q[i + 1], n)
    return s


@part_jit
def shorten(K: Any) -> None:
    """One try to make the way shorter: two places drawn on it are joined if that is free."""
    W, n, Q, a, b = K.ways, K.chain.n, K.ways.place, K.ways.begin, K.ways.finish
    k = W.places
    if k <= 2 or W.looks >= W.until or W.vain >= VAIN:
        round_off(W)
        return
    x, y = chance(W) * (k - 1), chance(W) * (k - 1)
    x, y = min(x, y), max(x, y)
    W.vain += 1
    if chance(W) < 0.5 or W.tube:
        x, y = float(int(x)), min(float(int(y)) + 1.0, k - 1.0)
    i, j = int(x), min(int(y), k - 2)
    if j <= i:
        return
    for c in range(n):
        a[c], b[c] = Q[i, c] + (x - i) * (Q[i + 1, c] - Q[i, c]), Q[j, c] + (y - j) * (Q[j + 1, c] - Q[j, c])
    before = _length_of(Q, i, j + 1, n) - gap(Q[i], a, n) - gap(b, Q[j + 1], n)
    if gap(a, b, n) > 0.999 * before:
        return
    m, first, last = _walk(K, a, b), 1 if x > i else 0, 1 if y >= j + 1 else 0
    shift = m + first - last - (j - i)
    if m == 0 or k + shift > PLACES:
        return
    after = gap(a, W.walk[0], n) + _length_of(W.walk, 0, m - 1, n)
    if after > 0.999 * before:
        return
    if shift > 0:
        for p in range(k - 1, j, -1):
            assign(Q[p + shift], Q[p], n)
    elif shift < 0:
        for p in range(j + 1, k):
            assign(Q[p + shift], Q[p], n)
    if first:
        assign(Q[i + 1], a, n)
    for p in range(m - last):
        assign(Q[i + 1 + first + p], W.walk[p], n)
    W.places = k + shift
    if after < LESS * before:
        W.vain = 0
