"""Studies of an arm: task values, solutions and self-motions of many configurations or goals."""

from collections.abc import Callable

import numpy as np

from ftqp.kernel.continuation.passing_bodies import nearest_distance
from ftqp.kernel.jit import carray, pointer
from ftqp.kernel.layout.study_room import GOAL_SIZE, study_dtype
from ftqp.kernel.study.null_directions import decompose
from ftqp.kernel.study.solutions import self_motions_through, solve_goal, spread
from ftqp.kernel.study.task_values import error_rates, jacobian_rates, task_values
from ftqp.kernel.study.tracing import correct, put_joints, trace

_FLOAT, _WHOLE = np.dtype(np.float64), np.dtype(np.int64)


def study_values(capacity: int) -> Callable[..., int]:
    """e, A, D = -de/dq and H[l] = dA/dq_l at many configurations."""
    dtype = study_dtype(capacity)

    def study_values(
        address: int, count: int, q_at: int, e_at: int, A_at: int, D_at: int, H_at: int, rates: int
    ) -> int:
        """Arrays (count, ...): q (n,), e (m,), A and D (m, n), and with ``rates`` H (n, m, n)."""
        S = carray(pointer(address), 1, dtype)[0]
        m, n = S.study.m, S.chain.n
        q, e = carray(pointer(q_at), (count, n), _FLOAT), carray(pointer(e_at), (count, m), _FLOAT)
        A, D = carray(pointer(A_at), (count, m, n), _FLOAT), carray(pointer(D_at), (count, m, n), _FLOAT)
        H = carray(pointer(H_at), (count if rates else 0, n, m, n), _FLOAT)
        for k in range(count):
            put_joints(S, q[k])
            task_values(S)
            for row in range(m):
                e[k, row] = S.study.e[row]
                for i in range(n):
                    A[k, row, i] = S.study.A[row, i]
            error_rates(S, D[k])
            if rates:
                jacobian_rates(S, H[k])
        return 0

    return study_values


def study_clearances(capacity: int) -> Callable[..., int]:
    """How near bodies that are to be kept apart come at many configurations."""
    dtype = study_dtype(capacity)

    def study_clearances(address: int, count: int, q_at: int, out_at: int) -> int:
        """The least distance (count,) at each q (count, n), inf where nothing is to be kept apart."""
        S = carray(pointer(address), 1, dtype)[0]
        q, out = carray(pointer(q_at), (count, S.chain.n), _FLOAT), carray(pointer(out_at), (count,), _FLOAT)
        for k in range(count):
            put_joints(S, q[k])
            out[k] = nearest_distance(S)
        return 0

    return study_clearances


def study_solutions(capacity: int) -> Callable[..., int]:
    """Configurations brought to their goals by damped Newton steps."""
    dtype = study_dtype(capacity)

    def study_solutions(
        address: int, count: int, q_at: int, goals: int, goals_at: int, left_at: int, bounded: int, near: int
    ) -> int:
        """Rows q (count, n) from start to solution; ``left`` (count, 2): error that is left, least sigma.

        Goals, (goals, 12), are one for all or one each; ``near`` takes plain Newton steps.
        """
        S = carray(pointer(address), 1, dtype)[0]
        n = S.chain.n
        q = carray(pointer(q_at), (count, n), _FLOAT)
        goal = carray(pointer(goals_at), (goals, GOAL_SIZE), _FLOAT)
        left = carray(pointer(left_at), (count, 2), _FLOAT)
        for k in range(count):
            put_joints(S, q[k])
            for j in range(GOAL_SIZE):
                S.study.goal[j] = goal[min(k, goals - 1), j]
            if near:
                correct(S)
            else:
                solve_goal(S, bounded)
            left[k, 0] = task_values(S)
            decompose(S)
            left[k, 1] = S.study.sigma[S.study.m - 1]
            for i in range(n):
                q[k, i] = S.state.q[i]
        return 0

    return study_solutions


def study_curve(capacity: int) -> Callable[..., int]:
    """One self-motion, traced from a start."""
    dtype = study_dtype(capacity)

    def study_curve(address: int, q_at: int, path_at: int, size: int, parts_at: int) -> int:
        """Rows of the curve through q, (n,), in ``path`` (size, n); returns how many."""
        S = carray(pointer(address), 1, dtype)[0]
        n = S.chain.n
        put_joints(S, carray(pointer(q_at), (n,), _FLOAT))
        path = carray(pointer(path_at), (size, n), _FLOAT)
        return trace(S, path, carray(pointer(parts_at), (size,), _FLOAT), 0)

    return study_curve


def study_self_motions(capacity: int) -> Callable[..., int]:
    """All self-motions of many goals, as points at equal arc lengths."""
    dtype = study_dtype(capacity)

    def study_self_motions(
        address: int,
        table_at: int,
        path_at: int,
        size: int,
        parts_at: int,
        firsts_at: int,
        first: int,
        last: int,
    ) -> int:
        """Goals ``first`` to ``last - 1``.

        ``path`` (size, n), ``parts`` (size,) and ``firsts`` (c + 1,) are memory, which holds the curves of
        the last goal on return. The table holds the number of goals k, of starts, of quiet solutions, of
        curves c and of points p, then addresses: goals (k, 12), starts, q (k, c, p, n), counts (k,), facts
        (k, c, 4), windings (k, c, n).
        """
        S = carray(pointer(address), 1, dtype)[0]
        n = S.chain.n
        table = carray(pointer(table_at), (11,), _WHOLE)
        k, starts, quiet, c, p = table[0], table[1], table[2], table[3], table[4]
        goals = carray(pointer(table[5]), (k, GOAL_SIZE), _FLOAT)
        start = carray(pointer(table[6]), (starts, n), _FLOAT)
        q = carray(pointer(table[7]), (k, c, p, n), _FLOAT)
        counts = carray(pointer(table[8]), (k,), _WHOLE)
        facts = carray(pointer(table[9]), (k, c, 4), _FLOAT)
        windings = carray(pointer(table[10]), (k, c, n), _WHOLE)
        path, parts = carray(pointer(path_at), (size, n), _FLOAT), carray(pointer(parts_at), (size,), _FLOAT)
        firsts = carray(pointer(firsts_at), (c + 1,), _WHOLE)
        for g in range(first, last):
            for j in range(GOAL_SIZE):
                S.study.goal[j] = goals[g, j]
            found = self_motions_through(S, start, quiet, path, parts, firsts, facts[g], windings[g])
            counts[g] = found
            for j in range(abs(found) if p > 0 else 0):
                spread(S, path, parts, firsts[j], firsts[j + 1], int(facts[g, j, 0]), windings[g, j], q[g, j])
        return 0

    return study_self_motions
