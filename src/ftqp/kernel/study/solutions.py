"""Configurations that reach a goal: damped Newton steps from a start, and all self-motions through them.

A self-motion is that of an arm with one joint more than task rows, traced from a start until it closes.
Source: docs/theory/unidentified-failures.md, "Self-motions".
"""

from math import floor, pi, sqrt
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import CLOSED, CUT, UNFINISHED
from ftqp.kernel.maths.linear_systems import assign, determinant_sign, lu_factor, plus_products
from ftqp.kernel.study.task_values import (
    any_null_direction,
    decompose,
    least_step,
    onto_null_space,
    task_values,
)

ITERATIONS = 60
"""Newton steps of one start at most."""
DAMPING = 0.05
"""Damping of a step over the square of the error: steps are those of Newton near a solution."""
LONGEST = 0.7
"""Largest entry of a step [rad or m]."""


@part_jit
def solve_goal(S: Any, bounded: int) -> float:
    """Bring ``state.q`` to a solution of x(q) = goal if that goes well; returns the error that is left [m].

    Steps are V diag(sigma/(sigma^2 + damping)) U' e with a damping that falls with the error; where
    ``bounded``, joints stop at their limits.
    """
    study, n = S.study, S.chain.n
    size = task_values(S)
    for _ in range(ITERATIONS):
        if size <= study.tolerance:
            break
        decompose(S)
        largest = least_step(S, DAMPING * size * size)
        share = LONGEST / largest if largest > LONGEST else 1.0
        for i in range(n):
            S.state.q[i] += share * study.dq[i]
            if bounded and not study.held[i]:
                S.state.q[i] = min(max(S.state.q[i], study.q_min[i]), study.q_max[i])
        size = task_values(S)
    return size


@jit
def _is_known(S: Any, path: Any, rows: int, reach: float) -> bool:
    """Whether ``state.q`` is nearer than ``reach`` to a row of the curves so far."""
    n = S.chain.n
    for k in range(rows):
        square = 0.0
        for i in range(n):
            d = nearest_turn(S, i, S.state.q[i] - path[k, i])
            square += d * d
            if square > reach * reach:
                break
        if square <= reach * reach:
            return True
    return False


@jit
def _inside(S: Any) -> bool:
    """Whether every joint is inside the limits at which curves end."""
    for i in range(S.chain.n):
        if not (S.study.q_min[i] <= S.state.q[i] <= S.study.q_max[i]):
            return False
    return True


@jit
def self_motions_through(
    S: Any, starts: Any, quiet: int, path: Any, parts: Any, firsts: Any, facts: Any, windings: Any
) -> int:
    """All self-motions that are found from the starts; returns how many, negative where memory was short."""
    study, n = S.study, S.chain.n
    found, rows, known = 0, 0, 0
    firsts[0] = 0
    for k in range(len(starts)):
        put_joints(S, starts[k])
        if not solve_goal(S, 0) <= study.tolerance or not _inside(S):
            continue
        if _is_known(S, path, rows, 2.0 * study.step):
            known += 1
            if known >= quiet:
                break
            continue
        if found == len(facts) or rows == len(path):
            return -found
        count = trace(S, path, parts, rows)
        if count < 2:
            continue
        known = 0
        facts[found, 0], facts[found, 1] = study.closed, study.arc
        facts[found, 2], facts[found, 3] = study.least, study.crossed
        assign(windings[found], study.winding, n)
        rows += count
        found += 1
        firsts[found] = rows
    return found


@jit
def spread(S: Any, path: Any, parts: Any, first: int, end: int, closed: int, winding: Any, out: Any) -> int:
    """Points at equal arc lengths along a curve into the rows of ``out``; returns how many are exact.

    A closed curve begins with its first row, and its last point lies one part before it; one that is cut has
    its ends for ends. Points are interpolated between rows and corrected.
    """
    n, count = S.chain.n, len(out)
    total = 0.0
    for k in range(first, end):
        total += parts[k]
    gap = total / count if closed == CLOSED else total / max(count - 1, 1)
    row, behind, exact = first, 0.0, 0
    last = end - 1 if closed == CLOSED else end - 2
    for j in range(count):
        want = j * gap
        length = parts[row + 1] if row + 1 < end else parts[first]
        while want > behind + length and row < last:
            behind += length
            row += 1
            length = parts[row + 1] if row + 1 < end else parts[first]
        share = min((want - behind) / length, 1.0) if length > 0.0 else 0.0
        for i in range(n):
            q = path[row, i]
            other = path[row + 1, i] if row + 1 < end else path[first, i] + 2.0 * pi * winding[i]
            S.state.q[i] = q + share * (other - q)
        if correct(S):
            exact += 1
        assign(out[j], S.state.q, n)
    return exact


