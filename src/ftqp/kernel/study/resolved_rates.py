"""Joint rates of the point-to-point law of any arm, all of its joints moving or some standing still.

Source: docs/theory/after-a-failure.md, "The law and its clock".
"""

from math import sqrt
from typing import Any

from ftqp.kernel.jit import jit
from ftqp.kernel.maths.cholesky import factor, solve_factored
from ftqp.kernel.study.task_values import task_values
from ftqp.kernel.study.tracing import put_joints


@jit
def weigh(S: Any, L: Any, q: Any) -> bool:
    """P = M A' and the factor of B = A M A' at q, e in ``study``; False where B is singular."""
    n, m = S.chain.n, S.study.m
    put_joints(S, q)
    L.miss = task_values(S)
    A = S.study.A
    for i in range(n):
        for r in range(m):
            s = 0.0
            for k in range(n):
                s += L.M[i, k] * A[r, k]
            L.P[i, r] = s
    for r in range(m):
        for c in range(r + 1):
            s = 0.0
            for i in range(n):
                s += A[r, i] * L.P[i, c]
            L.B[r, c] = s
    regular = factor(L.B, m)
    low, high = L.B[0, 0], L.B[0, 0]
    for r in range(1, m):
        low, high = min(low, L.B[r, r]), max(high, L.B[r, r])
    L.regular = (low / high) ** 2 if regular else 0.0
    return regular


@jit
def put_rates(S: Any, L: Any, out: Any) -> None:
    """out <- I_S P B^-1 rhs with what ``weigh`` left; |out| into ``speed``. The right side is lost."""
    n, m = S.chain.n, S.study.m
    solve_factored(L.B, m, L.rhs)
    square = 0.0
    for i in range(n):
        s = 0.0
        for r in range(m):
            s += L.P[i, r] * L.rhs[r]
        out[i] = L.free[i] * s
        square += out[i] * out[i]
    L.speed = sqrt(square)


@jit
def law_rates(S: Any, L: Any, q: Any, out: Any) -> bool:
    """out <- I_S G e at q, gain 1; |e| in ``miss``. False where the arm is singular, and out is zero."""
    if not weigh(S, L, q):
        for i in range(S.chain.n):
            out[i] = 0.0
        L.speed = 0.0
        return False
    for r in range(S.study.m):
        L.rhs[r] = S.study.e[r]
    put_rates(S, L, out)
    return True


@jit
def led_rates(S: Any, L: Any, q: Any, out: Any) -> bool:
    """out <- I_S G w at q, w the rate ``wanted`` of the task."""
    regular = weigh(S, L, q)
    for r in range(S.study.m):
        L.rhs[r] = L.wanted[r]
    if regular:
        put_rates(S, L, out)
    return regular
