"""Studies of an arm: task values, solutions, self-motions and continuations of many postures or goals."""

from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.linear_systems import assign
from ftqp.kernel.study.continuations import (
    aim,
    begin,
    bounded_run,
    exact_run,
    nearest_distance,
    self_speed_run,
)
from ftqp.kernel.study.solutions import correct, put_joints, self_motions_through, solve_goal, spread, trace
from ftqp.kernel.study.task_values import decompose, error_rates, jacobian_rates, task_values


@jit
def values_at(S: Any, q: Any, e: Any, A: Any, D: Any, H: Any) -> None:
    """e, A and D = -de/dq at configurations, and where there is room for it H[l] = dA/dq_l."""
    for k in range(len(q)):
        put_joints(S, q[k])
        task_values(S)
        for row in range(S.study.m):
            e[k, row] = S.study.e[row]
            assign(A[k, row], S.study.A[row], S.chain.n)
        error_rates(S, D[k])
        if len(H) > 0:
            jacobian_rates(S, H[k])


@jit
def clearances_at(S: Any, q: Any, out: Any) -> None:
    """The least distance of bodies that are to be kept apart at configurations; inf where none are."""
    for k in range(len(q)):
        put_joints(S, q[k])
        out[k] = nearest_distance(S)


@jit
def solutions_from(S: Any, q: Any, goals: Any, left: Any, bounded: int, near: int) -> None:
    """Damped Newton steps, ``near`` plain ones, to goals; ``left``: error and least singular value."""
    for k in range(len(q)):
        put_joints(S, q[k])
        aim(S, goals[min(k, len(goals) - 1)])
        if near:
            correct(S)
        else:
            solve_goal(S, bounded)
        left[k, 0] = task_values(S)
        decompose(S)
        left[k, 1] = S.study.sigma[S.study.m - 1]
        assign(q[k], S.state.q, S.chain.n)


@jit
def curve_through(S: Any, q: Any, path: Any, parts: Any) -> int:
    """Rows of the self-motion through q, in ``path``: how many."""
    put_joints(S, q)
    return trace(S, path, parts, 0)


@jit
def self_motions_of(
    S: Any, goals: Any, start: Any, quiet: int, q: Any, counts: Any, facts: Any, windings: Any, path: Any,
    parts: Any, firsts: Any, points: int, first: int, last: int,
) -> None:  # fmt: skip
    """All self-motions of goals ``first`` to ``last - 1``, as points at equal arc lengths."""
    for g in range(first, last):
        aim(S, goals[g])
        found = self_motions_through(S, start, quiet, path, parts, firsts, facts[g], windings[g])
        counts[g] = found
        for j in range(abs(found) if points > 0 else 0):
            spread(S, path, parts, firsts[j], firsts[j + 1], int(facts[g, j, 0]), windings[g, j], q[g, j])


@jit
def _keep(C: Any, facts: Any, ending: int) -> None:
    """What became of a continuation."""
    facts[0], facts[1], facts[2], facts[3] = ending, C.sample, C.position, C.rotation
    facts[4], facts[5], facts[6] = C.margin, C.hurry, C.clearance


@jit
def continuations(
    S: Any, C: Any, goals: Any, q: Any, at: Any, failed: Any, speed: Any, facts: Any, path: Any, keep: int,
    bounded: int, first: int, last: int,
) -> None:  # fmt: skip
    """Continuations from starts ``first`` to ``last - 1``: by one bounded QP a sample, or exact ones."""
    for s in range(first, last):
        begin(S, C, q[s], failed[s], speed[s])
        if bounded:
            _keep(C, facts[s], bounded_run(S, C, goals, at[s], path, keep))
        else:
            _keep(C, facts[s], exact_run(S, C, goals, at[s], path, keep))


@jit
def self_speed_tracks(
    S: Any, C: Any, goals: Any, speeds: Any, q: Any, facts: Any, first: int, last: int
) -> None:
    """Motions ``first`` to ``last - 1`` along a path at given self-motion speeds; row 0 of q starts."""
    for s in range(first, last):
        facts[s, 0], facts[s, 1] = self_speed_run(S, goals, C.dt, speeds[s], q[s])