CORRECTIONS = 8
"""Newton steps back onto the curve at most; two or three are usual."""
LARGEST_TURN = 0.9945
"""Cosine of the turn of the tangent, 6 degrees, from which a step is halved."""
LEAST_STEP = 1e-6
"""Shortest step [rad or m]; where it does not do, the curve is lost."""
CROSSING_STEP = 1e-4
"""A change of branch within so short a step is a crossing of the curve with itself [rad or m]."""
FIRST_CLOSURE = 5
"""Points before which a curve is not looked at for closing."""
BISECTIONS = 48
"""Halvings of the last step before a joint limit."""


@jit
def put_joints(S: Any, q: Any) -> None:
    """state.q <- q."""
    assign(S.state.q, q, S.chain.n)


@jit
def correct(S: Any) -> bool:
    """Bring ``state.q`` onto x(q) = goal by least-norm Newton steps; the singular parts are of its end."""
    for _ in range(CORRECTIONS):
        size = task_values(S)
        decompose(S)
        if size <= S.study.tolerance:
            return True
        least_step(S, 0.0)
        for i in range(S.chain.n):
            S.state.q[i] += S.study.dq[i]
    return False


@jit
def side_of(S: Any, t: Any) -> float:
    """The sign of det [A; t], rows of held joints being their own: it changes where branches change."""
    study, n = S.study, S.chain.n
    M, at = study.square, study.m
    for row in range(study.m):
        assign(M[row], study.A[row], n)
    assign(M[at], t, n)
    at += 1
    for j in range(n):
        if study.held[j] and at < n:
            for i in range(n):
                M[at, i] = 1.0 if i == j else 0.0
            at += 1
    lu_factor(M, n, study.pivot)
    return determinant_sign(M, n, study.pivot)


@jit
def _advance(S: Any, here: Any, h: float) -> bool:
    """A step of length h from ``here`` into ``state.q`` and ``ahead``, the tangent; whether it holds."""
    study, n = S.study, S.chain.n
    t, middle, ahead, q = study.tangent, study.middle, study.ahead, S.state.q
    for i in range(n):
        q[i] = here[i] + 0.5 * h * t[i]
        middle[i] = t[i]
    task_values(S)
    decompose(S)
    onto_null_space(S, middle)
    for i in range(n):
        q[i] = here[i] + h * middle[i]
    if not correct(S):
        return False
    square, cosine = 0.0, 0.0
    for i in range(n):
        d = q[i] - here[i]
        square += d * d
        ahead[i] = middle[i]
    onto_null_space(S, ahead)
    cosine = plus_products(cosine, ahead, t, n)
    if cosine < LARGEST_TURN and h > LEAST_STEP:
        return False
    if square < 0.25 * h * h or square > 2.25 * h * h:
        return False
    side = side_of(S, ahead)
    if side * study.side < 0.0:
        if h > CROSSING_STEP:
            return False
        study.crossed = 1
    study.cosine, study.side_ahead = cosine, side
    return True


@jit
def _excess(S: Any) -> float:
    """How far the worst joint of ``state.q`` is beyond its limits, negative inside."""
    worst = -1e300
    for i in range(S.chain.n):
        if S.study.held[i]:
            continue
        worst = max(worst, S.state.q[i] - S.study.q_max[i], S.study.q_min[i] - S.state.q[i])
    return worst


@jit
def _cut(S: Any, here: Any, h: float) -> bool:
    """The last point inside the limits, up to a step of length h, into ``state.q``; whether there is one."""
    low, high = 0.0, h
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if _advance(S, here, middle) and _excess(S) <= 0.0:
            low = middle
        else:
            high = middle
    return low > 0.0 and _advance(S, here, low)


