"""Configurations that reach a goal: damped Newton steps from a start, and all self-motions through them.

Source: docs/theory/unidentified-failures.md, "Self-motions".
"""

from math import pi
from typing import Any

from ftqp.kernel.jit import jit, part_jit
from ftqp.kernel.layout.enums import CLOSED
from ftqp.kernel.study.null_directions import decompose, least_step
from ftqp.kernel.study.task_values import task_values
from ftqp.kernel.study.tracing import correct, nearest_turn, put_joints, trace

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
    """All self-motions that are found from the starts; returns how many, negative where memory was short.

    It ends when so many ``quiet`` solutions in a row lay on known curves, or with the last start.

    Args:
        S: The record of the study.
        starts: Joint values to start from, (k, n).
        quiet: As above.
        path: Rows of all curves, filled.
        parts: Arc lengths, filled; see ``trace``.
        firsts: Filled: the first row of each curve, and behind the last the number of rows, (c + 1,).
        facts: Filled: how a curve ended, its length, its least sigma, whether it crosses itself, (c, 4).
        windings: Filled: turns of each joint on one round, (c, n).
    """
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
        for i in range(n):
            windings[found, i] = study.winding[i]
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
        for i in range(n):
            out[j, i] = S.state.q[i]
    return exact