@jit
def nearest_turn(S: Any, i: int, difference: float) -> float:
    """A difference of joint i, modulo one turn where the joint's values count so [rad or m]."""
    if S.study.wraps[i]:
        return difference - 2.0 * pi * floor(difference / (2.0 * pi) + 0.5)
    return difference


@jit
def _closes(S: Any, start: Any, here: Any, h: float) -> float:
    """The distance from ``here`` to the start, where the segment to ``state.q`` passes it; else -1."""
    study, n = S.study, S.chain.n
    along, square, distance, agree = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        d = S.state.q[i] - here[i]
        w = nearest_turn(S, i, start[i] - here[i])
        along += w * d
        square += d * d
        distance += w * w
        agree += study.first[i] * study.ahead[i]
    if distance > 4.0 * h * h or agree < 0.9:
        return -1.0
    share = along / square
    beside = distance - share * share * square
    if share < -0.01 or share > 1.01 or beside > 0.09 * h * h:
        return -1.0
    for i in range(n):
        w = nearest_turn(S, i, start[i] - here[i])
        turns = floor((here[i] + w - start[i]) / (2.0 * pi) + 0.5)
        study.winding[i] = int(turns) if study.wraps[i] else 0
    return sqrt(distance)


@jit
def _follow(S: Any, path: Any, parts: Any, at: int, rows: int) -> int:
    """Follow the curve from its last row along ``tangent``; returns how many rows it has then."""
    study, n = S.study, S.chain.n
    h = study.step
    while at + rows < len(path):
        here = path[at + rows - 1]
        if not _advance(S, here, h):
            h *= 0.5
            if h < LEAST_STEP:
                study.closed = CUT
                return rows
            continue
        out = _excess(S) > 0.0
        if out and not _cut(S, here, h):
            study.closed = CUT
            return rows
        cosine, side = study.cosine, study.side_ahead
        if not out and rows >= FIRST_CLOSURE:
            left = _closes(S, path[at], here, h)
            if left >= 0.0:
                parts[at] = left
                study.closed = CLOSED
                return rows
        square = 0.0
        for i in range(n):
            d = S.state.q[i] - here[i]
            square += d * d
            path[at + rows, i] = S.state.q[i]
            study.tangent[i] = study.ahead[i]
        # arc over chord of a circle through both, to fourth order in the turn
        parts[at + rows] = sqrt(square) * (1.0 + max(0.0, 1.0 - cosine) / 12.0)
        study.least = min(study.least, study.sigma[study.m - 1])
        study.side = side
        rows += 1
        if out:
            study.closed = CUT
            return rows
        h = min(study.step, 2.0 * h)
    study.closed = UNFINISHED
    return rows


@jit
def _reverse(S: Any, path: Any, parts: Any, at: int, rows: int) -> None:
    """Turn the rows of a curve round, with the lengths of their segments."""
    last = at + rows - 1
    for k in range(rows // 2):
        for i in range(S.chain.n):
            path[at + k, i], path[last - k, i] = path[last - k, i], path[at + k, i]
    for k in range((rows - 1) // 2):
        parts[at + 1 + k], parts[last - k] = parts[last - k], parts[at + 1 + k]


@part_jit
def trace(S: Any, path: Any, parts: Any, at: int) -> int:
    """Trace the self-motion through ``state.q``, a solution, into rows of ``path`` from ``at`` on.

    A curve that closes begins at the start, and ``parts[at]`` is the length back to it; one that is cut runs
    from end to end. Values stay unwrapped. ``parts`` are the arc lengths of the segments that end in a row.
    """
    study, n = S.study, S.chain.n
    study.crossed = 0
    if not correct(S):
        study.closed = CUT
        return 0
    any_null_direction(S, study.tangent)
    study.side, study.least = side_of(S, study.tangent), study.sigma[study.m - 1]
    for i in range(n):
        path[at, i] = S.state.q[i]
        study.first[i] = study.tangent[i]
        study.winding[i] = 0
    side = study.side
    parts[at] = 0.0
    rows = _follow(S, path, parts, at, 1)
    if study.closed == CUT:
        _reverse(S, path, parts, at, rows)
        for i in range(n):
            study.tangent[i] = -study.first[i]
        study.side = -side
        rows = _follow(S, path, parts, at, rows)
        if study.closed == CLOSED:
            study.closed = CUT
    study.arc = 0.0
    for k in range(rows):
        study.arc += parts[at + k]
    return rows
